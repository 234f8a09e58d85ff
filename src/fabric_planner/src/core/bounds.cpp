// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/bounds.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "fabric_planner/mdp.hpp"

namespace fabric::planner {
namespace {

constexpr int SMALL_ENOUGH_FOR_LU = 200;
constexpr int MAX_SWEEPS = 20000;
constexpr int MAX_POLICIES = 100;
constexpr double MAX_WORK = 4e9;  // multiplications

std::vector<int> oneEach(int actions) {
  std::vector<int> all(static_cast<size_t>(actions));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

double dotRow(const SparseRows& T, Eigen::Index s, const Eigen::VectorXd& V) {
  double sum = 0.0;
  for (SparseRows::InnerIterator it(T, s); it; ++it) sum += it.value() * V(it.col());
  return sum;
}

// --- fast informed bound
// --------------------------------------------------------------------------

/// Q(a', .) is summed up for each observation; the largest sum tells the action that is best.
class InformedBackup {
 public:
  explicit InformedBackup(const Pomdp& m)
      : m_(m),
        sums_(m.numActions(), m.numObservations()),
        touched_(Eigen::ArrayXi::Zero(m.numObservations())) {
    for (int a = 0; a < m.numActions(); ++a) O_.emplace_back(m.O(a));
  }

  /// Q: (A, S). choice: (O,) the best action after each observation, where asked for.
  double operator()(const Eigen::MatrixXd& Q, int action, Eigen::Index s, int* choice = nullptr) {
    seen_.clear();
    for (SparseRows::InnerIterator t(m_.T(action), s); t; ++t) {
      for (SparseRows::InnerIterator o(O_[static_cast<size_t>(action)], t.col()); o; ++o) {
        add(o.col(), t.value() * o.value(), Q.col(t.col()));
      }
    }
    double future = 0.0;
    for (const Eigen::Index o : seen_) {
      Eigen::Index best = 0;
      future += sums_.col(o).maxCoeff(&best);
      if (choice != nullptr) choice[o] = static_cast<int>(best);
      touched_(o) = 0;
    }
    return m_.R()(action, s) + m_.discount() * future;
  }

  [[nodiscard]] const SparseRows& O(int action) const { return O_[static_cast<size_t>(action)]; }

 private:
  template <typename Column>
  void add(Eigen::Index o, double chance, const Column& values) {
    if (touched_(o) == 0) {
      sums_.col(o).setZero();
      touched_(o) = 1;
      seen_.push_back(o);
    }
    sums_.col(o) += chance * values;
  }

  const Pomdp& m_;
  std::vector<SparseRows> O_;
  Eigen::MatrixXd sums_;  ///< (A, O)
  Eigen::ArrayXi touched_;
  std::vector<Eigen::Index> seen_;
};

/// The informed problem is an MDP over (a, s) whose choices are an action for each observation.
class InformedPolicies {
 public:
  explicit InformedPolicies(const Pomdp& m)
      : m_(m), backup_(m), choices_(m.numObservations(), m.numActions() * m.numStates()) {
    choices_.setZero();
  }

  /// Policy iteration from the choices that are best at Q; returns what is never below the answer.
  Eigen::MatrixXd solve(Eigen::MatrixXd Q) {
    choose(Q);
    for (int i = 0; i < MAX_POLICIES; ++i) {
      Q = evaluate();
      if (choose(Q) <= 1e-12 * (1.0 + Q.cwiseAbs().maxCoeff())) break;
    }
    return (Q.array() + std::max(0.0, choose(Q)) / (1.0 - m_.discount())).matrix();
  }

 private:
  /// @return the most that choosing again raises an entry.
  double choose(const Eigen::MatrixXd& Q) {
    double gain = 0.0;
    for (int s = 0; s < m_.numStates(); ++s) {
      for (int a = 0; a < m_.numActions(); ++a) {
        const double value = backup_(Q, a, s, choices_.col(s * m_.numActions() + a).data());
        gain = std::max(gain, value - Q(a, s));
      }
    }
    return gain;
  }

  Eigen::MatrixXd evaluate() {
    const int A = m_.numActions();
    const Eigen::Index n = choices_.cols();
    Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
    for (int s = 0; s < m_.numStates(); ++s) {
      for (int a = 0; a < A; ++a) {
        for (SparseRows::InnerIterator t(m_.T(a), s); t; ++t) {
          for (SparseRows::InnerIterator o(backup_.O(a), t.col()); o; ++o) {
            system(s * A + a, t.col() * A + choices_(o.col(), s * A + a)) -=
                m_.discount() * t.value() * o.value();
          }
        }
      }
    }
    const Eigen::VectorXd Q = system.partialPivLu().solve(m_.R().reshaped());
    return Q.reshaped(A, m_.numStates());
  }

  const Pomdp& m_;
  InformedBackup backup_;
  Eigen::MatrixXi choices_;  ///< (O, S * A)
};

void sweepDown(const Pomdp& m, double tolerance, Eigen::MatrixXd& Q) {
  InformedBackup backup(m);
  double sweep_work = 0.0;
  for (int a = 0; a < m.numActions(); ++a) {
    sweep_work += static_cast<double>(m.T(a).nonZeros()) * static_cast<double>(m.O(a).nonZeros()) /
                  m.numStates() * m.numActions();
  }
  const double enough = m.discount() < 1.0 ? tolerance * (1.0 - m.discount()) : 0.0;
  double work = 0.0;
  for (int i = 0; i < MAX_SWEEPS && (i == 0 || work + sweep_work < MAX_WORK); ++i) {
    double change = 0.0;
    for (Eigen::Index s = Q.cols(); s-- > 0;) {
      for (int a = 0; a < m.numActions(); ++a) {
        const double value = backup(Q, a, s);
        change = std::max(change, Q(a, s) - value);
        Q(a, s) = std::min(Q(a, s), value);
      }
    }
    work += sweep_work;
    if (change <= enough) break;
  }
}

// --- blind bound
// ----------------------------------------------------------------------------------

/// The rewards of one action, FORBIDDEN where it may not be taken.
Eigen::VectorXd rewardOf(const Pomdp& m, int action) {
  Eigen::VectorXd reward = m.R().row(action).transpose();
  if (m.allowed().size() == 0) return reward;
  for (Eigen::Index s = 0; s < reward.size(); ++s) {
    if (!m.allowed()(action, s)) reward(s) = FORBIDDEN;
  }
  return reward;
}

/// The same action for ever, from below: V = reward + gamma T V iterated upwards from
/// the least reward for ever, each state for itself so that FORBIDDEN stays where it belongs.
Eigen::VectorXd blindFromBelow(const Pomdp& m, int action, const Eigen::VectorXd& reward) {
  const double worst = reward.minCoeff() / (1.0 - m.discount());
  Eigen::VectorXd V = Eigen::VectorXd::Constant(m.numStates(), worst);
  for (int i = 0; i < MAX_SWEEPS; ++i) {
    double change = 0.0;
    for (Eigen::Index s = V.size(); s-- > 0;) {
      const double value = reward(s) + m.discount() * dotRow(m.T(action), s, V);
      change = std::max(change, (value - V(s)) / (1.0 + std::abs(value)));
      V(s) = std::max(V(s), value);
    }
    if (change < 1e-13) break;
  }
  return V.cwiseMax(FORBIDDEN);
}

/// The same by LU, lowered by what rounding may have added.
Eigen::VectorXd blindByLu(const Pomdp& m, int action, const Eigen::VectorXd& reward) {
  const int n = m.numStates();
  const Eigen::MatrixXd system =
      Eigen::MatrixXd::Identity(n, n) - m.discount() * m.T(action).toDense();
  const Eigen::VectorXd V = system.partialPivLu().solve(reward);
  const Eigen::VectorXd stepped = reward + m.discount() * (m.T(action) * V);
  const double too_much = std::max(0.0, (V - stepped).maxCoeff());
  return (V.array() - too_much / (1.0 - m.discount())).matrix();
}

/// Discount 1: reward and number of steps until nothing moves any more, when that comes.
std::optional<Eigen::VectorXd> blindUntilTheEnd(const Pomdp& m, int action,
                                                const Eigen::VectorXd& reward) {
  const SparseRows& T = m.T(action);
  Eigen::VectorXd V = Eigen::VectorXd::Zero(m.numStates());
  Eigen::VectorXd steps = V;
  double residual = 1.0;
  double late = 1.0;
  for (int i = 0; i < MAX_SWEEPS && (late >= 0.5 || residual > 1e-13); ++i) {
    residual = late = 0.0;
    for (Eigen::Index s = V.size(); s-- > 0;) {
      if (T.coeff(s, s) >= 1.0 && reward(s) == 0.0) continue;
      const double value = reward(s) + dotRow(T, s, V);
      const double count = 1.0 + dotRow(T, s, steps);
      residual = std::max(residual, std::abs(value - V(s)) / (1.0 + std::abs(value)));
      late = std::max(late, count - steps(s));
      V(s) = value;
      steps(s) = count;
    }
  }
  if (late >= 0.5 || residual > 1e-13) return std::nullopt;
  // steps / (1 - late) is at least the true number, so that much too much is in V at most.
  const double too_much = (V - reward - T * V).cwiseMax(0.0).maxCoeff();
  return (V - too_much / (1.0 - late) * steps).cwiseMax(FORBIDDEN);
}

std::optional<Eigen::VectorXd> blindValue(const Pomdp& m, int action) {
  const Eigen::VectorXd reward = rewardOf(m, action);
  if (m.discount() >= 1.0) return blindUntilTheEnd(m, action, reward);
  const bool easy = m.allowed().size() == 0 && m.numStates() <= SMALL_ENOUGH_FOR_LU;
  return easy ? blindByLu(m, action, reward) : blindFromBelow(m, action, reward);
}

/// An action followed by the least reward that any allowed one gives, for ever.
Eigen::VectorXd onceThenWorst(const Pomdp& m, int action) {
  double worst = std::numeric_limits<double>::infinity();
  for (int a = 0; a < m.numActions(); ++a) {
    for (int s = 0; s < m.numStates(); ++s) {
      if (m.allowed()(a, s)) worst = std::min(worst, m.R()(a, s));
    }
  }
  const double later = m.discount() * worst / (1.0 - m.discount());
  return (rewardOf(m, action).array() + later).cwiseMax(FORBIDDEN).matrix();
}

void append(const Eigen::VectorXd& vector, int action, AlphaVectors& bound) {
  bound.vectors.conservativeResize(bound.vectors.rows() + 1, vector.size());
  bound.vectors.bottomRows(1) = vector.transpose();
  bound.actions.push_back(action);
}

}  // namespace

int AlphaVectors::best(const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  int row = 0;
  (vectors * belief).maxCoeff(&row);
  return row;
}

double AlphaVectors::value(const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  return (vectors * belief).maxCoeff();
}

AlphaVectors qmdp(const Pomdp& model) {
  MdpSolution solution = solveMdp(model);
  if (model.allowed().size() > 0) {
    for (Eigen::Index s = 0; s < solution.q.cols(); ++s) {
      solution.q.col(s) =
          model.allowed().col(s).select(solution.q.col(s).array(), solution.value(s));
    }
  }
  return {std::move(solution.q), oneEach(model.numActions())};
}

AlphaVectors fastInformedBound(const Pomdp& model, double tolerance) {
  AlphaVectors bound = qmdp(model);
  const bool plain = model.discount() < 1.0 && model.allowed().size() == 0;
  if (plain && bound.vectors.size() <= SMALL_ENOUGH_FOR_LU) {
    bound.vectors = InformedPolicies(model).solve(bound.vectors).cwiseMin(bound.vectors);
    return bound;
  }
  sweepDown(model, tolerance, bound.vectors);
  return bound;
}

AlphaVectors blindBound(const Pomdp& model) {
  AlphaVectors bound;
  bound.vectors.resize(0, model.numStates());
  for (int a = 0; a < model.numActions(); ++a) {
    const auto vector = blindValue(model, a);
    if (vector) append(*vector, a, bound);
  }
  if (bound.actions.empty()) {
    throw ModelError(model.name() +
                     ": a lower bound needs a discount below 1, or an action that ends everything "
                     "when it is repeated");
  }
  if (model.allowed().size() == 0 || model.discount() >= 1.0) return bound;
  for (int a = 0; a < model.numActions(); ++a) append(onceThenWorst(model, a), a, bound);
  return bound;
}

}  // namespace fabric::planner
