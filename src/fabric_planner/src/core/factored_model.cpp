// SPDX-License-Identifier: BSD-3-Clause
#include "factored_model.hpp"

#include <algorithm>

#include "text.hpp"

namespace fabric::planner {
namespace {

constexpr double MAX_ENTRIES = 1 << 26;  // half a gigabyte of doubles

/// The product of some variables: a joint index stands for one value of each.
class Product {
 public:
  explicit Product(std::vector<Variable> variables) : variables_(std::move(variables)) {
    for (const auto& variable : variables_) size_ *= static_cast<double>(variable.values.size());
    if (size_ > MAX_ENTRIES) throw ModelError("too many combinations of values");
  }

  [[nodiscard]] int size() const { return static_cast<int>(size_); }

  [[nodiscard]] std::vector<int> values(int joint) const {
    std::vector<int> digits(variables_.size());
    for (size_t i = variables_.size(); i-- > 0;) {
      const int radix = static_cast<int>(variables_[i].values.size());
      digits[i] = joint % radix;
      joint /= radix;
    }
    return digits;
  }

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (int joint = 0; joint < size(); ++joint) {
      std::vector<std::string> parts;
      const auto digits = values(joint);
      for (size_t i = 0; i < digits.size(); ++i) {
        parts.push_back(variables_[i].values[static_cast<size_t>(digits[i])]);
      }
      all.push_back(join(parts, "/"));
    }
    return all;
  }

 private:
  std::vector<Variable> variables_;
  double size_ = 1.0;
};

std::vector<int>& of(Assignment& assignment, Role role) {
  return assignment[static_cast<size_t>(role)];
}

double productOf(const std::vector<Factor>& factors, const Assignment& assignment) {
  double product = 1.0;
  for (const auto& factor : factors) {
    product *= factor.at(assignment);
    if (product == 0.0) break;
  }
  return product;
}

double sumOf(const std::vector<Factor>& factors, const Assignment& assignment) {
  double sum = 0.0;
  for (const auto& factor : factors) sum += factor.at(assignment);
  return sum;
}

bool anyDependsOn(const std::vector<Factor>& factors, Role role) {
  return std::any_of(factors.begin(), factors.end(),
                     [role](const Factor& factor) { return factor.dependsOn(role); });
}

class Flattener {
 public:
  explicit Flattener(const FactoredModel& model)
      : model_(model),
        actions_(model.actions),
        states_(model.states),
        observations_(observedVariables(model)) {
    const double s = states_.size();
    if (actions_.size() * s * std::max<double>(s, observations_.size()) > MAX_ENTRIES) {
      throw ModelError("tables of " + std::to_string(states_.size()) + " states, " +
                       std::to_string(actions_.size()) + " actions and " +
                       std::to_string(observations_.size()) + " observations are too large");
    }
  }

  PomdpTables run() {
    PomdpTables tables;
    tables.name = model_.name;
    tables.discount = model_.discount;
    tables.actions = actions_.names();
    tables.states = states_.names();
    tables.observations = observations_.names();
    tables.initial_belief = initialBelief();
    tables.R = Eigen::MatrixXd::Zero(actions_.size(), states_.size());
    for (int a = 0; a < actions_.size(); ++a) {
      of(now_, Role::ACTION) = actions_.values(a);
      tables.T.push_back(transition());
      tables.O.push_back(observation());
      tables.R.row(a) = reward(tables.T.back(), tables.O.back());
    }
    return tables;
  }

 private:
  /// The observation variables, then the state variables that are seen directly.
  static std::vector<Variable> observedVariables(const FactoredModel& model) {
    auto observed = model.observations;
    std::copy_if(model.states.begin(), model.states.end(), std::back_inserter(observed),
                 [](const Variable& state) { return state.fully_observed; });
    if (observed.empty()) {
      throw ModelError("Variable: no ObsVar, and no StateVar with fullyObs=\"true\"");
    }
    return observed;
  }

  Eigen::VectorXd initialBelief() {
    Eigen::VectorXd belief(states_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::PREVIOUS) = states_.values(s);
      belief(s) = productOf(model_.initial, now_);
    }
    return belief;
  }

  Eigen::MatrixXd transition() {
    Eigen::MatrixXd table(states_.size(), states_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::PREVIOUS) = states_.values(s);
      for (int next = 0; next < states_.size(); ++next) {
        of(now_, Role::CURRENT) = states_.values(next);
        table(s, next) = productOf(model_.transition, now_);
      }
    }
    return table;
  }

  Eigen::MatrixXd observation() {
    Eigen::MatrixXd table(states_.size(), observations_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::CURRENT) = states_.values(s);
      for (int o = 0; o < observations_.size(); ++o) {
        of(now_, Role::OBSERVATION) = observations_.values(o);
        table(s, o) = showsState() ? productOf(model_.observation, now_) : 0.0;
      }
    }
    return table;
  }

  /// True when the directly seen part of the observation agrees with the state reached.
  bool showsState() {
    const auto& seen = of(now_, Role::OBSERVATION);
    const auto& state = of(now_, Role::CURRENT);
    size_t next = model_.observations.size();
    for (size_t i = 0; i < model_.states.size(); ++i) {
      if (model_.states[i].fully_observed && seen[next++] != state[i]) return false;
    }
    return true;
  }

  /// R(a, s) = sum_s' T(s, s') sum_o O(s', o) R(a, s, s', o).
  Eigen::RowVectorXd reward(const Eigen::MatrixXd& T, const Eigen::MatrixXd& O) {
    const bool by_next = anyDependsOn(model_.reward, Role::CURRENT);
    const bool by_observation = anyDependsOn(model_.reward, Role::OBSERVATION);
    Eigen::RowVectorXd expected = Eigen::RowVectorXd::Zero(states_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::PREVIOUS) = states_.values(s);
      if (!by_next && !by_observation) {
        expected(s) = sumOf(model_.reward, now_);
        continue;
      }
      for (int next = 0; next < states_.size(); ++next) {
        if (T(s, next) == 0.0) continue;
        of(now_, Role::CURRENT) = states_.values(next);
        expected(s) += T(s, next) * (by_observation ? overObservations(O.row(next))
                                                    : sumOf(model_.reward, now_));
      }
    }
    return expected;
  }

  double overObservations(const Eigen::RowVectorXd& probabilities) {
    double expected = 0.0;
    for (int o = 0; o < observations_.size(); ++o) {
      if (probabilities(o) == 0.0) continue;
      of(now_, Role::OBSERVATION) = observations_.values(o);
      expected += probabilities(o) * sumOf(model_.reward, now_);
    }
    return expected;
  }

  const FactoredModel& model_;
  Product actions_;
  Product states_;
  Product observations_;
  Assignment now_;
};

}  // namespace

PomdpTables flatten(const FactoredModel& model) { return Flattener(model).run(); }

}  // namespace fabric::planner
