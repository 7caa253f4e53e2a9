// Deposits of light in an exitance cache, by kernels.
#pragma once

#include "support/policies.hpp"

#include <wfpg/octree/exitance_cache.hpp>

#include <cstddef>
#include <vector>

namespace wfpg_test {

struct deposit {
  wfpg::vec3 position{0.5f};
  wfpg::vec3 direction{0.0f, 0.0f, 1.0f};
  float radiance = 1.0f;
};

struct make_deposits {
  wfpg::exitance_cache_view cache;
  wfpg::array_view<const deposit> deposits;
  WFPG_HD void operator()(std::size_t i) const {
    cache.deposit(deposits[i].position, deposits[i].direction, deposits[i].radiance);
  }
};

template <class Exec>
void deposit_all(const Exec& exec, const wfpg::exitance_cache_view& cache,
                 const std::vector<deposit>& deposits) {
  const wfpg::buffer<deposit, Exec> device(exec, deposits);
  exec.for_each(deposits.size(), make_deposits{cache, device.view()});
}

}  // namespace wfpg_test
