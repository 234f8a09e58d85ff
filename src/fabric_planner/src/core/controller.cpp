// SPDX-License-Identifier: BSD-3-Clause
#include "controller.hpp"

#include <algorithm>
#include <cmath>

#include "fabric_planner/bounds.hpp"

namespace fabric::planner {
namespace {

constexpr int MAX_STEPS = 200;        // of the Krylov method
constexpr int MAX_SWEEPS = 300;       // where it does not serve
constexpr double EXACT = 1e-11;       // residual, relative to the largest value
constexpr double GOOD_ENOUGH = 1e-6;  // what the residual may take away, relative

}  // namespace

void Controller::add(int action, const std::vector<int>& next) {
  actions_.push_back(action);
  next_.insert(next_.end(), next.begin(), next.end());
}

double Controller::stepWork() const { return m_.projectionWork() * numNodes(); }

void Controller::step(const Table& x, const std::vector<const double*>* known, Table& y) const {
  const int S = m_.states();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(m_.width());
  Eigen::VectorXd scratch(m_.width());
  std::vector<const double*> next(static_cast<size_t>(m_.observations()));
  for (int i = 0; i < numNodes(); ++i) {
    for (int o = 0; o < m_.observations(); ++o) {
      const int to = next_[static_cast<size_t>(i * m_.observations() + o)];
      if (to < numNodes()) {
        next[static_cast<size_t>(o)] = x.col(to).data();
      } else {
        next[static_cast<size_t>(o)] =
            known == nullptr ? zero.data() : (*known)[static_cast<size_t>(to - numNodes())];
      }
    }
    const int action = actions_[static_cast<size_t>(i)];
    m_.backProject(action, next.data(), scratch.data(), y.col(i).data());
    if (known == nullptr) continue;
    for (int s = 0; s < S; ++s) {
      const bool forbidden = m_.pomdp().allowed().size() > 0 && !m_.pomdp().allowed()(action, s);
      y(s, i) = forbidden ? FORBIDDEN : std::max(FORBIDDEN, y(s, i) + m_.pomdp().R()(action, s));
    }
  }
}

/// Stabilised biconjugate gradients (van der Vorst 1992) on x - gamma P x = c.
bool Controller::solveByKrylov(const std::vector<const double*>& known, Table& x,
                               double& work) const {
  const auto dot = [](const Table& a, const Table& b) { return a.cwiseProduct(b).sum(); };
  const auto apply = [&](const Table& from, Table& to) {
    step(from, nullptr, to);
    to = from - to;
    work += stepWork();
  };
  Table r = x;
  step(x, &known, r);
  r -= x;
  const Table shadow = r;
  Table p = r;
  Table v = r;
  Table t = r;
  double rho = dot(shadow, r);
  for (int i = 0; i < MAX_STEPS; ++i) {
    if (r.cwiseAbs().maxCoeff() <= EXACT * (1.0 + x.cwiseAbs().maxCoeff())) return true;
    apply(p, v);
    const double alpha = rho / dot(shadow, v);
    r -= alpha * v;
    apply(r, t);
    const double omega = dot(t, r) / dot(t, t);
    x += alpha * p + omega * r;
    r -= omega * t;
    const double next_rho = dot(shadow, r);
    const double beta = next_rho / rho * alpha / omega;
    if (!std::isfinite(beta)) return r.cwiseAbs().maxCoeff() == 0.0;
    p = r + beta * (p - omega * v);
    rho = next_rho;
  }
  return true;
}

/// Every step keeps each vector below the optimal value: acting once and then going on with what
/// is worth at least x is worth at least that.
void Controller::sweep(const std::vector<const double*>& known, Table& x, double& work) const {
  Table y = x;
  for (int i = 0; i < MAX_SWEEPS; ++i) {
    step(x, &known, y);
    work += stepWork();
    const double change = ((y - x).array().abs() / (1.0 + y.array().abs())).maxCoeff();
    x.swap(y);
    if (change <= 1e-9) break;
  }
}

Eigen::MatrixXd Controller::evaluate(const std::vector<const double*>& known, Eigen::MatrixXd start,
                                     double& work) const {
  const bool plain = m_.discount() < 1.0 && m_.pomdp().allowed().size() == 0;
  if (plain) {
    Table x = start;
    if (solveByKrylov(known, x, work) && x.allFinite()) {
      Table stepped = x;
      step(x, &known, stepped);
      // Where x exceeds its own step, it may exceed the true value by that much for ever.
      const double too_much = std::max(0.0, (x - stepped).maxCoeff()) / (1.0 - m_.discount());
      if (too_much <= GOOD_ENOUGH * (1.0 + x.cwiseAbs().maxCoeff())) {
        x.array() -= too_much;
        return x;
      }
    }
  }
  sweep(known, start, work);
  return start;
}

}  // namespace fabric::planner
