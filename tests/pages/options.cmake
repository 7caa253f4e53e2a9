# cmake -Droot=DIR -P options.cmake: every option of the library is in docs/tuning.md.
file(READ "${root}/docs/tuning.md" page)
set(missing "")
foreach(
  place IN ITEMS
  sampling_options.hpp:sampling_options
  octree_guide.hpp:guider_options
  field_store.hpp:kept_field_options
  radiance_field.hpp:field_options
  light_guide.hpp:light_guide_options
  sarsa_options.hpp:sarsa_grid_options
  irradiance_records_options.hpp:irradiance_records_options)
  string(REPLACE ":" ";" place "${place}")
  list(GET place 0 header)
  list(GET place 1 name)
  file(READ "${root}/include/wfpg/${header}" text)
  string(FIND "${text}" "struct ${name} " begin)
  string(SUBSTRING "${text}" ${begin} -1 text)
  string(FIND "${text}" "\n};" end)
  string(SUBSTRING "${text}" 0 ${end} text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  while(text MATCHES "[ \n]([a-z_0-9]+)( =[^;]*)?;")
    set(member "${CMAKE_MATCH_1}")
    string(FIND "${text}" "${CMAKE_MATCH_0}" at)
    string(LENGTH "${CMAKE_MATCH_0}" length)
    math(EXPR at "${at} + ${length}")
    string(SUBSTRING "${text}" ${at} -1 text)
    if(NOT page MATCHES "`(options\\.)?${member}`")
      string(APPEND missing " ${name}::${member}")
    endif()
  endwhile()
endforeach()
if(missing)
  message(FATAL_ERROR "docs/tuning.md does not tell of${missing}")
endif()
