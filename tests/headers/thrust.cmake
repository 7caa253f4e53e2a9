# cmake -Dheaders=FOLDER -P thrust.cmake
# Fails for each header that includes Thrust without exec/support/thrust.hpp, which chooses Thrust's device system.
file(GLOB_RECURSE files "${headers}/*.hpp")
list(FILTER files EXCLUDE REGEX "/exec/support/thrust\\.hpp$")
foreach(file IN LISTS files)
  file(READ "${file}" text)
  string(FIND "${text}" "#include <thrust/" thrust)
  string(FIND "${text}" "#include <wfpg/exec/support/thrust.hpp>" ours)
  if(thrust GREATER -1 AND (ours EQUAL -1 OR ours GREATER thrust))
    message(SEND_ERROR "${file} includes Thrust before <wfpg/exec/support/thrust.hpp>")
  endif()
endforeach()
