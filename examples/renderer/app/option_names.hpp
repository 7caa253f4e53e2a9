// Names of options' values, on command lines and in reports.
#pragma once

#include "app/render.hpp"

#include <map>
#include <string>

namespace render {

/// The choices of --method, --device, --combine, --cones, --octree, --sarsa-update and --sarsa-sampler.
const std::map<std::string, sampling_method>& method_names();
const std::map<std::string, device>& device_names();
const std::map<std::string, wfpg::sample_combination>& combination_names();
const std::map<std::string, cones>& cones_names();
const std::map<std::string, octree_source>& octree_names();
const std::map<std::string, wfpg::sarsa_update>& sarsa_update_names();
const std::map<std::string, wfpg::sarsa_sampler>& sarsa_sampler_names();

/// Names of the methods with a property, in a sentence.
std::string names_of_methods(bool method_properties::*has);
const char* name_of(technique which);
/// The value of --techniques: names of all that are on, with + between them.
std::string names_of(const technique_set& set);
/// The set of such a value. Throws std::invalid_argument that says which name is unknown.
technique_set techniques_of(const std::string& names);

/// The name of a value. Precondition: it has one.
template <class T>
const std::string& name_of(const std::map<std::string, T>& names, T value) {
  auto named = names.begin();
  while (named->second != value) ++named;
  return named->first;
}

}  // namespace render
