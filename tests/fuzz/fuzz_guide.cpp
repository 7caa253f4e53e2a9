// Guide files of any bytes: a guider that guides, or an error that names the file. Each input is read as it
// is, and again with correct checksums.
#include "checksums.hpp"
#include "guided_samples.hpp"

#include <wfpg/guide_file.hpp>

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace wfpg_fuzz;

/// The options that the seeds were saved with. The file gives the other options.
wfpg_test::guider_options options_of(const std::string& bytes) {
  const auto word = [&bytes](std::size_t i) {
    return bytes.size() < 68 ? 0u : static_cast<unsigned char>(bytes[40 + 4 * i]);
  };
  wfpg_test::guider_options options;
  options.octree_resolution = 4;
  options.mode = static_cast<wfpg::guiding_mode>(word(1) % 2);
  options.fields = static_cast<wfpg_test::field_lifetime>(word(2) % 2);
  options.kept.learn = word(4) % 2 == 1;
  options.kept.resolution = options.field_resolution = options.min_field_resolution = 4;
  options.kept.budget_bytes = 2048;
  options.lights.weights = std::vector<float>(word(5) % 4, 1.0f);
  options.lights.resolution = 2;
  options.binning.min_level = 1;
  options.binning.rays_per_bin = 2;
  options.max_paths = rays;
  options.max_depth = 2;
  return options;
}

void read(const std::string& bytes) {
  try {
    std::istringstream in(bytes);
    wfpg_test::with_own_options(options_of(bytes), [&](const auto& options) {
      auto guider = wfpg::load_guide(policy(), in, options, "it");
      if (!guider.guide().octree().view().empty())
        guide(guider, leaf_surfaces{guider.guide().octree().view()});
      std::ostringstream out;
      wfpg::save_guide(guider, out);
    });
  } catch (const wfpg::file_error& error) {
    require(std::string(error.what()).rfind("wfpg: it ", 0) == 0, "errors name what is read");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  read(bytes);
  read(with_checksums(bytes));
  return 0;
}
