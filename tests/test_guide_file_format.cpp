// The format of guide files. Compares the table in guide_file.hpp with written files. Also guides of other
// scenes, and the number of copies of a policy.
#include "support/catch.hpp"
#include "support/guiding.hpp"
#include "support/policies.hpp"
#include "support/scenes.hpp"
#include "support/section_bytes.hpp"
#include "support/temporary_folder.hpp"

#include <wfpg/guide_file.hpp>

#include <thrust/system/cpp/execution_policy.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace wfpg_test;

constexpr std::size_t paths = 600;

template <class Exec, class Guide>
std::string saved(const wfpg::path_guider<Exec, Guide>& guider) {
  std::ostringstream out;
  wfpg::save_guide(guider, out);
  return out.str();
}

wfpg::kept_guide_options learning_options() {
  wfpg::kept_guide_options options = tracing_options(paths);
  options.octree_resolution = 16;
  options.lights.weights = {1.0f, 2.0f, 0.5f};
  options.lights.resolution = 4;
  return options;
}

template <class Exec, class Options>
auto trained(const Exec& exec, const Options& options) {
  wfpg::path_guider<Exec, wfpg::octree_guide_for<Exec, Options>> guider(exec, box_mesh<Exec>(exec).view(),
                                                                        options);
  trace_paths(exec, guider, 4, paths, box_caster());
  return guider;
}

/// A row of the table: `bytes` per `unit`. An empty unit means once per file.
struct format_row {
  std::string section, content, unit;
  std::size_t bytes = 0;
};

std::string page() {
  return content_of(
      (std::filesystem::path(__FILE__).parent_path() / "../include/wfpg/guide_file.hpp").string());
}

std::vector<format_row> table_of(const std::string& text) {
  // "//   section  content  12 a leaf  of kept fields alone"
  const std::regex row("//   (\\w*) +(\\S.*?\\S)  +(\\d+)(?: an? (.+?))?(?:  .*)?");
  std::vector<format_row> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, row)) continue;
    const std::string section =
        found[1].str().empty() && !rows.empty() ? rows.back().section : found[1].str();
    rows.push_back({section, found[2], found[4], std::stoul(found[3])});
  }
  return rows;
}

/// How many of each unit a guider has. Counts the fields in its file.
std::map<std::string, std::size_t> units_of(const wfpg::path_guider<one_policy>& guider,
                                            const wfpg::kept_guide_options& options,
                                            const std::string& bytes) {
  const wfpg::sparse_voxel_octree_view tree = guider.guide().octree().view();
  const std::size_t cells = std::size_t(options.kept.resolution) * options.kept.resolution;
  const std::string fields = payload_of(bytes, "fields");
  std::size_t live = 0, built = 0;
  for (std::size_t at = 32; at < fields.size(); ++live) {
    const bool is_built = wfpg::number_at<std::uint32_t>(&fields[at + 32]) > 0;
    built += is_built;
    at += 36 + (is_built ? 10 * cells + 4 * options.kept.resolution + 32 : 0);
  }
  return {{"", 1},
          {"leaf", tree.leaf_count()},
          {"node", tree.node_count()},
          {"inner node", tree.first_leaf()},
          {"depth", options.max_depth},
          {"field", live},
          {"built field", built},
          {"cell", built * cells},
          {"row", built * options.kept.resolution},
          {"mean", payload_of(bytes, "lights").size() / 4},
          {"path that is compared", payload_of(bytes, "paths").size() / 28}};
}

TEST_CASE("the table in guide_file.hpp matches what is written", "[guide_file]") {
  const one_policy exec;
  const wfpg::kept_guide_options options = learning_options();
  const wfpg::path_guider<one_policy> guider = trained(exec, options);
  const std::string bytes = saved(guider), text = page();
  CHECK(text.find("A guide file of version " + std::to_string(wfpg::detail::guide_file_kind.version) + ",") !=
        std::string::npos);

  auto units = units_of(guider, options, bytes);
  REQUIRE(units["cell"] > 0);
  REQUIRE(units["mean"] > 0);
  REQUIRE(units["path that is compared"] > 0);
  std::map<std::string, std::size_t> sizes;
  for (const format_row& row : table_of(text)) {
    INFO(row.section << ": " << row.content << ", a " << row.unit);
    REQUIRE(units.count(row.unit) == 1);
    sizes[row.section] += row.bytes * units[row.unit];
  }
  for (const section_place& place : sections_of(bytes)) {
    INFO("section " << place.name);
    CHECK(sizes[place.name] == place.size);
  }
  CHECK(sizes.size() == sections_of(bytes).size());  // including "end", which is empty
}

