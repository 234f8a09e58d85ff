// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <memory>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

class PaddedModel;

enum class UpdateStatus {
  OK,         ///< Bayes' rule
  RECOVERED,  ///< the observation was impossible under the belief; the rule of BeliefFilter held
};

/// The exact belief over the states of a POMDP.
///
/// update() is Bayes' rule, b'(s') = O(a, s', o) sum_s T(s, a, s') b(s) / P(o | b, a). When that
/// probability is zero the model says the observation cannot have happened. It did, so:
///   1. the states from which it can come take over, b'(s') = O(a, s', o) / sum_s O(a, s, o),
///      which is Bayes' rule with a uniform prediction: what was believed before was wrong;
///   2. if it can come from no state at all, the prediction T'b stays: nothing was learnt.
/// Both are counted in recoveries() and told to the caller. The belief always sums to 1. No update
/// but a recovery allocates memory. Not for several threads at once.
class BeliefFilter {
 public:
  explicit BeliefFilter(std::shared_ptr<const Pomdp> model);

  /// Starts again from the model's initial belief.
  void reset();
  /// Starts again from the given belief (S,). @throw ModelError when it is no distribution.
  void reset(const Eigen::VectorXd& belief);

  /// @throw std::out_of_range when an index is none of the model's.
  UpdateStatus update(int action, int observation);

  /// (S,), sums to 1.
  [[nodiscard]] const Eigen::VectorXd& belief() const { return belief_; }
  /// How many updates since the last reset were impossible under the model.
  [[nodiscard]] std::uint64_t recoveries() const { return recoveries_; }
  [[nodiscard]] const Pomdp& model() const { return *model_; }

 private:
  double jointPadded(int action, int observation);
  double jointSparse(int action, int observation);
  void recover(int action, int observation);

  std::shared_ptr<const Pomdp> model_;
  std::shared_ptr<const PaddedModel> padded_;  ///< of a small model, else none
  Eigen::VectorXd belief_;                     ///< (S,)
  Eigen::VectorXd predicted_;                  ///< (S,) and lanes to fill up: P(s' | b, a)
  Eigen::VectorXd joint_;                      ///< the same: P(s', o | b, a)
  std::uint64_t recoveries_ = 0;
};

}  // namespace fabric::planner
