// The output iterator of scan_places(): what a scan of Thrust's assigns to an element calls a functor.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/exec/support/thrust.hpp>

#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/iterator_adaptor.h>

#include <cstddef>
#include <cstdint>

namespace wfpg::detail {

/// Stands for an element's place: what is assigned goes to the functor.
template <class F>
struct place_reference {
  F f;                   ///< takes the places
  std::ptrdiff_t index;  ///< of the element
  WFPG_HD const place_reference& operator=(std::uint32_t place) const {
    f(static_cast<std::size_t>(index), place);
    return *this;
  }
};

/// An output iterator of Thrust's whose assignments call a functor.
template <class F>
class place_iterator
    : public ::thrust::iterator_adaptor<place_iterator<F>, ::thrust::counting_iterator<std::ptrdiff_t>,
                                        std::uint32_t, ::thrust::use_default, ::thrust::use_default,
                                        place_reference<F>> {
  using base_type = ::thrust::iterator_adaptor<place_iterator<F>, ::thrust::counting_iterator<std::ptrdiff_t>,
                                               std::uint32_t, ::thrust::use_default, ::thrust::use_default,
                                               place_reference<F>>;

 public:
  /// Stands at the first element.
  explicit WFPG_HD place_iterator(const F& f)
      : base_type(::thrust::counting_iterator<std::ptrdiff_t>(0)), f_(f) {}

 private:
  friend class ::thrust::iterator_core_access;
  WFPG_HD place_reference<F> dereference() const { return {f_, *this->base()}; }

  F f_;
};

}  // namespace wfpg::detail
