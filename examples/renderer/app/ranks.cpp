#include "app/ranks.hpp"

#include "app/option_names.hpp"
#include "app/render_state.hpp"

#include <wfpg/base/error.hpp>
#include <wfpg/state/section_file.hpp>

#include <istream>
#include <string>
#include <vector>

namespace render {

void require_shared(const render_options& options) {
  using wfpg::require;
  const std::string& method = name_of(method_names(), options.method);
  const bool has_gpus = options.where == device::cuda || options.where == device::optix;
  require(options.devices.empty() || has_gpus, "device", name_of(device_names(), options.where),
          "cuda or optix where GPUs are numbered");
  require(options.split || !options.ranks, "split", std::string("unset"),
          "tiles or samples for several ranks");
  if (!options.split) return;
  require(properties_of(options.method).can_be_split, "method", method,
          (names_of_methods(&method_properties::can_be_split) + " where ranks share a picture").c_str());
  require(options.octree != octree_source::samples, "octree", std::string("samples"),
          "triangles or caster where ranks share a picture");
  require(options.samples_a_wave >= 1, "samples_a_wave", options.samples_a_wave, "at least 1");
  const bool has_state = options.keep_state || !options.resume.empty();
  require(!has_state || samples_of_wave(options) == 1, "split", std::string("samples"),
          "tiles where a rendering's state is resumed or saved");
  const std::uint64_t paths =
      std::uint64_t(options.width) * std::uint64_t(options.height) * samples_of_wave(options);
  require(paths < 0xffffffffu, "width times height times samples_a_wave", paths, "less than 2^32 - 1");
  if (options.ranks)
    require(options.ranks->size() <= paths, "ranks", options.ranks->size(), "at most the paths of a wave");
}

namespace {

/// Hash of the files that a rendering goes on from, or begins with. Throws wfpg::file_error.
std::uint64_t checksum_of_files(const render_options& options) {
  std::uint64_t hash = wfpg::checksum("");
  std::vector<char> part(1 << 16);
  for (const std::string& path : {options.resume, options.load_guide}) {
    hash = wfpg::checksum(path.empty() ? "no file" : "a file", hash);
    if (path.empty()) continue;
    hash = wfpg::read_file(path, [&](std::istream& in) {
      std::uint64_t read = hash;
      while (in.read(part.data(), static_cast<std::streamsize>(part.size())), in.gcount() > 0)
        read = wfpg::checksum({part.data(), static_cast<std::size_t>(in.gcount())}, read);
      return read;
    });
  }
  return hash;
}

}  // namespace

void require_same_rendering(const scene& scene, const render_options& options) {
  if (!options.ranks) return;
  const std::uint64_t own = checksum_of(scene, options), files = checksum_of_files(options);
  std::uint64_t most[4] = {own, ~own, files, ~files};
  options.ranks->all_reduce_max(wfpg::array_view<std::uint64_t>(most, 4));
  const std::string ranks =
      "rank " + std::to_string(options.ranks->rank()) + " and another rank have different ";
  if (most[0] != own || most[1] != ~own)
    throw wfpg::rank_error(
        ranks + "scenes, options, kinds of device or versions of the program; give all ranks the same");
  if (most[2] != files || most[3] != ~files)
    throw wfpg::rank_error(ranks +
                           "bytes of the file of --resume or --load-guide; copy one file to all machines");
}

}  // namespace render
