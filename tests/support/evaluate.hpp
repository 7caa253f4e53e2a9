// Reads memory of a policy: runs functors on the policy and returns their results to the host.
#pragma once

#include "support/policies.hpp"

#include <cstddef>
#include <type_traits>
#include <vector>

namespace wfpg_test {

/// Results of f in a std::vector. Bools become bytes, since they need addresses.
template <class T>
using result_of = std::conditional_t<std::is_same_v<std::decay_t<T>, bool>, unsigned char, std::decay_t<T>>;

template <class F, class Result>
struct evaluate_each {
  F f;
  wfpg::array_view<Result> results;
  WFPG_HD void operator()(std::size_t i) const { results[i] = f(i); }
};

/// Returns f(i) for i in [0, n).
template <class Exec, class F, class Result = result_of<decltype(std::declval<const F&>()(std::size_t(0)))>>
std::vector<Result> evaluate(const Exec& exec, std::size_t n, const F& f) {
  const wfpg::buffer<Result, Exec> results(exec, n);
  exec.fill_bytes(results.data(), 0, results.bytes());  // padding between members is copied back too
  exec.for_each(n, evaluate_each<F, Result>{f, results.view()});
  return results.to_host(exec);
}

/// Counts the i in [0, n) with f(i) true.
template <class Exec, class F>
std::size_t count_where(const Exec& exec, std::size_t n, const F& f) {
  std::size_t count = 0;
  for (const auto found : evaluate(exec, n, f)) count += found ? 1 : 0;
  return count;
}

template <class F>
struct call_once {
  F f;
  WFPG_HD auto operator()(std::size_t) const { return f(); }
};

/// Returns f().
template <class Exec, class F, class Result = result_of<decltype(std::declval<const F&>()())>>
Result evaluate(const Exec& exec, const F& f) {
  return evaluate(exec, std::size_t(1), call_once<F>{f})[0];
}

template <class F, class T>
struct call_with {
  F f;
  wfpg::array_view<const T> arguments;
  WFPG_HD auto operator()(std::size_t i) const { return f(arguments[i]); }
};

/// Returns f(argument) for each argument.
template <class Exec, class T, class F,
          class Result = result_of<decltype(std::declval<const F&>()(std::declval<const T&>()))>>
std::vector<Result> evaluate(const Exec& exec, const std::vector<T>& arguments, const F& f) {
  const wfpg::buffer<T, Exec> device(exec, arguments);
  return evaluate(exec, arguments.size(), call_with<F, T>{f, device.view()});
}

}  // namespace wfpg_test
