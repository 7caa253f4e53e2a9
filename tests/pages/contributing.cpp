// The policy of CONTRIBUTING.md, with a host's scheduler.
#include <cstddef>

namespace my {

int workers();
template <class F>
void parallel_for(std::size_t n, std::size_t grain, const F& f) {
  for (std::size_t first = 0; first < n; first += grain) f(first, first + grain < n ? first + grain : n, 0);
}

}  // namespace my

#include "contributing-1.inc"

template class wfpg::path_guider<my_policy>;
