# OptiX, where there is nvcc and OptiX_ROOT, a variable or one of the environment, names a directory that has its
# headers: makes the target OptiX::headers, and wfpg_add_optix_programs() puts device programs into a library as PTX.
# Programs load the rest from the driver when they run.
find_path(OptiX_INCLUDE_DIR optix.h HINTS "${OptiX_ROOT}" ENV OptiX_ROOT PATH_SUFFIXES include
          DOC "Directory that holds optix.h")
mark_as_advanced(OptiX_INCLUDE_DIR)
if(NOT WFPG_HAS_CUDA OR NOT OptiX_INCLUDE_DIR)
  return()
endif()

add_library(OptiX::headers INTERFACE IMPORTED)
target_include_directories(OptiX::headers INTERFACE "${OptiX_INCLUDE_DIR}")

# Compiles a .cu file of device programs and gives `target` their text, as the variable `variable`.
function(wfpg_add_optix_programs target source variable)
  add_library(${target}_programs OBJECT ${source})
  # OptiX compiles for the GPU that it finds, from PTX for the oldest that nvcc 13 knows.
  set_target_properties(
    ${target}_programs PROPERTIES CUDA_PTX_COMPILATION ON CUDA_SEPARABLE_COMPILATION ON CUDA_ARCHITECTURES 75-virtual)
  target_link_libraries(${target}_programs PRIVATE wfpg::wfpg OptiX::headers)
  wfpg_add_cuda_options(${target}_programs)

  set(script "${PROJECT_SOURCE_DIR}/cmake/EmbedText.cmake")
  set(embedded "${CMAKE_CURRENT_BINARY_DIR}/${target}_programs.cpp")
  add_custom_command(
    OUTPUT "${embedded}"
    COMMAND "${CMAKE_COMMAND}" "-Dinput=$<TARGET_OBJECTS:${target}_programs>" "-Doutput=${embedded}"
            "-Dvariable=${variable}" -P "${script}"
    DEPENDS ${target}_programs "$<TARGET_OBJECTS:${target}_programs>" "${script}"
    VERBATIM)
  target_sources(${target} PRIVATE "${embedded}")
endfunction()
