// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"
#include "lower_solver.hpp"
#include "solver_model.hpp"

namespace fabric::planner {
namespace {

constexpr double NEGLIGIBLE = 1e-9;     // probability of an observation that is not followed
constexpr double CLOSE_BELIEFS = 1e-3;  // L1 distance below which two beliefs count as one

/// The farthest successor of a belief from those already chosen, and how far it is.
std::pair<SparseBelief, double> farthestSuccessor(const SolverModel& m, const SparseBelief& belief,
                                                  const std::vector<SparseBelief>& chosen) {
  std::pair<SparseBelief, double> farthest{belief, 0.0};
  Outcomes next;
  for (int a = 0; a < m.actions(); ++a) {
    m.successors(belief, a, next);
    for (int o = 0; o < m.observations(); ++o) {
      if (next.size(o) == 0 || next.probability(o) < NEGLIGIBLE) continue;
      const SparseBelief candidate = next.normalised(o);
      double nearest = std::numeric_limits<double>::infinity();
      for (const SparseBelief& known : chosen) {
        nearest = std::min(nearest, distance(known, candidate));
        if (nearest <= farthest.second) break;
      }
      if (nearest > farthest.second) farthest = {candidate, nearest};
    }
  }
  return farthest;
}

/// Where every observation tells the state, acting by Q is the best that can be done.
AlphaVectors stateSeen(const Pomdp& model) {
  AlphaVectors bound = qmdp(model);
  if (model.allowed().size() == 0) return bound;
  bound.vectors = model.allowed().select(bound.vectors.array(), FORBIDDEN);
  return bound;
}

}  // namespace

PointBasedOptions PointBasedOptions::quick() {
  PointBasedOptions options;
  options.beliefs = 80;
  options.rounds = 2;
  return options;
}

Eigen::MatrixXd reachableBeliefs(const Pomdp& model, int count) {
  const SolverModel m(model);
  std::vector<SparseBelief> beliefs{SparseBelief(model.initialBelief())};
  bool grew = true;
  while (grew && static_cast<int>(beliefs.size()) < count) {
    grew = false;
    const size_t known = beliefs.size();
    for (size_t i = 0; i < known && static_cast<int>(beliefs.size()) < count; ++i) {
      auto [belief, distance] = farthestSuccessor(m, beliefs[i], beliefs);
      if (distance < CLOSE_BELIEFS) continue;
      beliefs.push_back(std::move(belief));
      grew = true;
    }
  }
  Eigen::MatrixXd columns(model.numStates(), static_cast<Eigen::Index>(beliefs.size()));
  for (size_t i = 0; i < beliefs.size(); ++i) {
    columns.col(static_cast<Eigen::Index>(i)) = beliefs[i].dense(model.numStates());
  }
  return columns;
}

AlphaVectors pointBasedBound(const Pomdp& model, const PointBasedOptions& options) {
  if (model.fullyObservable()) return stateSeen(model);
  const SolverModel m(model);
  LowerSolver solver(m, options.seed);
  for (int round = 0; round < options.rounds; ++round) {
    if (round > 0 && solver.work() > options.work) break;
    if (!solver.step(options)) break;
  }
  return solver.bound();
}

}  // namespace fabric::planner
