// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <mutex>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/decision.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// How much is computed before the first decision.
enum class Preparation {
  QUICK,     ///< PointBasedOptions::quick() below, fastInformedBound() above: soon ready, and
             ///< decisions of one node are the fastest there are
  THOROUGH,  ///< the defaults of pointBasedBound() and pointBasedUpperBound()
};

struct PlannerOptions {
  double deadline = 0.5;  ///< s of steady time a decision may take, >= 0
  double gap = 1e-3;      ///< upper minus lower bound at which a decision is good enough, >= 0
  int max_nodes = 5000;   ///< expanded beliefs the tree may hold, those kept included, >= 0
  Preparation preparation = Preparation::THOROUGH;
};

/// The offline bounds of a planner with these options.
/// @throw ModelError when discount is 1 and the model never ends.
AlphaVectors preparedLowerBound(const Pomdp& model, const PlannerOptions& options);
PointUpperBound preparedUpperBound(const Pomdp& model, const PlannerOptions& options);

/// A belief or an action of the search tree, for those who want to look at it.
struct TreeEntry {
  int parent;          ///< index of the entry it belongs to, -1 at the root
  int depth;           ///< steps from the root
  int action;          ///< that led to the belief, -1 at the root; or the action itself
  int observation;     ///< that led to the belief, -1 at the root and for an action
  double probability;  ///< of the observation, given the belief and the action before; else 1
  double reach;        ///< product of the probabilities from the root to here
  double lower;        ///< of the value at the belief, or after the action
  double upper;
  int expanded;  ///< beliefs expanded from here down

  [[nodiscard]] bool isBelief() const { return parent < 0 || observation >= 0; }
};

class SearchTree;
class Stopwatch;

/// Anytime search over exact beliefs between a lower and an upper bound.
///
/// The tree grows where it counts most for the gap at the root (AEMS2, Ross & Chaib-draa 2007):
/// down the action with the best upper bound, to the leaf with the largest gap weighted by
/// discount and probability. Leaves are bounded by vectors below and by a PointUpperBound above,
/// both found when the planner is made, outside any deadline. Bounds at the root hold for the
/// optimal policy whenever the search stops.
///
/// From step to step the search goes on: advance() moves the root and keeps what is below it, in
/// no more than the time of one update; the rest is used again. All memory is reserved when the
/// planner is made and no later call allocates any, tree() apart.
///
/// The same belief gives the same decision after reset(), except when it ended by DEADLINE. After
/// advance() a decision also depends on the calls since the last reset, and on nothing else.
/// Calls may come from several threads; they wait for one another.
class OnlinePlanner {
 public:
  /// @throw ModelError when an option is out of range, or discount is 1 and the model never ends.
  explicit OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options = {});
  /// Searches between bounds found elsewhere; the promises about bounds are as good as these.
  /// @throw ModelError when an option is out of range or a bound has not S columns or no vector.
  OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options, AlphaVectors lower,
                PointUpperBound upper);
  ~OnlinePlanner();

  /// Goes on with the tree when the belief is that of its root, and begins another when not.
  /// @param belief (S,), sums to 1. @throw ModelError when it is no distribution, or when the
  /// model allows no action there.
  Decision decide(const Eigen::VectorXd& belief);

  /// The action that was taken at the last belief, and what was observed then. The next decide()
  /// is expected at the belief after them, but need not be.
  /// @throw std::out_of_range when an index is none of the model's.
  void advance(int action, int observation);

  /// Forgets the tree.
  void reset();

  /// The tree as plain data, level by level: beliefs, their allowed actions, the beliefs after
  /// those, and so on. Leaves out beliefs more than max_depth steps away or with a reach below
  /// min_probability. Empty before the first decision.
  [[nodiscard]] std::vector<TreeEntry> tree(int max_depth, double min_probability = 0.0) const;

  [[nodiscard]] const AlphaVectors& lowerBound() const { return lower_; }
  [[nodiscard]] const PointUpperBound& upperBound() const { return upper_; }
  [[nodiscard]] const PlannerOptions& options() const { return options_; }
  [[nodiscard]] const Pomdp& model() const { return *model_; }

 private:
  [[nodiscard]] bool isUsable(const Eigen::VectorXd& belief) const;
  EndedBy search(Stopwatch& watch);
  void boundActions(const Eigen::VectorXd& belief);
  [[nodiscard]] int bestAction(int without) const;
  void choose(Decision& decision) const;

  std::shared_ptr<const Pomdp> model_;
  PlannerOptions options_;
  AlphaVectors lower_;
  PointUpperBound upper_;
  std::unique_ptr<SearchTree> tree_;
  Eigen::VectorXd action_lower_;  ///< (A,), at the last belief; -inf: not known or not allowed
  Eigen::VectorXd action_upper_;  ///< (A,)
  mutable std::mutex one_at_a_time_;
};

}  // namespace fabric::planner
