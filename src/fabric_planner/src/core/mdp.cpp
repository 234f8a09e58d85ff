// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/mdp.hpp"

#include <Eigen/LU>
#include <cmath>

namespace fabric::planner {
namespace {

constexpr int SMALL_ENOUGH_FOR_LU = 1000;
constexpr int WARM_UP_SWEEPS = 200;
constexpr int MAX_SWEEPS = 200000;
constexpr int MAX_POLICIES = 1000;

Eigen::MatrixXd actionValues(const Pomdp& m, const Eigen::VectorXd& V) {
  Eigen::MatrixXd q = m.R();
  for (int a = 0; a < m.numActions(); ++a) {
    q.row(a) += m.discount() * (m.T(a) * V).transpose();
  }
  return q;
}

/// V = max R / (1 - gamma): nothing is worth more. With discount 1 there is no such number.
Eigen::VectorXd startingValue(const Pomdp& m) {
  const double gamma = m.discount();
  const double best = gamma < 1.0 ? m.R().maxCoeff() / (1.0 - gamma) : 0.0;
  return Eigen::VectorXd::Constant(m.numStates(), best);
}

bool iterateValue(const Pomdp& m, int sweeps, double tolerance, Eigen::VectorXd& V) {
  const double gamma = m.discount();
  const double change_allowed = gamma < 1.0 ? tolerance * (1.0 - gamma) / gamma : tolerance;
  for (int i = 0; i < sweeps; ++i) {
    const Eigen::VectorXd next = actionValues(m, V).colwise().maxCoeff().transpose();
    const double change = (next - V).cwiseAbs().maxCoeff();
    V = next;
    if (change <= change_allowed) return true;
  }
  return false;
}

std::vector<int> greedy(const Eigen::MatrixXd& q) {
  std::vector<int> policy(static_cast<size_t>(q.cols()));
  for (Eigen::Index s = 0; s < q.cols(); ++s) {
    q.col(s).maxCoeff(&policy[static_cast<size_t>(s)]);
  }
  return policy;
}

/// Solves (I - gamma T_pi) V = R_pi.
Eigen::VectorXd evaluate(const Pomdp& m, const std::vector<int>& policy) {
  const int n = m.numStates();
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd reward(n);
  for (int s = 0; s < n; ++s) {
    const int a = policy[static_cast<size_t>(s)];
    system.row(s) -= m.discount() * m.T(a).row(s);
    reward(s) = m.R()(a, s);
  }
  return system.partialPivLu().solve(reward);
}

/// Changes the policy only where that gains more than rounding, so that it must come to an end.
bool improve(const Eigen::MatrixXd& q, std::vector<int>& policy) {
  bool changed = false;
  for (Eigen::Index s = 0; s < q.cols(); ++s) {
    int& action = policy[static_cast<size_t>(s)];
    int best = action;
    const double value = q.col(s).maxCoeff(&best);
    if (value <= q(action, s) + 1e-12 * (1.0 + std::abs(value))) continue;
    action = best;
    changed = true;
  }
  return changed;
}

Eigen::VectorXd iteratePolicy(const Pomdp& m, const Eigen::VectorXd& start) {
  auto policy = greedy(actionValues(m, start));
  Eigen::VectorXd V = evaluate(m, policy);
  for (int i = 0; i < MAX_POLICIES && improve(actionValues(m, V), policy); ++i) {
    V = evaluate(m, policy);
  }
  return V;
}

}  // namespace

MdpSolution solveMdp(const Pomdp& m, double tolerance) {
  if (!std::isfinite(tolerance) || tolerance <= 0.0) {
    throw ModelError("tolerance is " + std::to_string(tolerance) + ", not a positive number");
  }
  const bool exact = m.discount() < 1.0 && m.numStates() <= SMALL_ENOUGH_FOR_LU;
  MdpSolution solution;
  solution.value = startingValue(m);
  const bool settled =
      iterateValue(m, exact ? WARM_UP_SWEEPS : MAX_SWEEPS, tolerance, solution.value);
  if (exact) {
    solution.value = iteratePolicy(m, solution.value);
  } else if (!settled) {
    throw ModelError(m.name() + ": the value does not settle (discount " +
                     std::to_string(m.discount()) + ")");
  }
  solution.q = actionValues(m, solution.value);
  solution.policy = greedy(solution.q);
  return solution;
}

}  // namespace fabric::planner
