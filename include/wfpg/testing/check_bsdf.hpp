// Checks a host's BSDF: value, density and samples must agree. For a host's own tests, in any framework:
//
//   const auto report = wfpg::testing::check_bsdf(exec, my_bsdf, {normal});
//   if (!report) std::puts(report.message.c_str());
//
// Checks run through an execution policy, so that they test what a device will call.
// They throw out_of_memory, and std::invalid_argument for options out of range.
// Source: chi² tests of samples as in pbrt-v4's and Mitsuba's tests; reciprocity as in Veach 1997.
// Cost: up to seconds, allocations and copies to the host. Not for a frame's time.
// Memory: up to 56 bytes a sample in the policy's memory and on the host.
#pragma once

#include <wfpg/base/types.hpp>
#include <wfpg/host/bsdf.hpp>
#include <wfpg/testing/check_report.hpp>

#include <cstddef>
#include <cstdint>

namespace wfpg::testing {

/// Options of check_bsdf(): its inputs and how strict it is.
struct bsdf_check_options {
  /// The BSDF's shading normal, unit length to 0.1%.
  vec3 normal{0.0f, 0.0f, 1.0f};
  /// False: reciprocity is not checked.
  bool reciprocal = true;
  /// Index of refraction below the normal over that above; positive.
  float ior = 1.0f;
  /// Largest fraction of the light that may go on, at least 0. 1: energy is conserved.
  float albedo_limit = 1.0f;
  /// Samples drawn for each outgoing direction, at least 1024.
  std::size_t samples = std::size_t(1) << 16;
  /// Seed of all random numbers: one seed gives one verdict.
  std::uint64_t seed = 1;
  /// Relative difference allowed between two ways to compute one value, in (0, 1).
  float tolerance = 1.0e-3f;
  /// Probability that a correct BSDF is rejected, in (0, 1).
  double significance = 1.0e-3;
};

/// Checks that a BSDF is one as <wfpg/host/bsdf.hpp> says, in this order:
///
///   values       eval(), pdf() and sample() give nothing that is NaN, infinite or negative; sampled
///                directions have unit length; a sample's pdf is pdf() of it; where eval() is positive pdf()
///                is too; nothing comes from below the normal unless transmits(). Where is_delta(): eval()
///                and pdf() are 0, a sample's pdf is at most 1, and nothing else is asked. A sample that
///                says is_delta: its pdf is at most 1, and it does not count below
///   frequencies  of sample()'s directions are integrals of pdf() (chi² on adaptive bins)
///   integral     of pdf() is the fraction of samples that succeed
///   energy       the integral of eval() over incident directions is at most `albedo_limit`, and the mean of
///                eval() / pdf over the samples
///   reciprocity  eval(a, b) / |cos b| / n_a² is eval(b, a) / |cos a| / n_b²
///   parts        glossy() gives a fraction and an alpha in [0, 1]; the parts' densities, in their
///                fractions, add up to pdf(); each part's samples, frequencies and integral, as of the whole
///
/// n is the index of refraction on a direction's side of the normal: 1 above and `ior` below.
/// A BSDF carries radiance from incident to outgoing.
/// Its symmetric form is f / n_outgoing² (Veach 1997, section 5.2).
/// Light that enters the denser side gains n².
/// Energy therefore counts light from the other side times (n_incident / n_outgoing)².
/// Reciprocity is not checked within 0.06 degrees of the surface.
///
/// Outgoing directions are the normal, and 3, 30, 60 and 80 degrees from it at several azimuths.
/// Where transmits(), their mirror images below the normal are added.
/// Values, reciprocity and the parts' sum are checked at random directions too.
/// Each statistical test is made at `significance` over the number of tests (Bonferroni).
/// Integrals have an allowance of 0.05% and the quadrature's own error.
/// Random numbers follow from `seed`, so that a verdict does not change from run to run.
///
/// The BSDF is called inside kernels, by value.
/// Cost: 11 outgoing directions, 22 where transmits(), times `samples` samples.
/// The quadratures take as many evaluations again. Separate parts make it three times that.
/// Lobes narrower than a GGX alpha of 0.01 exceed the quadrature, and the report says so.
template <class Exec, class Bsdf>
check_report check_bsdf(const Exec& exec, const Bsdf& bsdf, const bsdf_check_options& options = {});

}  // namespace wfpg::testing

#include <wfpg/testing/detail/check_bsdf_impl.hpp>
