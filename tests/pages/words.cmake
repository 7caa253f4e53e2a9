# cmake -Droot=DIR -P words.cmake: checks that README.md can be read in five minutes.
set(most 700)
file(READ "${root}/README.md" page)
string(REGEX REPLACE "<!--[^>]*-->" "" page "${page}")  # GitHub does not show comments
string(REGEX REPLACE ";|\\[|\\]" "." page "${page}")
string(REGEX MATCHALL "[^ \n]+" words "${page}")
list(LENGTH words count)
if(count GREATER most)
  message(FATAL_ERROR "README.md has ${count} words, at most ${most} are wanted")
endif()
