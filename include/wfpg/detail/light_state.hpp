// Converts what a light_guide has learnt to and from bytes: the means of the deepest rows. All else follows
// from these.
//
// Memory: the section's bytes.
#pragma once

#include <wfpg/guides/octree/light_guide.hpp>
#include <wfpg/state/section_file.hpp>

#include <cstdint>
#include <cstring>
#include <vector>

namespace wfpg::detail {

/// Reads and writes the members of a light_guide that a guide file holds; its friend.
struct light_state {
  // Section "lights": the deepest rows' means, a word each.
  template <class Exec>
  static section_writer to_bytes(const Exec& exec, const light_guide<Exec>& lights) {
    std::vector<std::uint32_t> words(means_of(lights));
    exec.copy_to_host(words.data(), first_of(lights), words.size() * sizeof(std::uint32_t));
    section_writer bytes;
    bytes.put_all(words);
    return bytes;
  }

  // Reads section "lights". Throws file_error for a mean out of range, before it changes the guide.
  template <class Exec>
  static void restore(const Exec& exec, section_reader bytes, light_guide<Exec>& lights) {
    const auto words = bytes.get_all<std::uint32_t>(means_of(lights));
    bytes.end();
    for (const std::uint32_t word : words) {
      learnt_mean mean;
      std::memcpy(static_cast<void*>(&mean), &word, sizeof word);
      bytes.require(mean.is_up_to(light_guide_view::most), "has learnt light out of range");
    }
    exec.copy_from_host(first_of(lights), words.data(), words.size() * sizeof(std::uint32_t));
    lights.follow_means(exec);
  }

 private:
  static_assert(sizeof(learnt_mean) == 4, "files hold it as a word");

  template <class Exec>
  static std::size_t means_of(const light_guide<Exec>& lights) {
    return lights.means_.size() - std::size_t(lights.view_.first_row_) * lights.view_.groups();
  }
  template <class Exec>
  static learnt_mean* first_of(const light_guide<Exec>& lights) {
    return lights.means_.data() + std::size_t(lights.view_.first_row_) * lights.view_.groups();
  }
};

}  // namespace wfpg::detail
