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

void checkShape(const std::string& where, const std::string& element, const Eigen::MatrixXd& table,
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

/// Checks one distribution, "place" being e.g. "T[grasp] row NeedsHelp"; rescales it if needed.
template <typename Row>
void checkDistribution(const std::string& where, const std::string& place, const Names& columns,
                       Row row) {
  for (Eigen::Index i = 0; i < row.size(); ++i) {
    const auto column = [&] { return place + " column " + columns[static_cast<size_t>(i)]; };
    if (!std::isfinite(row(i))) checkFinite(where, column(), row(i));
    if (row(i) < 0.0 || row(i) > 1.0 + ROW_TOLERANCE) {
      refuse(where, column() + " is " + text(row(i)) + ", not a probability");
    }
  }
  const double sum = row.sum();
  if (std::abs(sum - 1.0) > ROW_TOLERANCE) {
    refuse(where, place + " sums to " + text(sum) + ", not 1");
  }
  if (std::abs(sum - 1.0) > EXACT_ENOUGH) row /= sum;
}

void checkRows(const std::string& where, const std::string& element, const Names& rows,
               const Names& columns, Eigen::MatrixXd& table) {
  checkShape(where, element, table, rows.size(), columns.size());
  for (Eigen::Index s = 0; s < table.rows(); ++s) {
    checkDistribution(where, element + " row " + rows[static_cast<size_t>(s)], columns,
                      table.row(s));
  }
}

void checkTables(PomdpTables& m) {
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
      checkFinite(m.name, "R[" + m.actions[a] + "] at " + m.states[s], m.R(a, s));
    }
  }
}

/// True when no observation symbol can come from two states.
bool tellsTheState(const PomdpTables& m) {
  std::vector<Eigen::Index> source(m.observations.size(), -1);
  for (const auto& table : m.O) {
    for (Eigen::Index o = 0; o < table.cols(); ++o) {
      for (Eigen::Index s = 0; s < table.rows(); ++s) {
        auto& known = source[static_cast<size_t>(o)];
        if (table(s, o) <= 0.0 || known == s) continue;
        if (known >= 0) return false;
        known = s;
      }
    }
  }
  return true;
}

bool isTerminal(const PomdpTables& m, Eigen::Index s) {
  for (size_t a = 0; a < m.actions.size(); ++a) {
    if (m.T[a](s, s) < 1.0 - EXACT_ENOUGH || m.R(static_cast<Eigen::Index>(a), s) != 0.0) {
      return false;
    }
  }
  return true;
}

int indexOf(const std::string& where, const std::string& kind, const Names& names,
            const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  refuse(where, "unknown " + kind + " '" + name + "' (known: " + join(names, ", ") + ")");
}

}  // namespace

Pomdp::Pomdp(PomdpTables tables) : tables_(std::move(tables)) {
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
  Eigen::VectorXd checked = belief;
  checkDistribution<Eigen::Ref<Eigen::VectorXd>>(tables_.name, "belief", tables_.states, checked);
  return checked;
}

}  // namespace fabric::planner
