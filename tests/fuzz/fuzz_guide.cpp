// Guide files of any bytes: a guider that guides, or an error that names what is read. Each input is read as
// it is, and with its checksums put right, so that what is behind them is reached.
#include <wfpg/exec/seq.hpp>
#include <wfpg/guide_file.hpp>
#include <wfpg/ray_caster.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using policy = wfpg::exec::seq;
using wfpg::vec2;
using wfpg::vec3;

constexpr std::uint32_t rays = 12;

/// A white Lambertian surface.
struct lambert {
  vec3 normal{0.0f, 0.0f, 1.0f};

  float eval(vec3, vec3 incident) const { return pdf({}, incident); }
  float pdf(vec3, vec3 incident) const { return std::fmax(glm::dot(incident, normal), 0.0f) * 0.31830989f; }
  wfpg::bsdf_sample sample(vec3 outgoing, vec2 u) const {
    const float r = std::sqrt(u.x), phi = 6.2831853f * u.y;
    const vec3 local(r * std::cos(phi), r * std::sin(phi), std::sqrt(1.0f - u.x));
    const vec3 d = wfpg::detail::frame(normal).to_world(local);
    return {d, pdf(outgoing, d)};
  }
  bool is_delta() const { return false; }
  bool transmits() const { return false; }
};

/// Points in the octree's leaves, facing along all axes. Precondition: there are leaves.
struct leaf_surfaces {
  wfpg::sparse_voxel_octree_view tree;

  wfpg::surface<lambert> operator()(std::uint32_t ray) const {
    vec3 normal(0.0f);
    normal[static_cast<int>(ray % 3)] = ray % 2 == 0 ? 1.0f : -1.0f;
    const wfpg::node_id leaf = tree.first_leaf() + ray * (tree.leaf_count() - 1) / rays;
    return {tree.centre(leaf), normal, normal, normal, lambert{normal}, true};
  }
};

struct random_numbers {
  vec2 operator()(std::uint32_t ray, std::uint32_t dimension) const {
    return wfpg::detail::unit_vec2(wfpg::detail::hash(ray, dimension));
  }
};

/// What the seeds were saved with; the others of the options that files hold are the file's own.
wfpg::guider_options options_of(const std::string& bytes) {
  const auto word = [&bytes](std::size_t i) {
    return bytes.size() < 68 ? 0u : static_cast<unsigned char>(bytes[40 + 4 * i]);
  };
  wfpg::guider_options options;
  options.octree_resolution = 4;
  options.mode = static_cast<wfpg::guiding_mode>(word(1) % 2);
  options.fields = static_cast<wfpg::field_lifetime>(word(2) % 2);
  options.kept.learn = word(4) % 2 == 1;
  options.kept.resolution = options.field_resolution = options.min_field_resolution = 4;
  options.kept.budget_bytes = 2048;
  options.lights.weights = std::vector<float>(word(5) % 4, 1.0f);
  options.lights.resolution = 2;
  options.min_bin_level = 1;
  options.rays_per_bin = 2;
  options.max_paths = rays;
  options.max_depth = 2;
  return options;
}

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

void ask_lights(const wfpg::light_guide_view& lights, const wfpg::surface<lambert>& surface,
                std::uint32_t ray) {
  if (lights.empty()) return;
  const wfpg::light_choice choice =
      lights.choose(lights.find(surface.position, surface.normal), random_numbers()(ray, 9).x);
  require(choice.group < lights.groups() && choice.probability > 0.0f && choice.probability <= 1.0f,
          "groups of lights have a probability");
  lights.deposit(ray, choice.key, static_cast<float>(ray % 4));
}

/// Two samples of one vertex and what it finds.
void guide(wfpg::path_guider<policy>& guider) {
  const wfpg::sparse_voxel_octree_view tree = guider.octree().view();
  const leaf_surfaces surfaces{tree};
  std::vector<wfpg::sampled_direction> drawn(rays);
  for (int sample = 0; sample < 2; ++sample) {
    guider.begin_sample();
    for (std::uint32_t ray = 0; ray < rays; ++ray)
      guider.recorder().vertex(ray, 0, surfaces(ray).position, surfaces(ray).outgoing, vec3(1.0f));
    guider.sample_directions(wfpg::wave{0, rays, surfaces, random_numbers{}},
                             wfpg::svo_ray_caster(tree, 1.0f), {drawn.data(), drawn.size()});
    for (std::uint32_t ray = 0; ray < rays; ++ray) {
      const wfpg::sampled_direction& d = drawn[ray];
      require(d.pdf >= 0.0f && wfpg::detail::is_finite(d.pdf) && wfpg::detail::is_finite(d.direction),
              "directions and densities are finite");
      guider.recorder().scatter(ray, 0, d);
      guider.recorder().escape(ray, 1, vec3(1.0f));
      guider.recorder().emission(ray, 1, vec3(1.0f));
      ask_lights(guider.lights(), surfaces(ray), ray);
    }
    guider.end_sample();
  }
}

void read(const std::string& bytes) {
  try {
    std::istringstream in(bytes);
    wfpg::path_guider<policy> guider = wfpg::load_guide(policy(), in, options_of(bytes), "it");
    if (!guider.octree().view().empty()) guide(guider);
    std::ostringstream out;
    wfpg::save_guide(guider, out);
  } catch (const wfpg::file_error& error) {
    require(std::string(error.what()).rfind("wfpg: it ", 0) == 0, "errors name what is read");
  }
}

template <class T>
void set(std::string& bytes, std::size_t at, T value) {
  std::string number;
  wfpg::detail::put_number(number, value);
  bytes.replace(at, sizeof(T), number);
}

std::string with_checksums(std::string bytes) {
  using wfpg::detail::checksum;
  if (bytes.size() < 16) return bytes;
  const auto sum = [&bytes](std::size_t first, std::size_t n) {
    return checksum(std::string_view(bytes).substr(first, n));
  };
  set(bytes, 12, static_cast<std::uint32_t>(sum(0, 12)));
  for (std::size_t at = 16; bytes.size() - at >= 32;) {
    const auto said = wfpg::detail::number_at<std::uint64_t>(&bytes[at + 8]);
    const std::size_t size = static_cast<std::size_t>(std::min<std::uint64_t>(said, bytes.size() - at - 32));
    set(bytes, at + 16, sum(at, 16));
    set(bytes, at + 24 + size, sum(at + 24, size));
    at += size + 32;
  }
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  read(bytes);
  read(with_checksums(bytes));
  return 0;
}
