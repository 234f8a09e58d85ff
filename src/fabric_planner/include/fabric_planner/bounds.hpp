// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Lower bounds say so where an action may not be taken: no belief with a chance of that state is
/// worth less than with any policy that is allowed. Finite, so that 0 times it is 0.
constexpr double FORBIDDEN = -1e30;

/// A bound on the optimal value that is the largest of linear functions of the belief.
struct AlphaVectors {
  Eigen::MatrixXd vectors;   ///< (K, S)
  std::vector<int> actions;  ///< (K,): the first action of each vector's policy

  /// Row with the largest value at the belief (S,), which need not be normalised.
  [[nodiscard]] int best(const Eigen::Ref<const Eigen::VectorXd>& belief) const;
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& belief) const;
};

/// Upper bound: the state becomes known after one step. One vector an action. Where an action is
/// not allowed in a state it counts as the best one that is.
/// @throw ModelError when discount is 1 and the value does not settle.
AlphaVectors qmdp(const Pomdp& model);

/// Upper bound, never above QMDP: the state becomes known one step late (Hauskrecht 2000),
/// Q(a, s) = R(a, s) + gamma sum_o max_a' sum_s' T(s, s') O(s', o) Q(a', s').
/// One vector an action. Small models are solved by policy iteration and lifted by what rounding
/// may have cost; others come down from QMDP until a sweep changes less than tolerance (1 - gamma),
/// so that it is a bound wherever it stops.
/// @throw ModelError when discount is 1 and the value does not settle.
AlphaVectors fastInformedBound(const Pomdp& model, double tolerance = 1e-6);

/// Lower bound: one action for ever. One vector an action; with discount 1 only for the actions
/// that end everything when they are repeated. With action sets also one vector for each action
/// that is followed by the least reward for ever.
/// @throw ModelError when discount is 1 and no action ends everything.
AlphaVectors blindBound(const Pomdp& model);

/// How much work the point-based lower bound may take; all counts, so that results repeat.
struct PointBasedOptions {
  int beliefs = 200;        ///< at which the bound is improved, at most
  int first_beliefs = 60;   ///< taken from the policy of the fast informed bound
  int new_beliefs = 20;     ///< gathered each further round along the own policy, or a fifth
  int episodes = 10;        ///< simulated a round
  int depth = 60;           ///< steps of an episode
  int rounds = 40;          ///< at most
  double work = 4e9;        ///< multiplications after which no further round begins
  double tolerance = 1e-7;  ///< a round without new beliefs that gains less anywhere is the last
  std::uint64_t seed = 1;   ///< of the episodes

  /// Some 15 ms for the robot's models.
  static PointBasedOptions quick();
};

/// Lower bound, never below the blind one: point-based policy iteration (Ji et al. 2007).
/// Beliefs are gathered along the improved policy, where looking one step ahead gains most; the
/// controller that acts best there is evaluated exactly (less what the residual leaves open), its
/// vectors that are best somewhere are kept. Deterministic. Exact for MDPs.
/// @throw ModelError when discount is 1 and no action ends everything.
AlphaVectors pointBasedBound(const Pomdp& model, const PointBasedOptions& options = {});

}  // namespace fabric::planner

#include "fabric_planner/upper_bound.hpp"  // IWYU pragma: export
