// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <unordered_map>
#include <vector>

#include "fabric_planner/random.hpp"
#include "fabric_planner/upper_bound.hpp"
#include "interpolator.hpp"
#include "point_table.hpp"
#include "solver_model.hpp"
#include "vector_set.hpp"

namespace fabric::planner {

/// Improves an upper bound at points that matter to the initial belief.
///
/// Points are found by trials (Smith & Simmons 2004): down the action with the best upper bound, to
/// the observation with the largest weighted gap in excess of what is asked for. A point's value is
/// the best backup over the actions, each successor being interpolated by linear programming; the
/// weights that were best are kept, so that the points form an MDP whose values can be iterated
/// without programming (policy iteration for the player that picks the weights). Any weights give
/// an upper bound, and values only fall.
class UpperSolver {
 public:
  /// model: must outlive this. base: an upper bound, one vector an action.
  UpperSolver(const SolverModel& model, AlphaVectors base, std::uint64_t seed);

  /// Trials until there are a good many new points, then every value is iterated. on: asked often
  /// whether to go on. max_points: no more are added beyond. @return false when nothing moved.
  bool round(const VectorSet& lower, int max_points, const std::function<bool()>& on);

  /// One trial against a lower bound. excess: gap at the initial belief that is left alone,
  /// as a share of the present one. max_points: no more are added beyond.
  void trial(const VectorSet& lower, double excess, int max_points);
  /// Iterates values over the kept weights. @return the most that one fell in the last sweep.
  double sweep(int sweeps, double tolerance);
  /// Finds the best weights again for the best action of every point and corner.
  void reoptimise(const std::function<bool()>& on);

  /// Beliefs of the last trial, the initial one first.
  [[nodiscard]] std::vector<SparseBelief> path() const;
  /// Value of the initial belief.
  [[nodiscard]] double root() const { return value(root_); }
  [[nodiscard]] const PointTable& table() const { return table_; }
  [[nodiscard]] PointUpperBound bound(int query_points) const;
  [[nodiscard]] double work() const { return work_ + interpolator_.work(); }

 private:
  /// A place to act from: sites 0 .. S-1 are the corners, S + k is point k.
  struct Term {
    int site;
    double weight;
  };
  struct Choice {
    bool known = false;        ///< q comes from weights, not only from the base
    double q = 0.0;            ///< at most this is to be had by the action
    double reward = 0.0;       ///< with that of successors where the base says less than the points
    std::vector<int> basis;    ///< of each successor in turn
    std::vector<Term> future;  ///< discounted
    std::vector<double> upper;  ///< (O,) bound of each successor times its probability
  };
  struct Site {
    SparseBelief belief;
    std::vector<Choice> choices;  ///< (A,)
  };

  [[nodiscard]] double value(int site) const;
  void lower(int site, double v);
  int addSite(SparseBelief belief);
  /// The site of a belief, added when there is none; -1 when there is no room.
  int siteOf(const SparseBelief& belief, double v, int max_points);
  void solve(int site, int action);
  void interpolate(int o, int* basis, Choice& choice);
  double bestStored(Site& site);
  /// Backs a site up; only the actions that may be best are solved. @return the best action.
  int backUp(int site);
  /// The best action by the kept weights; a site that has none for it is backed up.
  int bestKnown(int site);
  /// The most important observation after an action, -1 when none exceeds; the outcomes are then
  /// those of the action.
  int descend(int site, int action, const VectorSet& lower, double excess);

  const SolverModel& m_;
  AlphaVectors base_;
  VectorSet base_set_;
  PointTable table_;
  Interpolator interpolator_;
  std::vector<Site> sites_;
  std::unordered_multimap<std::uint64_t, int> known_;
  int root_ = -1;
  std::vector<int> path_;  ///< sites of the last trial
  Outcomes outcomes_;
  std::vector<double> sums_;  ///< weight of each site, zero between calls
  std::vector<int> touched_;  ///< sites with a weight
  Random random_;
  std::uint64_t trials_ = 0;
  double work_ = 0.0;
};

}  // namespace fabric::planner
