// Tiled arrays, of elements that a GPU has in tiles and of such that it has not.
#include "support/catch.hpp"
#include "support/evaluate.hpp"
#include "support/policies.hpp"

#include <wfpg/exec/tiled_array.hpp>

#include <cstdint>
#include <vector>

namespace {

using namespace wfpg_test;

template <std::size_t Words>
struct element {
  std::uint32_t words[Words];
  element() = default;
  WFPG_HD explicit element(std::size_t i) {
    for (std::size_t k = 0; k < Words; ++k) words[k] = static_cast<std::uint32_t>(Words * i + k);
  }
};

template <class T>
struct write_elements {
  wfpg::tiled_view<T> elements;
  WFPG_HD void operator()(std::size_t i) const { elements.emplace(i, i); }
};
template <class T>
struct raise_first_words {
  wfpg::tiled_view<T> elements;
  WFPG_HD void operator()(std::size_t i) const {
    elements.update(i, [](T& e) { ++e.words[0]; });
  }
};
/// Whether an element has what was written and raised.
template <class T, std::size_t Words>
struct has_words {
  wfpg::tiled_view<T> elements;
  WFPG_HD int operator()(std::size_t i) const {
    const T& e = elements[i];
    const T written(i);
    bool same = e.words[0] == written.words[0] + 1;
    for (std::size_t k = 1; k < Words; ++k) same = same && e.words[k] == written.words[k];
    return same ? 1 : 0;
  }
};

template <std::size_t Words, class Exec>
void check_elements(const Exec& exec, std::size_t size) {
  using type = element<Words>;
  const wfpg::tiled_array<type, Exec> array(exec, size);
  CHECK(array.size() == size);
  CHECK(array.view().size() == size);
  CHECK(array.view().empty() == (size == 0));
  CHECK(array.bytes() >= size * sizeof(type));
  CHECK(array.bytes() < (size + 32) * sizeof(type));
  exec.for_each(size, write_elements<type>{array.view()});
  exec.for_each(size, raise_first_words<type>{array.view()});
  CHECK(evaluate(exec, size, has_words<type, Words>{array.view()}) == std::vector<int>(size, 1));
}

}  // namespace

WFPG_TEST_CASE("tiled arrays keep what is written, whatever the size of elements", "[tiled_array]") {
  const Exec exec;
  for (const std::size_t size : {std::size_t(0), std::size_t(1), std::size_t(32), std::size_t(1000)}) {
    check_elements<4>(exec, size);
    check_elements<36>(exec, size);
    check_elements<5>(exec, size);
  }
}
