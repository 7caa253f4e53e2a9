# cmake -Dinput=FILE -Doutput=FILE -Dvariable=NAMESPACE::NAME -P EmbedText.cmake
# writes C++ that defines the variable, a const char*, as the text of a file.
file(READ "${input}" text)
string(REGEX MATCH "^(.+)::([^:]+)$" matched "${variable}")
file(WRITE "${output}" "namespace ${CMAKE_MATCH_1} {
extern const char* const ${CMAKE_MATCH_2};
const char* const ${CMAKE_MATCH_2} = R\"embedded(${text})embedded\";
}
")
