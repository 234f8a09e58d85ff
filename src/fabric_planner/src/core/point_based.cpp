// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"

namespace fabric::planner {
namespace {

constexpr double NEGLIGIBLE = 1e-9;     // probability of an observation that is not followed
constexpr double CLOSE_BELIEFS = 1e-3;  // L1 distance below which two beliefs count as one

/// (S, O): P(s', o | b, a); each column is a successor belief times its probability.
Eigen::MatrixXd successors(const Pomdp& m, const Eigen::VectorXd& belief, int action) {
  const Eigen::VectorXd predicted = m.T(action).transpose() * belief;
  return predicted.asDiagonal() * m.O(action);
}

/// The farthest successor of a belief from those already chosen, and how far it is.
std::pair<Eigen::VectorXd, double> farthestSuccessor(const Pomdp& m, const Eigen::VectorXd& belief,
                                                     const Eigen::MatrixXd& chosen) {
  std::pair<Eigen::VectorXd, double> farthest{belief, 0.0};
  for (int a = 0; a < m.numActions(); ++a) {
    const Eigen::MatrixXd next = successors(m, belief, a);
    for (Eigen::Index o = 0; o < next.cols(); ++o) {
      const double probability = next.col(o).sum();
      if (probability < NEGLIGIBLE) continue;
      const Eigen::VectorXd candidate = next.col(o) / probability;
      const double distance = (chosen.colwise() - candidate).cwiseAbs().colwise().sum().minCoeff();
      if (distance > farthest.second) farthest = {candidate, distance};
    }
  }
  return farthest;
}

/// A controller whose node i acts, sees o and goes to node next(i, o); values are its vectors.
struct Controller {
  Eigen::MatrixXd values;    ///< (S, N), one column a node
  std::vector<int> actions;  ///< (N,)
  Eigen::MatrixXi next;      ///< (N, O)

  explicit Controller(const Pomdp& m, Eigen::Index nodes)
      : values(m.numStates(), nodes),
        actions(static_cast<size_t>(nodes)),
        next(nodes, m.numObservations()) {}
};

/// For each observation the column of `values` that is best at the successor belief.
Eigen::RowVectorXi bestColumns(const Eigen::MatrixXd& values, const Eigen::MatrixXd& beliefs) {
  const Eigen::MatrixXd scores = values.transpose() * beliefs;
  Eigen::RowVectorXi best(scores.cols());
  for (Eigen::Index o = 0; o < scores.cols(); ++o) scores.col(o).maxCoeff(&best(o));
  return best;
}

/// alpha = R_a + gamma T_a sum_o O(., o) * values(., next(o)).
Eigen::VectorXd backUp(const Pomdp& m, int action, const Eigen::RowVectorXi& next,
                       const Eigen::MatrixXd& values) {
  Eigen::VectorXd future = Eigen::VectorXd::Zero(m.numStates());
  for (Eigen::Index o = 0; o < next.size(); ++o) {
    future += m.O(action).col(o).cwiseProduct(values.col(next(o)));
  }
  return m.R().row(action).transpose() + m.discount() * (m.T(action) * future);
}

class PolicyIteration {
 public:
  PolicyIteration(const Pomdp& model, const PointBasedOptions& options)
      : m_(model), options_(options), beliefs_(reachableBeliefs(model, options.beliefs)) {
    const auto blind = blindBound(model);
    values_ = blind.vectors.transpose();
    actions_ = blind.actions;
  }

  AlphaVectors run() {
    Eigen::VectorXd before = valuesAtBeliefs();
    double work = 0.0;
    for (int sweep = 0; sweep < options_.sweeps && work < options_.work; ++sweep) {
      work += sweepWork();
      Controller controller = improved();
      evaluate(controller);
      merge(controller);
      const Eigen::VectorXd after = valuesAtBeliefs();
      if ((after - before).maxCoeff() < options_.tolerance) break;
      before = after;
    }
    return {values_.transpose(), actions_};
  }

