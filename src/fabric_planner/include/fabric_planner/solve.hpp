// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/upper_bound.hpp"

namespace fabric::planner {

/// Bounds at the initial belief after so much time and work.
struct SolveProgress {
  double time;  ///< s of CPU time
  double work;  ///< multiplications
  double lower;
  double upper;
};

/// When to stop; whichever comes first. Results repeat exactly unless it was the time.
struct SolveOptions {
  double time = 1.0;  ///< s of CPU time of the calling thread, > 0; infinity: no limit
  double work = std::numeric_limits<double>::infinity();  ///< multiplications, > 0
  double gap = 1e-3;          ///< upper minus lower bound at the initial belief, >= 0
  int beliefs = 1000;         ///< of the lower bound, at most
  int points = 5000;          ///< of the upper bound, at most
  int query_points = 128;     ///< of them for PointUpperBound::value()
  double lower_share = 0.15;  ///< of the work, that goes into the lower bound, in [0, 1]; as much
                              ///< again while that closes the gap faster
  std::uint64_t seed = 1;
  /// Told every entry of the history as it is made; may be empty. What it throws ends solve().
  std::function<void(const SolveProgress&)> progress;
};

/// A policy and how far it may be from the best one.
struct Solution {
  AlphaVectors lower;  ///< each vector is the value of a policy that begins with its action
  PointUpperBound upper;
  std::vector<SolveProgress> history;  ///< lower never falls, upper never rises; at least one entry

  [[nodiscard]] double lowerValue() const { return history.back().lower; }
  [[nodiscard]] double upperValue() const { return history.back().upper; }
  [[nodiscard]] double gap() const { return upperValue() - lowerValue(); }
};

/// Improves a lower and an upper bound in turn: point-based policy iteration with exactly evaluated
/// controllers from below (see pointBasedBound), points interpolated by linear programming from
/// above. More time or work never lowers the one nor raises the other at the initial belief.
/// @throw ModelError when an option is out of range, or as fastInformedBound() and blindBound() do.
Solution solve(const Pomdp& model, const SolveOptions& options = {});

}  // namespace fabric::planner
