// Lines, circles and words as SVG.
#pragma once

#include <wfpg/base/types.hpp>

#include <string>

namespace inspect {

using wfpg::vec2;
using wfpg::vec3;

/// A drawing in pixels, from the upper left. Attributes are SVG's.
class svg {
 public:
  svg(int width, int height) : width_(width), height_(height) {}

  void line(vec2 from, vec2 to, const std::string& attributes);
  void circle(vec2 centre, double radius, const std::string& attributes);
  /// `at`: left end of the baseline, unless attributes say otherwise.
  void text(vec2 at, const std::string& words, const std::string& attributes = "");

  /// The file.
  std::string content() const;

 private:
  int width_, height_;
  std::string body_;
};

}  // namespace inspect
