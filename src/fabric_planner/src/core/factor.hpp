// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace fabric::planner {

/// What a variable of a factored model stands for, and at which side of the step.
enum class Role { ACTION, PREVIOUS, CURRENT, OBSERVATION };

/// A value index per variable, grouped by role.
using Assignment = std::array<std::vector<int>, 4>;

/// One axis of a table: a variable in its role, with the names of its values.
struct Axis {
  Role role;
  int variable;  ///< index among the variables of that role
  std::string name;
  std::vector<std::string> values;
};

/// A dense table over a few variables, filled by POMDPX entries; the last axis is the child.
class Factor {
 public:
  /// element: "T", "O", "R" or "b", begins the place named in errors.
  Factor(std::string element, std::vector<Axis> axes);

  /// Applies one entry; a later entry overrides an earlier one where they overlap.
  /// instance: one token an axis, a value, `*` (all alike) or `-` (listed in the table).
  /// table: numbers over the `-` axes, last axis fastest, or `uniform` or `identity`.
  /// @throw ModelError naming row and token; also when the same instance had another table.
  void addEntry(const std::vector<std::string>& instance, const std::vector<std::string>& table);

  /// Checks that each row over the last axis is a distribution; rescales rows when asked to.
  /// @throw ModelError naming the row and its sum.
  void checkRows(bool normalise);

  [[nodiscard]] double at(const Assignment& assignment) const;
  [[nodiscard]] bool dependsOn(Role role) const;

 private:
  using Tokens = std::vector<std::string>;

  [[nodiscard]] std::vector<double> expand(const Tokens& instance, const Tokens& table,
                                           const std::vector<size_t>& listed) const;
  [[nodiscard]] std::vector<double> identity(const std::vector<size_t>& listed) const;
  [[nodiscard]] std::vector<double> uniform(const std::vector<size_t>& listed) const;
  void refuseConflict(const Tokens& instance, const std::vector<double>& values);
  void store(const std::vector<std::vector<int>>& choices, const std::vector<size_t>& listed,
             const std::vector<double>& values);
  /// "T[grasp] row NeedsHelp" from one token an axis.
  [[nodiscard]] std::string place(const Tokens& tokens) const;
  [[nodiscard]] size_t size(size_t axis) const { return axes_[axis].values.size(); }
  [[nodiscard]] size_t count(const std::vector<size_t>& listed) const;

  std::string element_;
  std::vector<Axis> axes_;
  std::vector<size_t> strides_;
  std::vector<double> values_;
  std::vector<bool> given_;
  std::map<std::string, std::vector<double>> seen_;
};

}  // namespace fabric::planner
