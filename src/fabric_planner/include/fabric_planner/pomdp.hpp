// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <stdexcept>
#include <string>
#include <vector>

namespace fabric::planner {

/// Bad model data or a bad belief; the message names file, element, row and value.
class ModelError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;     ///< T: a row a state
using SparseColumns = Eigen::SparseMatrix<double, Eigen::ColMajor>;  ///< O: a column a symbol
using Flags = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// Everything of a POMDP but T and O, as read, before anything is checked.
struct PomdpFrame {
  std::string name;                       ///< where it came from; begins every error message
  std::vector<std::string> states;        ///< unique, no blanks
  std::vector<std::string> actions;       ///< unique, no blanks
  std::vector<std::string> observations;  ///< unique, no blanks
  Eigen::MatrixXd R;                      ///< (A, S): expected immediate reward
  double discount = 0.0;                  ///< in (0, 1]
  Eigen::VectorXd initial_belief;         ///< (S,), sums to 1
  Flags allowed;                          ///< (A, S): may the action be taken; empty: always
};

/// The tables of a small POMDP, written out.
struct PomdpTables : PomdpFrame {
  std::vector<Eigen::MatrixXd> T;  ///< per action (S, S'): P(s' | s, a)
  std::vector<Eigen::MatrixXd> O;  ///< per action (S', O): P(o | a, s')
};

/// The same with the zeros left out.
struct SparseTables : PomdpFrame {
  std::vector<SparseRows> T;     ///< per action (S, S')
  std::vector<SparseColumns> O;  ///< per action (S', O)
};

/// A tabular POMDP whose every number was checked when it was made; immutable afterwards.
///
/// Row sums may be off by 1e-6; rows off by more than 1e-12 are rescaled, so that the core may
/// count on them. Zeros are not stored.
///
/// Where `allowed` is given, an action may be taken at a belief only if it is allowed in every
/// state that is possible there; each state allows at least one.
class Pomdp {
 public:
  /// @throw ModelError naming the element, row and value that is not acceptable.
  explicit Pomdp(SparseTables tables);
  explicit Pomdp(const PomdpTables& tables);

  [[nodiscard]] int numStates() const { return static_cast<int>(tables_.states.size()); }
  [[nodiscard]] int numActions() const { return static_cast<int>(tables_.actions.size()); }
  [[nodiscard]] int numObservations() const {
    return static_cast<int>(tables_.observations.size());
  }
  [[nodiscard]] const std::string& name() const { return tables_.name; }
  [[nodiscard]] const std::vector<std::string>& states() const { return tables_.states; }
  [[nodiscard]] const std::vector<std::string>& actions() const { return tables_.actions; }
  [[nodiscard]] const std::vector<std::string>& observations() const {
    return tables_.observations;
  }
  /// (S, S'): P(s' | s, action).
  [[nodiscard]] const SparseRows& T(int action) const { return tables_.T[action]; }
  /// (S', O): P(o | action, s').
  [[nodiscard]] const SparseColumns& O(int action) const { return tables_.O[action]; }
  /// (A, S): expected immediate reward.
  [[nodiscard]] const Eigen::MatrixXd& R() const { return tables_.R; }
  [[nodiscard]] double discount() const { return tables_.discount; }
  /// (A, S); empty when every action may be taken everywhere.
  [[nodiscard]] const Flags& allowed() const { return tables_.allowed; }
  /// May the action be taken in every state that is possible? belief: (S,).
  [[nodiscard]] bool isAllowed(int action, const Eigen::Ref<const Eigen::VectorXd>& belief) const;
  /// (S,), sums to 1.
  [[nodiscard]] const Eigen::VectorXd& initialBelief() const { return tables_.initial_belief; }
  /// True when every observation tells the state reached (an MDP).
  [[nodiscard]] bool fullyObservable() const { return fully_observable_; }
  /// (S,): absorbing under every action and without reward.
  [[nodiscard]] const std::vector<bool>& terminal() const { return terminal_; }

  /// Index of a name. @throw ModelError when there is none.
  [[nodiscard]] int stateIndex(const std::string& name) const;
  [[nodiscard]] int actionIndex(const std::string& name) const;
  [[nodiscard]] int observationIndex(const std::string& name) const;

  /// @throw std::out_of_range naming the index.
  void checkAction(int action) const;
  void checkObservation(int observation) const;
  /// The belief rescaled to sum to 1. @throw ModelError when it is no distribution over states.
  [[nodiscard]] Eigen::VectorXd checkedBelief(const Eigen::VectorXd& belief) const;

 private:
  SparseTables tables_;
  bool fully_observable_ = false;
  std::vector<bool> terminal_;
};

}  // namespace fabric::planner
