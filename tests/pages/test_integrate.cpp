// Tests the guided pictures of the tracer in docs/integrate.md.
#include "../support/catch.hpp"
#include "tracer.hpp"

#include <wfpg/exec/tbb.hpp>

namespace {

constexpr std::uint32_t width = 24;

std::vector<vec3> picture(std::uint32_t samples, bool guided) {
  kept_guide_options options;
  options.max_depth = 4;
  if (!guided) options.unguided_samples = samples;
  return render(exec::tbb(), room(), options, width, samples);
}

float mean(const std::vector<vec3>& values) {
  float sum = 0.0f;
  for (const vec3& value : values) sum += value.x;
  return sum / float(values.size());
}

float squared_error(const std::vector<vec3>& values, const std::vector<vec3>& truth) {
  float sum = 0.0f;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float difference = values[i].x - truth[i].x;
    sum += difference * difference;
  }
  return sum;
}

}  // namespace

TEST_CASE("the tracer of docs/integrate.md gains from its guide and keeps its mean", "[pages]") {
  const std::vector<vec3> truth = picture(2048, false), guided = picture(128, true);
  CHECK(mean(guided) == Approx(mean(truth)).epsilon(0.04));
  CHECK(squared_error(guided, truth) < 0.6f * squared_error(picture(128, false), truth));
}
