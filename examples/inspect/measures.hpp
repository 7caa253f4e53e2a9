// Similarity of two distributions over the same cells. A distribution has a value per cell, none negative.
#pragma once

#include <vector>

namespace inspect {

/// Values divided by their sum. Unchanged if that is 0.
std::vector<double> normalised(std::vector<double> values);

/// The Kullback-Leibler divergence of q from p, in nats. 0 if they are equal, infinite if q is 0 where p is
/// not. Both sum to 1 and have equal size.
double kl_divergence(const std::vector<double>& p, const std::vector<double>& q);

/// Pearson's correlation, in [-1, 1]. NaN if one is constant. Precondition: equal size.
double correlation(const std::vector<double>& a, const std::vector<double>& b);

/// Means of blocks of `times` x `times` cells of a square grid. Its side must be a multiple of `times`.
std::vector<double> coarsened(const std::vector<double>& fine, int times);

}  // namespace inspect
