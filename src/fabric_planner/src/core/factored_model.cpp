// SPDX-License-Identifier: BSD-3-Clause
#include "factored_model.hpp"

#include <algorithm>

#include "text.hpp"

namespace fabric::planner {
namespace {

/// The product of some variables: a joint index stands for one value of each.
class Product {
 public:
  Product(std::vector<Variable> variables, const FileLimits& limits)
      : variables_(std::move(variables)) {
    double size = 1.0;
    for (const auto& variable : variables_) size *= variable.domain->size();
    if (size > static_cast<double>(limits.values)) {
      throw ModelError(text(size) + " combinations of values are too many (at most " +
                       std::to_string(limits.values) + ")");
    }
    size_ = static_cast<int>(size);
  }

  [[nodiscard]] int size() const { return size_; }

  [[nodiscard]] std::vector<int> values(int joint) const {
    std::vector<int> digits(variables_.size());
    for (size_t i = variables_.size(); i-- > 0;) {
      const int radix = variables_[i].domain->size();
      digits[i] = joint % radix;
      joint /= radix;
    }
    return digits;
  }

  [[nodiscard]] int joint(const std::vector<int>& digits) const {
    int index = 0;
    for (size_t i = 0; i < variables_.size(); ++i) {
      index = index * variables_[i].domain->size() + digits[i];
    }
    return index;
  }

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (int joint = 0; joint < size(); ++joint) {
      std::vector<std::string> parts;
      const auto digits = values(joint);
      for (size_t i = 0; i < digits.size(); ++i) {
        parts.push_back(variables_[i].domain->names()[static_cast<size_t>(digits[i])]);
      }
      all.push_back(join(parts, "/"));
    }
    return all;
  }

 private:
  std::vector<Variable> variables_;
  int size_ = 1;
};

std::vector<int>& of(Assignment& assignment, Role role) {
  return assignment[static_cast<size_t>(role)];
}

using Factors = std::vector<const Factor*>;

/// True when one of a factor's parents is a child of the other.
bool needs(const Factor& factor, const Factor& other) {
  const auto& axes = factor.axes();
  const auto& others = other.axes();
  for (size_t i = 0; i < factor.numParents(); ++i) {
    for (size_t j = other.numParents(); j < others.size(); ++j) {
      if (axes[i].name == others[j].name) return true;
    }
  }
  return false;
}

/// The factors in an order in which each comes after those it needs.
Factors ordered(const std::vector<Factor>& factors) {
  Factors waiting;
  for (const auto& factor : factors) waiting.push_back(&factor);
  Factors done;
  while (!waiting.empty()) {
    const auto ready = std::find_if(waiting.begin(), waiting.end(), [&](const Factor* one) {
      return std::none_of(waiting.begin(), waiting.end(),
                          [&](const Factor* other) { return needs(*one, *other); });
    });
    if (ready == waiting.end()) {
      throw ModelError("the variable '" + waiting[0]->axes().back().name +
                       "' depends on itself by way of its parents");
    }
    done.push_back(*ready);
    waiting.erase(ready);
  }
  return done;
}

/// Calls visit(p) for each joint value of the factors' children with p > 0, filled into now.
template <typename Visit>
void forEachJoint(const Factors& factors, Assignment& now, double p, size_t depth,
                  const Visit& visit) {
  if (depth == factors.size()) return visit(p);
  factors[depth]->forEachChild(
      now, [&](double q) { forEachJoint(factors, now, p * q, depth + 1, visit); });
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
  Flattener(const FactoredModel& model, const FileLimits& limits)
      : model_(model),
        limits_(limits),
        actions_(model.actions, limits),
        states_(model.states, limits),
        observations_(observedVariables(model), limits),
        transition_(ordered(model.transition)),
        observation_(ordered(model.observation)) {
    const double width = std::max(states_.size(), observations_.size());
    if (actions_.size() * width > static_cast<double>(limits.entries)) refuse();
    of(now_, Role::PREVIOUS).resize(model.states.size());
    of(now_, Role::CURRENT).resize(model.states.size());
    of(now_, Role::OBSERVATION).resize(observedVariables(model).size());
  }

  SparseTables run() {
    SparseTables tables;
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
      const SparseRows O = observation();
      tables.R.row(a) = reward(tables.T.back(), O);
      tables.O.emplace_back(O);
    }
    return tables;
  }

