// How alike two distributions over the same cells are. A distribution is a value a cell, none negative.
#pragma once

#include <vector>

namespace inspect {

/// Values over their sum; as they are where that is 0.
std::vector<double> normalised(std::vector<double> values);

/// The Kullback-Leibler divergence of q from p, in nats: 0 where they are alike, infinite where q is 0 and p
/// is not. Both sum to 1, and are of one size.
double kl_divergence(const std::vector<double>& p, const std::vector<double>& q);

/// Pearson's, in [-1, 1]; NaN where one of them is constant. Precondition: of one size.
double correlation(const std::vector<double>& a, const std::vector<double>& b);

/// Means of blocks of `times` x `times` cells of a square grid, whose side is a multiple of that.
std::vector<double> coarsened(const std::vector<double>& fine, int times);

}  // namespace inspect
