// Rays that sample fields in memory: kept ones, or transient ones that were made resident.
#pragma once

#include <wfpg/guide/sample_rays.hpp>
#include <wfpg/guides/octree/guide_view.hpp>

namespace wfpg::detail {

/// A ray whose field is in memory.
template <class Serve>
struct serve_field {
  Serve serve;
  resident_fields fields;
  WFPG_HD void operator()(std::size_t ray, std::uint32_t field) const {
    serve(static_cast<std::uint32_t>(ray), [&](const auto&) { return fields.mixture(field); });
  }
};

/// The same with its product.
template <class Serve>
struct serve_product {
  Serve serve;
  resident_fields fields;
  WFPG_HD void operator()(std::size_t ray, std::uint32_t field) const {
    std::uint32_t words[max_product_words];
    serve(static_cast<std::uint32_t>(ray), [&](const auto& s) { return fields.product(field, s, words); });
  }
};

/// Rays of a view: serve(ray, field).
template <class Serve>
struct serve_view {
  Serve serve;
  guide_view view;
  WFPG_HD void operator()(std::size_t ray) const { serve(ray, view.number(static_cast<std::uint32_t>(ray))); }
};

}  // namespace wfpg::detail