 private:
  [[nodiscard]] double sweepWork() const {
    const double s = m_.numStates();
    const double n = static_cast<double>(beliefs_.cols());
    const double backups = n * m_.numActions() *
                           (s * s + s * m_.numObservations() * static_cast<double>(values_.cols()));
    return backups + n * options_.evaluations * (s * s + s * m_.numObservations());
  }

  [[nodiscard]] Eigen::VectorXd valuesAtBeliefs() const {
    return (values_.transpose() * beliefs_).colwise().maxCoeff().transpose();
  }

  /// One backup at every belief, successors taken from the present vectors.
  [[nodiscard]] Controller improved() const {
    Controller controller(m_, beliefs_.cols());
    for (Eigen::Index i = 0; i < beliefs_.cols(); ++i) {
      double best = -std::numeric_limits<double>::infinity();
      for (int a = 0; a < m_.numActions(); ++a) {
        const auto next = bestColumns(values_, successors(m_, beliefs_.col(i), a));
        const Eigen::VectorXd alpha = backUp(m_, a, next, values_);
        const double value = alpha.dot(beliefs_.col(i));
        if (value <= best) continue;
        best = value;
        controller.values.col(i) = alpha;
        controller.actions[static_cast<size_t>(i)] = a;
      }
    }
    return controller;
  }

  /// Lets the nodes follow one another. Every step keeps each vector below the optimal value,
  /// because acting once and then going on with what is worth at least v is worth at least that.
  void evaluate(Controller& controller) const {
    for (Eigen::Index i = 0; i < beliefs_.cols(); ++i) {
      const int a = controller.actions[static_cast<size_t>(i)];
      controller.next.row(i) = bestColumns(controller.values, successors(m_, beliefs_.col(i), a));
    }
    for (int step = 0; step < options_.evaluations; ++step) {
      Eigen::MatrixXd stepped(controller.values.rows(), controller.values.cols());
      for (Eigen::Index i = 0; i < beliefs_.cols(); ++i) {
        stepped.col(i) = backUp(m_, controller.actions[static_cast<size_t>(i)],
                                controller.next.row(i), controller.values);
      }
      controller.values.swap(stepped);
    }
  }

  /// Keeps, of the old vectors and the new, those that are best at one of the beliefs.
  void merge(const Controller& controller) {
    Eigen::MatrixXd all(values_.rows(), values_.cols() + controller.values.cols());
    all << controller.values, values_;
    auto actions = controller.actions;
    actions.insert(actions.end(), actions_.begin(), actions_.end());
    const auto best = bestColumns(all, beliefs_);
    std::vector<int> kept(best.data(), best.data() + best.size());
    std::sort(kept.begin(), kept.end());
    kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    values_.resize(all.rows(), static_cast<Eigen::Index>(kept.size()));
    actions_.clear();
    for (int column : kept) {
      values_.col(static_cast<Eigen::Index>(actions_.size())) = all.col(column);
      actions_.push_back(actions[static_cast<size_t>(column)]);
    }
  }

  const Pomdp& m_;
  const PointBasedOptions& options_;
  Eigen::MatrixXd beliefs_;
  Eigen::MatrixXd values_;
  std::vector<int> actions_;
};

}  // namespace

Eigen::MatrixXd reachableBeliefs(const Pomdp& model, int count) {
  Eigen::MatrixXd beliefs = model.initialBelief();
  bool grew = true;
  while (grew && beliefs.cols() < count) {
    grew = false;
    const Eigen::Index known = beliefs.cols();
    for (Eigen::Index i = 0; i < known && beliefs.cols() < count; ++i) {
      const auto [belief, distance] = farthestSuccessor(model, beliefs.col(i), beliefs);
      if (distance < CLOSE_BELIEFS) continue;
      beliefs.conservativeResize(Eigen::NoChange, beliefs.cols() + 1);
      beliefs.rightCols(1) = belief;
      grew = true;
    }
  }
  return beliefs;
}

AlphaVectors pointBasedBound(const Pomdp& model, const PointBasedOptions& options) {
  if (model.discount() >= 1.0) {
    throw ModelError(model.name() + ": the point-based bound needs a discount below 1");
  }
  if (model.fullyObservable()) return qmdp(model);
  return PolicyIteration(model, options).run();
}

}  // namespace fabric::planner
