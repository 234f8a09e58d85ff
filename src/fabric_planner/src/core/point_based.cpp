// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"
#include "lower_solver.hpp"
#include "solver_model.hpp"

namespace fabric::planner {
namespace {

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
