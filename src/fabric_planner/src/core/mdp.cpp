// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/mdp.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "text.hpp"

namespace fabric::planner {
namespace {

constexpr int SMALL_ENOUGH_FOR_LU = 200;
constexpr int SMALL_ENOUGH_FOR_POLICIES = 1000;
constexpr int WARM_UP_SWEEPS = 200;
constexpr int MAX_SWEEPS = 200000;
constexpr int MAX_POLICIES = 1000;
constexpr double SETTLED = 1e-14;  // relative change of a value that rounding explains
constexpr double INFINITE = std::numeric_limits<double>::infinity();

bool isAllowed(const Pomdp& m, int action, Eigen::Index s) {
  return m.allowed().size() == 0 || m.allowed()(action, s);
}

double expected(const SparseRows& T, Eigen::Index s, const Eigen::VectorXd& V) {
  double sum = 0.0;
  for (SparseRows::InnerIterator it(T, s); it; ++it) sum += it.value() * V(it.col());
  return sum;
}

double actionValue(const Pomdp& m, int action, Eigen::Index s, const Eigen::VectorXd& V) {
  if (!isAllowed(m, action, s)) return -INFINITE;
  return m.R()(action, s) + m.discount() * expected(m.T(action), s, V);
}

Eigen::MatrixXd actionValues(const Pomdp& m, const Eigen::VectorXd& V) {
  Eigen::MatrixXd q(m.numActions(), m.numStates());
  for (int a = 0; a < m.numActions(); ++a) {
    for (Eigen::Index s = 0; s < q.cols(); ++s) q(a, s) = actionValue(m, a, s, V);
  }
  return q;
}

double bestValue(const Pomdp& m, Eigen::Index s, const Eigen::VectorXd& V) {
  double best = -INFINITE;
  for (int a = 0; a < m.numActions(); ++a) best = std::max(best, actionValue(m, a, s, V));
  return best;
}

/// Applies update(s) to every state in turn until the largest change is `allowed` at most.
template <typename Update>
bool sweep(int sweeps, double allowed, Eigen::VectorXd& V, const Update& update) {
  for (int i = 0; i < sweeps; ++i) {
    double change = 0.0;
    for (Eigen::Index s = V.size(); s-- > 0;) {
      const double value = update(s);
      change = std::max(change, std::abs(value - V(s)) - SETTLED * std::abs(value));
      V(s) = value;
    }
    if (change <= allowed) return true;
    if (!V.allFinite()) return false;
  }
  return false;
}

[[noreturn]] void doesNotSettle(const Pomdp& m) {
  throw ModelError(m.name() + ": the value does not settle (discount " + text(m.discount()) + ")");
}

/// With discount 1: all rewards above zero that can be collected. Nothing is worth more.
Eigen::VectorXd collectable(const Pomdp& m) {
  Eigen::VectorXd V = Eigen::VectorXd::Zero(m.numStates());
  const auto update = [&](Eigen::Index s) {
    double best = 0.0;
    for (int a = 0; a < m.numActions(); ++a) {
      if (!isAllowed(m, a, s)) continue;
      best = std::max(best, std::max(0.0, m.R()(a, s)) + expected(m.T(a), s, V));
    }
    return best;
  };
  if (!sweep(MAX_SWEEPS, 0.0, V, update)) doesNotSettle(m);
  return V;
}

Eigen::VectorXd startingValue(const Pomdp& m) {
  if (m.discount() >= 1.0) return collectable(m);
  const double best = m.R().maxCoeff() / (1.0 - m.discount());
  return Eigen::VectorXd::Constant(m.numStates(), best);
}

bool iterateValue(const Pomdp& m, int sweeps, double tolerance, Eigen::VectorXd& V) {
  const double gamma = m.discount();
  const double allowed = gamma < 1.0 ? tolerance * (1.0 - gamma) / gamma : 0.0;
  return sweep(sweeps, allowed, V, [&](Eigen::Index s) { return bestValue(m, s, V); });
}

std::vector<int> greedy(const Eigen::MatrixXd& q) {
  std::vector<int> policy(static_cast<size_t>(q.cols()));
  for (Eigen::Index s = 0; s < q.cols(); ++s) {
    q.col(s).maxCoeff(&policy[static_cast<size_t>(s)]);
  }
  return policy;
}

/// Solves (I - gamma T_pi) V = R_pi; terminal states are worth nothing.
Eigen::VectorXd evaluateByLu(const Pomdp& m, const std::vector<int>& policy) {
  const int n = m.numStates();
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd reward = Eigen::VectorXd::Zero(n);
  for (int s = 0; s < n; ++s) {
    if (m.terminal()[static_cast<size_t>(s)]) continue;
    const int a = policy[static_cast<size_t>(s)];
    for (SparseRows::InnerIterator it(m.T(a), s); it; ++it) {
      system(s, it.col()) -= m.discount() * it.value();
    }
    reward(s) = m.R()(a, s);
  }
  return system.partialPivLu().solve(reward);
}

Eigen::VectorXd evaluate(const Pomdp& m, const std::vector<int>& policy, Eigen::VectorXd V) {
  if (m.numStates() <= SMALL_ENOUGH_FOR_LU) {
    V = evaluateByLu(m, policy);
    if (!V.allFinite()) doesNotSettle(m);
    return V;
  }
  const auto update = [&](Eigen::Index s) {
    return actionValue(m, policy[static_cast<size_t>(s)], s, V);
  };
  if (!sweep(MAX_SWEEPS, 0.0, V, update)) doesNotSettle(m);
  return V;
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
  Eigen::VectorXd V = evaluate(m, policy, start);
  for (int i = 0; i < MAX_POLICIES && improve(actionValues(m, V), policy); ++i) {
    V = evaluate(m, policy, V);
  }
  return V;
}

MdpSolution solution(const Pomdp& m, Eigen::VectorXd value) {
  MdpSolution result;
  result.q = actionValues(m, value);
  result.policy = greedy(result.q);
  result.value = std::move(value);
  return result;
}

void checkTolerance(double tolerance) {
  if (std::isfinite(tolerance) && tolerance > 0.0) return;
  throw ModelError("tolerance is " + std::to_string(tolerance) + ", not a positive number");
}

}  // namespace

MdpSolution valueIteration(const Pomdp& model, double tolerance) {
  checkTolerance(tolerance);
  Eigen::VectorXd V = startingValue(model);
  if (!iterateValue(model, MAX_SWEEPS, tolerance, V)) doesNotSettle(model);
  return solution(model, std::move(V));
}

MdpSolution policyIteration(const Pomdp& model) {
  Eigen::VectorXd V = startingValue(model);
  const bool settled = iterateValue(model, model.discount() < 1.0 ? WARM_UP_SWEEPS : MAX_SWEEPS,
                                    std::numeric_limits<double>::min(), V);
  if (!settled && model.discount() >= 1.0) doesNotSettle(model);
  return solution(model, iteratePolicy(model, V));
}

MdpSolution solveMdp(const Pomdp& model, double tolerance) {
  checkTolerance(tolerance);
  const bool small = model.numStates() <= SMALL_ENOUGH_FOR_POLICIES;
  return small && model.discount() < 1.0 ? policyIteration(model)
                                         : valueIteration(model, tolerance);
}

}  // namespace fabric::planner
