# Doxygen's view of a header: the comment that it begins with describes the file. Lines keep their numbers.
1 s|^// |/// \\file\n/// |
1,/^#pragma once/ {
  s|^//$|///|
  s|^// |/// |
  /^#pragma once/ d
}
