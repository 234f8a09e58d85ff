// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/bounds.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "fabric_planner/mdp.hpp"

namespace fabric::planner {
namespace {

constexpr int SMALL_ENOUGH_FOR_LU = 1000;
constexpr int MAX_SWEEPS = 2000;
constexpr double MAX_WORK = 4e9;  // multiplications

void needDiscount(const Pomdp& m, const char* bound) {
  if (m.discount() < 1.0) return;
  throw ModelError(m.name() + ": the " + bound + " needs a discount below 1");
}

std::vector<int> oneEach(int actions) {
  std::vector<int> all(static_cast<size_t>(actions));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// One Bellman sweep of the fast informed bound over (A, S) values.
Eigen::MatrixXd informedSweep(const Pomdp& m, const Eigen::MatrixXd& Q) {
  Eigen::MatrixXd next = m.R();
  for (int a = 0; a < m.numActions(); ++a) {
    Eigen::VectorXd future = Eigen::VectorXd::Zero(m.numStates());
    for (int o = 0; o < m.numObservations(); ++o) {
      const Eigen::VectorXd likelihood = m.O(a).col(o);
      const Eigen::MatrixXd weighted = likelihood.asDiagonal() * Q.transpose();
      future += (m.T(a) * weighted).rowwise().maxCoeff();
    }
    next.row(a) += m.discount() * future.transpose();
  }
  return next;
}

/// The value of one action for ever, from below when there are too many states to solve for it.
Eigen::VectorXd blindValue(const Pomdp& m, int action) {
  const int n = m.numStates();
  const Eigen::VectorXd reward = m.R().row(action).transpose();
  if (n <= SMALL_ENOUGH_FOR_LU) {
    const Eigen::MatrixXd system =
        Eigen::MatrixXd::Identity(n, n) - m.discount() * m.T(action).toDense();
    return system.partialPivLu().solve(reward);
  }
  Eigen::VectorXd V = Eigen::VectorXd::Constant(n, reward.minCoeff() / (1.0 - m.discount()));
  for (int i = 0; i < MAX_SWEEPS; ++i) {
    const Eigen::VectorXd next = reward + m.discount() * (m.T(action) * V);
    if ((next - V).maxCoeff() < 1e-9) break;
    V = next;
  }
  return V;
}

}  // namespace

int AlphaVectors::best(const Eigen::VectorXd& belief) const {
  int row = 0;
  (vectors * belief).maxCoeff(&row);
  return row;
}

double AlphaVectors::value(const Eigen::VectorXd& belief) const {
  return (vectors * belief).maxCoeff();
}

AlphaVectors qmdp(const Pomdp& model) { return {solveMdp(model).q, oneEach(model.numActions())}; }

AlphaVectors fastInformedBound(const Pomdp& model, double tolerance) {
  needDiscount(model, "fast informed bound");
  AlphaVectors bound = qmdp(model);
  const double s = model.numStates();
  const double a = model.numActions();
  const double sweep_work = a * a * s * s * model.numObservations();
  double work = 0.0;
  for (int i = 0; i < MAX_SWEEPS && (i == 0 || work + sweep_work < MAX_WORK); ++i) {
    const Eigen::MatrixXd next = informedSweep(model, bound.vectors).cwiseMin(bound.vectors);
    const double change = (bound.vectors - next).maxCoeff();
    bound.vectors = next;
    work += sweep_work;
    if (change < tolerance * (1.0 - model.discount())) break;
  }
  return bound;
}

AlphaVectors blindBound(const Pomdp& model) {
  needDiscount(model, "blind bound");
  AlphaVectors bound;
  bound.actions = oneEach(model.numActions());
  bound.vectors.resize(model.numActions(), model.numStates());
  for (int a = 0; a < model.numActions(); ++a) {
    bound.vectors.row(a) = blindValue(model, a).transpose();
  }
  return bound;
}

}  // namespace fabric::planner