std::string refusal_of(const std::string& bytes, const wfpg::kept_guide_options& options,
                       const wfpg::triangle_mesh_view* mesh = nullptr) {
  std::istringstream in(bytes);
  try {
    const one_policy exec;
    if (mesh)
      wfpg::load_guide(exec, *mesh, in, options);
    else
      wfpg::load_guide(exec, in, options);
  } catch (const wfpg::file_error& error) {
    return error.what();
  }
  return "";
}

TEST_CASE("a guide of another scene is refused by its tag", "[guide_file]") {
  wfpg::kept_guide_options options = learning_options();
  options.scene_tag = 0x123456789abcdefull;
  const std::string bytes = saved(trained(one_policy(), options));
  CHECK(refusal_of(bytes, options).empty());
  options.scene_tag = 5;
  CHECK(refusal_of(bytes, options) ==
        "wfpg: the guide is of another scene: it was saved with scene_tag 81985529216486895, the guider's is "
        "5");
}

TEST_CASE("a guide of other triangles is refused by its octree", "[guide_file]") {
  const one_policy exec;
  const wfpg::kept_guide_options options = learning_options();
  const std::string bytes = saved(trained(exec, options));
  const box_mesh<one_policy> box(exec);
  const wfpg::triangle_mesh_view same = box.view();
  CHECK(refusal_of(bytes, options, &same).empty());

  const std::string refusal = "wfpg: the guide is of another scene: its octree is not that of the triangles";
  std::vector<wfpg::vec3> positions = box_positions();
  const auto refused = [&] {
    const wfpg::buffer<wfpg::vec3, one_policy> moved(exec, positions);
    const wfpg::triangle_mesh_view other{const_view(moved), same.triangles};
    return refusal_of(bytes, options, &other) == refusal;
  };
  CHECK_FALSE(refused());
  for (wfpg::vec3& p : positions) p.x += 0.1f;  // the cube is elsewhere
  CHECK(refused());
  positions = box_positions();
  for (wfpg::vec3& p : positions) p.y *= 0.5f;  // the same cube, other leaves
  CHECK(refused());
}

/// A policy that counts copies to and from the host.
class counting_policy : public wfpg::exec::cpu_policy<counting_policy, 8> {
 public:
  explicit counting_policy(wfpg::memory_resource* resource = nullptr) : cpu_policy(resource) {}

  auto thrust() const { return ::thrust::cpp::par(wfpg::resource_allocator<char>(resource())); }
  int concurrency() const { return 1; }
  template <class F>
  void parallel(std::size_t n, std::size_t, const F& f) const {
    f(std::size_t(0), n, 0);
  }
  void copy_to_host(void* to, const void* from, std::size_t bytes) const {
    ++copies;
    cpu_policy::copy_to_host(to, from, bytes);
  }
  void copy_from_host(void* to, const void* from, std::size_t bytes) const {
    ++copies;
    cpu_policy::copy_from_host(to, from, bytes);
  }

  static inline int copies = 0;
};

TEST_CASE("guides are saved and loaded by a few copies of whole buffers", "[guide_file]") {
  const counting_policy exec;
  const wfpg::kept_guide_options options = learning_options();
  const wfpg::path_guider<counting_policy> guider = trained(exec, options);
  REQUIRE(guider.statistics().kept.live > 50);
  counting_policy::copies = 0;
  const std::string bytes = saved(guider);
  CHECK(counting_policy::copies <= 20);
  std::istringstream in(bytes);
  counting_policy::copies = 0;
  wfpg::load_guide(exec, in, options);
  CHECK(counting_policy::copies <= 60);
}

}  // namespace
