// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/pomdp.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_set>

#include "text.hpp"

namespace fabric::planner {
namespace {

constexpr double ROW_TOLERANCE = 1e-6;
constexpr double EXACT_ENOUGH = 1e-12;

using Names = std::vector<std::string>;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw ModelError(where.empty() ? what : where + ": " + what);
}

void checkNames(const std::string& where, const std::string& kind, const Names& names) {
  if (names.empty()) refuse(where, "no " + kind);
  std::unordered_set<std::string> seen;
  for (const auto& name : names) {
    if (name.empty() || name.find_first_of(" \t\r\n") != std::string::npos) {
      refuse(where, kind + ": '" + name + "' is not a name (empty or with blanks)");
    }
    if (!seen.insert(name).second) refuse(where, kind + ": '" + name + "' is named twice");
  }
}

template <typename Table>
void checkShape(const std::string& where, const std::string& element, const Table& table,
                size_t rows, size_t cols) {
  if (static_cast<size_t>(table.rows()) == rows && static_cast<size_t>(table.cols()) == cols) {
    return;
  }
  std::ostringstream out;
  out << element << " is " << table.rows() << " x " << table.cols() << ", expected " << rows
      << " x " << cols;
  refuse(where, out.str());
}

void checkFinite(const std::string& where, const std::string& place, double value) {
  if (std::isnan(value)) refuse(where, place + " is NaN");
  if (std::isinf(value)) refuse(where, place + " is infinite");
}

/// Names the place of a number, e.g. "T[grasp] row NeedsHelp column Success".
template <typename Place>
void checkProbability(const std::string& where, double value, const Place& place) {
  if (!std::isfinite(value)) checkFinite(where, place(), value);
  if (value < 0.0 || value > 1.0 + ROW_TOLERANCE) {
    refuse(where, place() + " is " + text(value) + ", not a probability");
  }
}

/// What a row has to be divided by, 1 when it is near enough.
template <typename Place>
double checkedSum(const std::string& where, double sum, const Place& place) {
  if (std::abs(sum - 1.0) > ROW_TOLERANCE) {
    refuse(where, place() + " sums to " + text(sum) + ", not 1");
  }
  return std::abs(sum - 1.0) > EXACT_ENOUGH ? sum : 1.0;
}

/// The entries of a dense table that are not zero; NaN counts as such.
template <typename Sparse>
std::vector<Sparse> withoutZeros(const std::vector<Eigen::MatrixXd>& tables) {
  std::vector<Sparse> all;
  for (const auto& table : tables) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int s = 0; s < table.rows(); ++s) {
      for (int i = 0; i < table.cols(); ++i) {
        if (table(s, i) != 0.0) entries.emplace_back(s, i, table(s, i));
      }
    }
    all.emplace_back(table.rows(), table.cols());
    all.back().setFromTriplets(entries.begin(), entries.end());
  }
  return all;
}

/// Checks every row of a table; rescales those that need it.
template <typename Sparse>
void checkRows(const std::string& where, const std::string& element, const Names& rows,
               const Names& columns, Sparse& table) {
  checkShape(where, element, table, rows.size(), columns.size());
  table.makeCompressed();
  const auto row = [&](Eigen::Index s) { return element + " row " + rows[static_cast<size_t>(s)]; };
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(table.rows());
  for (Eigen::Index outer = 0; outer < table.outerSize(); ++outer) {
    for (typename Sparse::InnerIterator it(table, outer); it; ++it) {
      checkProbability(where, it.value(), [&] {
        return row(it.row()) + " column " + columns[static_cast<size_t>(it.col())];
      });
      sums(it.row()) += it.value();
    }
  }
  for (Eigen::Index s = 0; s < table.rows(); ++s) {
    sums(s) = checkedSum(where, sums(s), [&] { return row(s); });
  }
  for (Eigen::Index outer = 0; outer < table.outerSize(); ++outer) {
    for (typename Sparse::InnerIterator it(table, outer); it; ++it) {
      it.valueRef() /= sums(it.row());
    }
  }
  table.prune([](Eigen::Index, Eigen::Index, double value) { return value != 0.0; });
}

void checkAllowed(const PomdpFrame& m) {
  if (m.allowed.size() == 0) return;
  checkShape(m.name, "allowed", m.allowed, m.actions.size(), m.states.size());
  for (Eigen::Index s = 0; s < m.allowed.cols(); ++s) {
    if (m.allowed.col(s).any()) continue;
    refuse(m.name, "allowed: state " + m.states[static_cast<size_t>(s)] + " allows no action");
  }
}

