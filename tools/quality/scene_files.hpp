// Pictures and plots of a scene in the output directory.
#pragma once

#include "app/plot.hpp"
#include "reference.hpp"
#include "single_samples.hpp"
#include "summary.hpp"

#include <array>
#include <filesystem>
#include <vector>

namespace quality {

struct reference_files {
  std::filesystem::path picture;
  std::array<std::filesystem::path, 2> halves;
};

class scene_files {
 public:
  /// Writes the reference and its halves. All three arguments must outlive this. Throws std::runtime_error
  /// that names the path.
  scene_files(const settings& given, const scene_choice& scene, const reference& truth);

  const reference_files& reference() const { return reference_; }

  /// Writes pictures of the first seed, and plots. Returns their names. `single` has an element for each
  /// method, or is empty.
  json write(const std::vector<measured_run>& runs, const std::vector<single_samples>& single) const;

 private:
  std::string name(const std::string& what) const;
  std::filesystem::path path(const std::string& file) const { return given_.output / file; }
  json write_pictures(const std::vector<measured_run>& runs, std::size_t budget, const window& crop) const;
  std::string write_plot(const std::string& what, const render::plot& drawn) const;
  json write_plots(const std::vector<measured_run>& runs) const;
  json write_single_samples(const std::vector<single_samples>& single) const;
  window crop_window(const std::vector<measured_run>& runs) const;
  std::vector<render::image> pictures_of(const std::vector<measured_run>& runs, std::size_t budget) const;

  const settings& given_;
  const scene_choice& scene_;
  const quality::reference& truth_;
  reference_files reference_;
  float exposure_;  ///< of the whole reference
};

}  // namespace quality
