// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "fabric_planner/pomdp.hpp"
#include "table_tree.hpp"

namespace fabric::planner {

/// What a variable of a factored model stands for, and at which side of the step.
enum class Role { ACTION, PREVIOUS, CURRENT, OBSERVATION };

/// A value index per variable, grouped by role.
using Assignment = std::array<std::vector<int>, 4>;

/// The values of a variable by name.
class Domain {
 public:
  explicit Domain(std::vector<std::string> names);
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] int size() const { return static_cast<int>(names_.size()); }
  /// The value of that name, else the one of that number; -1 when there is neither.
  [[nodiscard]] int find(std::string_view token) const;

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string_view, int> index_;  // views of names_
};

/// One axis of a table: a variable in its role.
struct Axis {
  Role role;
  int variable;  ///< index among the variables of that role
  std::string name;
  std::shared_ptr<const Domain> domain;
};

/// A row that is no distribution.
class RowError : public ModelError {
 public:
  RowError(const std::string& what, Picks row) : ModelError(what), row_(std::move(row)) {}
  /// Value of each parent axis.
  [[nodiscard]] const Picks& row() const { return row_; }

 private:
  Picks row_;
};

/// A table over a few variables, filled by the entries of a file; the last axes are the children,
/// whose joint distribution each row is. Kept sparse.
class Factor {
 public:
  /// element: "T", "O", "R" or "b", begins the place named in errors.
  /// children: how many of the last axes a row runs over; 0 for rewards.
  /// entries: numbers the table may hold.
  Factor(std::string element, std::vector<Axis> axes, size_t children, size_t entries);

  /// Applies one entry of POMDPX; a later entry overrides an earlier one where they overlap.
  /// instance: one token an axis, a value, `*` (all alike) or `-` (listed in the table).
  /// table: numbers over the `-` axes, last axis fastest, or `uniform` or `identity`.
  /// @throw ModelError naming row and token; also when the same instance had another table.
  void addEntry(const std::vector<std::string>& instance, std::string_view table);

  /// Sets every number the picks reach; a pick an axis.
  /// @throw ModelError when the table becomes too large.
  void assign(const Picks& picks, double value);
  /// The same from a list over the LISTED axes, last axis fastest.
  void assign(const Picks& picks, const std::vector<double>& values);
  /// 1 where the two axes have the same value, 0 elsewhere; both must be picked whole.
  void assignIdentity(Picks picks, size_t first, size_t second);

  /// Checks that each row is a distribution; rescales rows when asked to.
  /// @throw RowError naming the row and its sum.
  void checkRows(bool normalise);

  [[nodiscard]] double at(const Assignment& assignment) const;
  /// Calls visit(p) for each p that is not 0 of the row chosen by the assignment, with the
  /// children's values filled into the assignment.
  template <typename Visit>
  void forEachChild(Assignment& now, const Visit& visit) const;

  [[nodiscard]] bool dependsOn(Role role) const;
  [[nodiscard]] const std::vector<Axis>& axes() const { return axes_; }
  [[nodiscard]] size_t numParents() const { return axes_.size() - children_; }
  /// "T[grasp] row NeedsHelp" from one token an axis.
  [[nodiscard]] std::string place(const std::vector<std::string>& tokens) const;

 private:
  using Tokens = std::vector<std::string>;

  [[nodiscard]] Picks picked(const Tokens& instance) const;
  [[nodiscard]] std::vector<double> readNumbers(const Tokens& instance, const Picks& picks,
                                                std::string_view table) const;
  void setUniform(const Tokens& instance, Picks picks);
  void setIdentity(const Tokens& instance, const Picks& picks);
  void refuseConflict(const Tokens& instance, size_t hash);
  void checkNode(const TableNode* node, Picks& row, bool normalise);
  void checkRow(TableNode& node, const Picks& row, bool normalise) const;
  [[nodiscard]] std::string placeOf(const Picks& row) const;
  [[nodiscard]] static int valueOf(const Axis& axis, const Assignment& assignment) {
    return assignment[static_cast<size_t>(axis.role)][static_cast<size_t>(axis.variable)];
  }
  template <typename Visit>
  void visitChildren(const TableNode* node, size_t axis, Assignment& now, const Visit& visit) const;

  std::string element_;
  std::vector<Axis> axes_;
  size_t children_;
  TableTree tree_;
  std::unordered_map<std::string, size_t> seen_;  // instance -> hash of its table
  std::unordered_set<const TableNode*> checked_;
};

template <typename Visit>
void Factor::forEachChild(Assignment& now, const Visit& visit) const {
  const TableNode* node = tree_.root();
  for (size_t i = 0; i < numParents() && node != nullptr; ++i) {
    node = node->branches.at(valueOf(axes_[i], now)).get();
  }
  visitChildren(node, numParents(), now, visit);
}

template <typename Visit>
void Factor::visitChildren(const TableNode* node, size_t axis, Assignment& now,
                           const Visit& visit) const {
  if (node == nullptr) return;
  auto& value =
      now[static_cast<size_t>(axes_[axis].role)][static_cast<size_t>(axes_[axis].variable)];
  if (axis + 1 == axes_.size()) {
    node->cells.forEach(axes_[axis].domain->size(), [&](int v, double p) {
      if (!(p != 0.0) || p != p) return;
      value = v;
      visit(p);
    });
    return;
  }
  node->branches.forEach(axes_[axis].domain->size(), [&](int v, const TableLink& below) {
    value = v;
    visitChildren(below.get(), axis + 1, now, visit);
  });
}

}  // namespace fabric::planner
