// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fabric_planner/pomdp.hpp"
#include "simd.hpp"

namespace fabric::planner {

/// The tables of a small model written out in rows of full lanes, the rest zeros.
class PaddedModel {
 public:
  /// Above this many states the zeros of the tables cost more than they save.
  static constexpr int MOST_STATES = 64;
  static bool fits(const Pomdp& model) { return model.numStates() <= MOST_STATES; }

  explicit PaddedModel(const Pomdp& model);

  [[nodiscard]] int stateWidth() const { return state_width_; }
  [[nodiscard]] int symbolWidth() const { return symbol_width_; }
  /// (S, stateWidth): P(s' | s, a).
  [[nodiscard]] const double* T(int action) const;
  /// (A, S', symbolWidth): P(o | a, s'), and LANES zeros behind it.
  [[nodiscard]] const double* O() const { return emissions_.data(); }
  /// (stateWidth,): P(o | a, s') over s'.
  [[nodiscard]] const double* likelihood(int action, int observation) const;

 private:
  int states_;
  int symbols_;
  int state_width_;
  int symbol_width_;
  std::vector<double> transitions_;
  std::vector<double> emissions_;
  std::vector<double> likelihoods_;
};

/// predicted(s') = sum_s P(s' | s, action) belief(s). belief, predicted: (S,).
void predictSparse(const Pomdp& model, const double* belief, int action, double* predicted);

}  // namespace fabric::planner
