#include "app/option_names.hpp"

#include <sstream>
#include <stdexcept>
#include <vector>

namespace render {

const std::map<std::string, sampling_method>& method_names() {
  static const std::map<std::string, sampling_method> names = [] {
    std::map<std::string, sampling_method> result;
    for (const method_properties& row : all_methods) result.emplace(row.name, row.method);
    return result;
  }();
  return names;
}

const std::map<std::string, device>& device_names() {
  static const std::map<std::string, device> names = {{"cpu", device::cpu},
                                                      {"omp", device::omp},
                                                      {"seq", device::seq},
                                                      {"cuda", device::cuda},
                                                      {"optix", device::optix}};
  return names;
}

const std::map<std::string, wfpg::sample_combination>& combination_names() {
  using combine = wfpg::sample_combination;
  static const std::map<std::string, combine> names = {{"inverse-variance", combine::inverse_variance},
                                                       {"pt-linear", combine::pt_linear},
                                                       {"pt-first", combine::pt_first},
                                                       {"constant", combine::constant},
                                                       {"linear", combine::linear},
                                                       {"quadratic", combine::quadratic},
                                                       {"one-two", combine::one_two},
                                                       {"discard-first", combine::discard_first}};
  return names;
}

const std::map<std::string, cones>& cones_names() {
  static const std::map<std::string, cones> names = {
      {"scene", cones::scene}, {"march", cones::march}, {"trace", cones::trace}};
  return names;
}

const std::map<std::string, octree_source>& octree_names() {
  static const std::map<std::string, octree_source> names = {{"triangles", octree_source::triangles},
                                                             {"caster", octree_source::caster},
                                                             {"samples", octree_source::samples}};
  return names;
}

const std::map<std::string, wfpg::sarsa_update>& sarsa_update_names() {
  using update = wfpg::sarsa_update;
  static const std::map<std::string, update> names = {
      {"sarsa", update::sarsa}, {"expected", update::expected_sarsa}, {"monte-carlo", update::monte_carlo}};
  return names;
}

const std::map<std::string, wfpg::sarsa_sampler>& sarsa_sampler_names() {
  using sampler = wfpg::sarsa_sampler;
  static const std::map<std::string, sampler> names = {{"sphere", sampler::sphere_inversion},
                                                       {"hemisphere", sampler::hemisphere_inversion},
                                                       {"rejection", sampler::rejection},
                                                       {"mixed", sampler::mixed_rejection}};
  return names;
}

std::string names_of_methods(bool method_properties::*has) {
  std::vector<std::string> names;
  for (const method_properties& row : all_methods)
    if (row.*has) names.push_back(row.name);
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) text += (i + 1 < names.size() ? ", " : " or ") + names[i];
  return text;
}

namespace {

// In the order of the enumerators.
constexpr const char* technique_names[technique_count] = {"hits", "nee",  "connect", "splat",
                                                          "surf", "pp3d", "pb2d",    "bb1d"};

}  // namespace

const char* name_of(technique which) {
  return technique_names[static_cast<int>(which)];
}

std::string names_of(const technique_set& set) {
  std::string names;
  for (int i = 0; i < technique_count; ++i)
    if (set.has(technique(i))) names += (names.empty() ? "" : "+") + std::string(technique_names[i]);
  return names;
}

technique_set techniques_of(const std::string& names) {
  technique_set set(std::initializer_list<technique>{});
  std::istringstream rest(names + '+');
  for (std::string name; std::getline(rest, name, '+');) {
    bool is_known = name == "bpt";
    if (is_known) set.add(technique_set());
    for (int i = 0; i < technique_count; ++i) {
      if (name != technique_names[i]) continue;
      set.add(technique(i));
      is_known = true;
    }
    if (!is_known)
      throw std::invalid_argument(
          "expected hits, nee, connect, splat, surf, pp3d, pb2d, bb1d or bpt, with + between them, not " +
          name);
  }
  return set;
}

}  // namespace render
