// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <mutex>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/decision.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

struct PlannerOptions {
  double deadline = 0.5;  ///< s of steady time a decision may take, >= 0
  double gap = 1e-3;      ///< upper minus lower bound at which a decision is good enough, >= 0
  int max_nodes = 5000;   ///< beliefs one decision may expand, >= 0
};

class SearchTree;

/// Anytime search over exact beliefs between a lower and an upper bound.
///
/// The tree grows where it counts most for the gap at the root (AEMS2, Ross & Chaib-draa 2007):
/// down the action with the best upper bound, to the leaf with the largest gap weighted by
/// discount and probability. Leaves are bounded by pointBasedBound() below and
/// pointBasedUpperBound() above, both found when the planner is made, outside any deadline. Bounds
/// at the root hold for the optimal policy whenever the search stops. Memory for max_nodes is
/// reserved when the planner is made; no decision allocates nodes one by one.
///
/// The same belief gives the same decision, except when it ended by DEADLINE. decide() may be
/// called from several threads; calls wait for one another.
class OnlinePlanner {
 public:
  /// @throw ModelError when an option is out of range or the model's discount is 1.
  explicit OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options = {});
  ~OnlinePlanner();

  /// @param belief (S,), sums to 1. @throw ModelError when it is no distribution.
  Decision decide(const Eigen::VectorXd& belief);

  [[nodiscard]] const AlphaVectors& lowerBound() const { return lower_; }
  [[nodiscard]] const PointUpperBound& upperBound() const { return upper_; }
  [[nodiscard]] const PlannerOptions& options() const { return options_; }
  [[nodiscard]] const Pomdp& model() const { return *model_; }

 private:
  std::shared_ptr<const Pomdp> model_;
  PlannerOptions options_;
  AlphaVectors lower_;
  PointUpperBound upper_;
  std::unique_ptr<SearchTree> tree_;
  std::mutex one_at_a_time_;
};

}  // namespace fabric::planner
