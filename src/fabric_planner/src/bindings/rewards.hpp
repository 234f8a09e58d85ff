// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace fabric::planner {

/// Reads an array of rewards by index.
class RewardArray {
 public:
  /// @throw ModelError unless the array is (A, S, S') or (A, S, S', O) and finite.
  RewardArray(const Array& array, const Pomdp& model) : array_(array), model_(model) {
    const std::vector<int> sizes = {model.numActions(), model.numStates(), model.numStates(),
                                    model.numObservations()};
    const auto dimensions = static_cast<size_t>(array.ndim());
    if (dimensions < 3 || dimensions > 4) {
      throw ModelError("R has " + std::to_string(dimensions) + " dimensions, expected 2, 3 or 4");
    }
    for (size_t i = 0; i < dimensions; ++i) {
      const auto size = array.shape(static_cast<int>(i));
      if (size == sizes[i]) continue;
      throw ModelError("R has " + std::to_string(size) + " entries in dimension " +
                       std::to_string(i) + ", expected " + std::to_string(sizes[i]));
    }
    checkFinite();
  }

  /// R(a, s) = sum_s' T(s, a, s') sum_o O(a, s', o) R(a, s, s', o), the expected reward.
  [[nodiscard]] Eigen::MatrixXd expected() const {
    Eigen::MatrixXd R(model_.numActions(), model_.numStates());
    for (int a = 0; a < R.rows(); ++a) {
      for (int s = 0; s < R.cols(); ++s) R(a, s) = expected(a, s);
    }
    return R;
  }

 private:
  [[nodiscard]] double expected(int a, int s) const {
    double sum = 0.0;
    for (SparseRows::InnerIterator next(model_.T(a), s); next; ++next) {
      const auto after = next.col();
      sum += next.value() * (array_.ndim() == 3 ? array_.at(a, s, after) : expected(a, s, after));
    }
    return sum;
  }

  [[nodiscard]] double expected(int a, int s, Eigen::Index after) const {
    double sum = 0.0;
    for (int o = 0; o < model_.numObservations(); ++o) {
      sum += model_.O(a).coeff(after, o) * array_.at(a, s, after, o);
    }
    return sum;
  }

  void checkFinite() const {
    const auto per_state = array_.size() / (array_.shape(0) * array_.shape(1));
    for (pybind11::ssize_t i = 0; i < array_.size(); ++i) {
      const double reward = array_.data()[i];
      if (std::isfinite(reward)) continue;
      const auto row = i / per_state;
      throw ModelError("R[" + model_.actions()[static_cast<size_t>(row / array_.shape(1))] +
                       "] at " + model_.states()[static_cast<size_t>(row % array_.shape(1))] +
                       (std::isnan(reward) ? " is NaN" : " is infinite"));
    }
  }

  const Array& array_;
  const Pomdp& model_;
};

}  // namespace fabric::planner
