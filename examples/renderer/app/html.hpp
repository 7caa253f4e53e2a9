// Parts of HTML and SVG: text, and bytes of pictures.
#pragma once

#include <string>

namespace render {

/// Text with `<`, `&` and `"` as entities. It may stand between tags and in attributes within double quotes.
std::string escaped(const std::string& text);

/// Bytes as base64 (RFC 4648).
std::string base64(const std::string& bytes);

}  // namespace render
