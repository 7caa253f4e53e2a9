// Kernels that sample fields in memory: kept ones, or transient ones that were made resident.
#pragma once

#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg::detail {

/// Samples one ray's direction from a field in memory.
template <class Sampler>
struct sample_field {
  Sampler sampler;
  resident_fields fields;
  WFPG_HD WFPG_FLATTEN void operator()(std::size_t ray, std::uint32_t field) const {
    sampler(static_cast<std::uint32_t>(ray), [&](const auto&) { return fields.mixture(field); });
  }
};

/// Samples one ray's direction from its product with a field in memory. The product lies in 1 KiB of the
/// thread's local memory.
template <class Sampler>
struct sample_product {
  Sampler sampler;
  resident_fields fields;
  WFPG_HD WFPG_FLATTEN void operator()(std::size_t ray, std::uint32_t field) const {
    std::uint32_t words[max_product_words];
    sampler(static_cast<std::uint32_t>(ray), [&](const auto& s) { return fields.product(field, s, words); });
  }
};

/// Kernel: samples the rays of a view, by sampler(ray, field).
template <class Sampler>
struct sample_view {
  Sampler sampler;
  guide_view view;
  WFPG_HD void operator()(std::size_t ray) const {
    sampler(ray, view.number(static_cast<std::uint32_t>(ray)));
  }
};

}  // namespace wfpg::detail
