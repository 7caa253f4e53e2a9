// Numbers and their names.
#include "numbers.hpp"

#include <wfpg/bins/spatial_binner.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace inspect {
namespace {

constexpr const char* orientations[] = {"+x", "-x", "+y", "-y", "+z", "-z", "transmits", "any"};

json vector_of(vec3 v) {
  return {v.x, v.y, v.z};
}

/// Members of the JSON, and their names for people.
constexpr std::pair<const char*, const char*> names[] = {
    {"scene", "scene"},
    {"method", "method"},
    {"fields", "fields"},
    {"samples", "samples that were learnt from"},
    {"techniques", "techniques"},
    {"rendered", "samples"},
    {"pixel", "pixel, from the upper left"},
    {"hit", "hits"},
    {"position", "point"},
    {"normal", "shading normal toward the camera"},
    {"level", "level of the field's node (root 0)"},
    {"leaf_level", "level of the leaves"},
    {"node", "number of the field's node"},
    {"orientation", "orientation of the bin"},
    {"rays", "camera rays in the bin"},
    {"field_resolution", "cells along the field's side"},
    {"mixture_fraction", "mixture fraction"},
    {"guide_share", "share of samples drawn from the field"},
    {"glossy_share", "share drawn from the BSDF's narrow part"},
    {"smooth_share", "share drawn from the rest of the BSDF"},
    {"correlation", "correlation of field and reference"},
    {"kl_divergence", "KL divergence of the field from the reference, nats"},
    {"kl_divergence_noise", "of which the reference's own noise makes about"},
    {"below_surface", "share of samples below the surface"},
    {"outside_cells", "share of samples outside the field's cells"},
    {"failed", "share of samples without a direction"},
    {"chi_square_p", "p of the chi-square test of samples against their pdf"},
    {"noise_bsdf", "relative deviation of a sample drawn from the BSDF alone"},
    {"noise_sampler", "relative deviation of a sample as it is drawn"},
    {"radiance", "the pixel, mean, W/(m² sr)"},
    {"deviation", "relative deviation of a sample"},
    {"sample", "sample that is shown, from 1"},
    {"sample_luminance", "its luminance, W/(m² sr)"},
    {"photons_on_surfaces", "its photons on surfaces"},
    {"photons_in_media", "its photons in media"},
    {"beams", "its photon beams"},
    {"dropped", "vertices of light paths without memory"},
    {"field_bytes", "bytes of a field"},
    {"persistent_bytes", "bytes of the guider, kept"},
    {"transient_bytes", "bytes of the guider, in flight"},
};

}  // namespace

std::string words(const json& value) {
  if (value.is_null()) return "not defined";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value.get<double>());
    return text;
  }
  if (!value.is_array()) return value.dump();
  std::string list;
  for (const json& element : value) list += (list.empty() ? "" : ", ") + words(element);
  return list;
}

pixel_kind kind_of(const learnt_scene& learnt, std::uint32_t pixel) {
  const auto& surface = learnt.hits()[pixel].surface;
  if (!surface.active) return pixel_kind::nothing;
  return surface.bsdf.is_delta() ? pixel_kind::delta : pixel_kind::surface;
}

json numbers_of_place(const learnt_scene& learnt, std::uint32_t pixel) {
  const auto& surface = learnt.hits()[pixel].surface;
  const auto width = static_cast<std::uint32_t>(learnt.rendering().picture.width);
  const pixel_kind kind = kind_of(learnt, pixel);
  const guide_bytes bytes = learnt.bytes();
  json numbers{{"samples", learnt.rendering().report.spp},
               {"pixel", {pixel % width, pixel / width}},
               {"hit", kind == pixel_kind::nothing ? "nothing"
                       : kind == pixel_kind::delta ? "a smooth mirror or glass"
                                                   : "a surface"}};
  if (kind != pixel_kind::nothing) {
    numbers["position"] = vector_of(surface.position);
    numbers["normal"] = vector_of(wfpg::facing_normal(surface));
  }
  const std::uint32_t bin = learnt.bins()[pixel];
  if (bin != no_bin) {
    const wfpg::sparse_voxel_octree_view tree = learnt.cache().octree();
    numbers["node"] = bin / wfpg::orientations;
    numbers["level"] = tree.level_of(bin / wfpg::orientations);
    numbers["leaf_level"] = tree.depth();
    numbers["orientation"] = orientations[bin % wfpg::orientations];
    numbers["rays"] = std::count(learnt.bins().begin(), learnt.bins().end(), bin);
  }
  numbers["field_bytes"] = bytes.field;
  numbers["persistent_bytes"] = bytes.persistent;
  numbers["transient_bytes"] = bytes.transient;
  return numbers;
}

json numbers_of(const findings& found, const pixel_sampler& sampler) {
  const wfpg::mixture_fractions fractions = sampler.fractions();
  const bool has_field = !sampler.field().empty();
  json numbers{{"field_resolution", has_field ? json(found.cells.resolution()) : json()},
               {"mixture_fraction", sampler.fraction()},
               {"guide_share", fractions.guide},
               {"glossy_share", fractions.glossy},
               {"smooth_share", fractions.smooth},
               {"correlation", found.correlation},
               {"kl_divergence", found.divergence},
               {"kl_divergence_noise", found.divergence_noise},
               {"below_surface", found.counted.below},
               {"outside_cells", found.counted.outside},
               {"failed", found.counted.failed},
               {"chi_square_p", found.counted.p},
               {"noise_bsdf", found.noise.bsdf},
               {"noise_sampler", found.noise.sampler}};
  for (json& value : numbers)
    if (value.is_number_float() && !std::isfinite(value.get<double>())) value = nullptr;
  return numbers;
}

std::vector<number_row> rows_of(const json& numbers) {
  std::vector<number_row> rows;
  for (const auto& [member, name] : names)
    if (numbers.contains(member)) rows.emplace_back(name, words(numbers[member]));
  return rows;
}

}  // namespace inspect
