// The renderer's methods and their properties, in one table.
#pragma once

namespace render {

/// Sampling methods. pt is path tracing, vpt path tracing through media. bpt is bidirectional path tracing,
/// vcm vertex connection and merging, upbp that with points and beams in media, lt light tracing. wfpg guides
/// by fields, wfpg_product by products of fields and BSDFs. sarsa guides by a SARSA grid, records by
/// irradiance records. openpgl_vmm guides by Open PGL's mixtures of von Mises-Fisher lobes with parallax,
/// openpgl_dqt by its quadtrees of directions.
enum class sampling_method {
  pt,
  vpt,
  bpt,
  vcm,
  upbp,
  lt,
  wfpg,
  wfpg_product,
  sarsa,
  records,
  openpgl_vmm,
  openpgl_dqt
};

/// The guide beside BSDFs: none, fields over an octree, a grid, records, or Open PGL's field.
enum class guide_kind { none, octree, sarsa, records, openpgl };

struct method_properties {
  sampling_method method;
  const char* name;  ///< of --method, and in reports
  guide_kind guide;
  bool learns;        ///< from its samples: later ones have less noise
  bool can_be_saved;  ///< a rendering's state can be saved and resumed
  bool asks_inline;   ///< its kernels trace rays, so that casters of batches cannot be used
  bool has_media;     ///< it renders fog, and solids that scatter inside
  bool can_be_split;  ///< several ranks can render one picture
};

inline constexpr method_properties all_methods[] = {
    {sampling_method::pt, "pt", guide_kind::none, false, true, false, false, true},
    {sampling_method::vpt, "vpt", guide_kind::none, false, true, true, true, true},
    {sampling_method::bpt, "bpt", guide_kind::none, false, true, true, true, false},
    {sampling_method::vcm, "vcm", guide_kind::none, false, true, true, true, false},
    {sampling_method::upbp, "upbp", guide_kind::none, false, true, true, true, false},
    {sampling_method::lt, "lt", guide_kind::none, false, true, true, true, false},
    {sampling_method::wfpg, "wfpg", guide_kind::octree, true, true, false, false, true},
    {sampling_method::wfpg_product, "wfpg-product", guide_kind::octree, true, true, false, false, true},
    {sampling_method::sarsa, "sarsa", guide_kind::sarsa, true, false, false, false, true},
    {sampling_method::records, "records", guide_kind::records, false, false, true, false, false},
    {sampling_method::openpgl_vmm, "openpgl-vmm", guide_kind::openpgl, true, false, false, false, false},
    {sampling_method::openpgl_dqt, "openpgl-dqt", guide_kind::openpgl, true, false, false, false, false},
};

/// The row of a method. Precondition: `method` is one of the enumerators.
constexpr const method_properties& properties_of(sampling_method method) {
  const method_properties* row = all_methods;
  while (row->method != method) ++row;
  return *row;
}

constexpr bool is_guided(sampling_method method) {
  return properties_of(method).guide != guide_kind::none;
}

constexpr bool is_wfpg(sampling_method method) {
  return properties_of(method).guide == guide_kind::octree;
}

/// Whether paths begin at lights and at the camera, and are joined.
constexpr bool chooses_techniques(sampling_method method) {
  return method == sampling_method::bpt || method == sampling_method::vcm || method == sampling_method::upbp;
}

/// Whether paths begin at lights, too.
constexpr bool is_bidirectional(sampling_method method) {
  return chooses_techniques(method) || method == sampling_method::lt;
}

constexpr bool is_openpgl(sampling_method method) {
  return properties_of(method).guide == guide_kind::openpgl;
}

}  // namespace render