 private:
  using Row = std::vector<std::pair<int, double>>;

  [[noreturn]] void refuse() const {
    throw ModelError("tables of " + std::to_string(states_.size()) + " states, " +
                     std::to_string(actions_.size()) + " actions and " +
                     std::to_string(observations_.size()) + " observations are too large");
  }

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
    Eigen::VectorXd belief = Eigen::VectorXd::Zero(states_.size());
    forEachJoint(ordered(model_.initial), now_, 1.0, 0,
                 [&](double p) { belief(states_.joint(of(now_, Role::PREVIOUS))) = p; });
    return belief;
  }

  SparseRows transition() {
    SparseRows table(states_.size(), states_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::PREVIOUS) = states_.values(s);
      appendRow(table, s, transition_, states_, Role::CURRENT);
    }
    table.finalize();
    return table;
  }

  SparseRows observation() {
    SparseRows table(states_.size(), observations_.size());
    for (int s = 0; s < states_.size(); ++s) {
      const auto values = states_.values(s);
      of(now_, Role::CURRENT) = values;
      size_t next = model_.observations.size();
      for (size_t i = 0; i < values.size(); ++i) {
        if (model_.states[i].fully_observed) of(now_, Role::OBSERVATION)[next++] = values[i];
      }
      appendRow(table, s, observation_, observations_, Role::OBSERVATION);
    }
    table.finalize();
    return table;
  }

  void appendRow(SparseRows& table, int s, const Factors& factors, const Product& columns,
                 Role role) {
    row_.clear();
    forEachJoint(factors, now_, 1.0, 0,
                 [&](double p) { row_.emplace_back(columns.joint(of(now_, role)), p); });
    entries_ += row_.size() + 1;
    if (entries_ > limits_.entries) refuse();
    std::sort(row_.begin(), row_.end());
    table.startVec(s);
    for (const auto& [column, p] : row_) table.insertBack(s, column) = p;
  }

  /// R(a, s) = sum_s' T(s, s') sum_o O(s', o) R(a, s, s', o).
  Eigen::RowVectorXd reward(const SparseRows& T, const SparseRows& O) {
    const bool by_next = anyDependsOn(model_.reward, Role::CURRENT);
    const bool by_observation = anyDependsOn(model_.reward, Role::OBSERVATION);
    Eigen::RowVectorXd expected = Eigen::RowVectorXd::Zero(states_.size());
    for (int s = 0; s < states_.size(); ++s) {
      of(now_, Role::PREVIOUS) = states_.values(s);
      if (!by_next && !by_observation) {
        expected(s) = sumOf(model_.reward, now_);
        continue;
      }
      for (SparseRows::InnerIterator next(T, s); next; ++next) {
        const int reached = static_cast<int>(next.col());
        of(now_, Role::CURRENT) = states_.values(reached);
        expected(s) += next.value() *
                       (by_observation ? overObservations(O, reached) : sumOf(model_.reward, now_));
      }
    }
    return expected;
  }

  double overObservations(const SparseRows& O, int reached) {
    double expected = 0.0;
    for (SparseRows::InnerIterator seen(O, reached); seen; ++seen) {
      of(now_, Role::OBSERVATION) = observations_.values(static_cast<int>(seen.col()));
      expected += seen.value() * sumOf(model_.reward, now_);
    }
    return expected;
  }

  const FactoredModel& model_;
  const FileLimits& limits_;
  Product actions_;
  Product states_;
  Product observations_;
  Factors transition_;
  Factors observation_;
  Assignment now_;
  Row row_;
  size_t entries_ = 0;
};

}  // namespace

SparseTables flatten(const FactoredModel& model, const FileLimits& limits) {
  return Flattener(model, limits).run();
}

}  // namespace fabric::planner