void checkTables(SparseTables& m) {
  if (m.T.size() != m.actions.size() || m.O.size() != m.actions.size()) {
    refuse(m.name, "T and O need one table for each of the " + std::to_string(m.actions.size()) +
                       " actions, not " + std::to_string(m.T.size()) + " and " +
                       std::to_string(m.O.size()));
  }
  for (size_t a = 0; a < m.actions.size(); ++a) {
    checkRows(m.name, "T[" + m.actions[a] + "]", m.states, m.states, m.T[a]);
    checkRows(m.name, "O[" + m.actions[a] + "]", m.states, m.observations, m.O[a]);
  }
  checkShape(m.name, "R", m.R, m.actions.size(), m.states.size());
  for (size_t a = 0; a < m.actions.size(); ++a) {
    for (size_t s = 0; s < m.states.size(); ++s) {
      const double reward = m.R(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(s));
      if (std::isfinite(reward)) continue;
      checkFinite(m.name, "R[" + m.actions[a] + "] at " + m.states[s], reward);
    }
  }
  checkAllowed(m);
}

/// True when no observation symbol can come from two states.
bool tellsTheState(const SparseTables& m) {
  std::vector<Eigen::Index> source(m.observations.size(), -1);
  for (const auto& table : m.O) {
    for (Eigen::Index o = 0; o < table.cols(); ++o) {
      auto& known = source[static_cast<size_t>(o)];
      for (SparseColumns::InnerIterator it(table, o); it; ++it) {
        if (known >= 0 && known != it.row()) return false;
        known = it.row();
      }
    }
  }
  return true;
}

bool isTerminal(const SparseTables& m, Eigen::Index s) {
  for (size_t a = 0; a < m.actions.size(); ++a) {
    if (m.T[a].coeff(s, s) < 1.0 - EXACT_ENOUGH || m.R(static_cast<Eigen::Index>(a), s) != 0.0) {
      return false;
    }
  }
  return true;
}

SparseTables sparse(const PomdpTables& tables) {
  SparseTables result;
  static_cast<PomdpFrame&>(result) = tables;
  result.T = withoutZeros<SparseRows>(tables.T);
  result.O = withoutZeros<SparseColumns>(tables.O);
  return result;
}

int indexOf(const std::string& where, const std::string& kind, const Names& names,
            const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  refuse(where, "unknown " + kind + " '" + name + "' (known: " + join(names, ", ") + ")");
}

}  // namespace

Pomdp::Pomdp(const PomdpTables& tables) : Pomdp(sparse(tables)) {}

Pomdp::Pomdp(SparseTables tables) : tables_(std::move(tables)) {
  checkNames(tables_.name, "states", tables_.states);
  checkNames(tables_.name, "actions", tables_.actions);
  checkNames(tables_.name, "observations", tables_.observations);
  checkFinite(tables_.name, "discount", tables_.discount);
  if (tables_.discount <= 0.0 || tables_.discount > 1.0) {
    refuse(tables_.name, "discount is " + text(tables_.discount) + ", not in (0, 1]");
  }
  checkTables(tables_);
  tables_.initial_belief = checkedBelief(tables_.initial_belief);
  fully_observable_ = tellsTheState(tables_);
  for (Eigen::Index s = 0; s < numStates(); ++s) terminal_.push_back(isTerminal(tables_, s));
}

int Pomdp::stateIndex(const std::string& name) const {
  return indexOf(tables_.name, "state", tables_.states, name);
}

int Pomdp::actionIndex(const std::string& name) const {
  return indexOf(tables_.name, "action", tables_.actions, name);
}

int Pomdp::observationIndex(const std::string& name) const {
  return indexOf(tables_.name, "observation", tables_.observations, name);
}

void Pomdp::checkAction(int action) const {
  if (action >= 0 && action < numActions()) return;
  throw std::out_of_range("action " + std::to_string(action) + " is not in 0.." +
                          std::to_string(numActions() - 1));
}

void Pomdp::checkObservation(int observation) const {
  if (observation >= 0 && observation < numObservations()) return;
  throw std::out_of_range("observation " + std::to_string(observation) + " is not in 0.." +
                          std::to_string(numObservations() - 1));
}

Eigen::VectorXd Pomdp::checkedBelief(const Eigen::VectorXd& belief) const {
  if (belief.size() != numStates()) {
    refuse(tables_.name, "belief has " + std::to_string(belief.size()) + " entries for " +
                             std::to_string(numStates()) + " states");
  }
  for (Eigen::Index s = 0; s < belief.size(); ++s) {
    checkProbability(tables_.name, belief(s),
                     [&] { return "belief column " + tables_.states[static_cast<size_t>(s)]; });
  }
  return belief / checkedSum(tables_.name, belief.sum(), [] { return std::string("belief"); });
}

bool Pomdp::isAllowed(int action, const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  if (tables_.allowed.size() == 0) return true;
  return (tables_.allowed.row(action).transpose() || belief.array() == 0.0).all();
}

}  // namespace fabric::planner
