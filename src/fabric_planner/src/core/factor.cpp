// SPDX-License-Identifier: BSD-3-Clause
#include "factor.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "fabric_planner/pomdp.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

constexpr double ROW_TOLERANCE = 1e-6;

std::vector<int> sizesOf(const std::vector<Axis>& axes) {
  std::vector<int> sizes;
  for (const auto& axis : axes) sizes.push_back(axis.domain->size());
  return sizes;
}

/// A table over nothing still holds one number: it gets an axis of its own.
std::vector<Axis> orOne(std::vector<Axis> axes) {
  if (axes.empty()) {
    static const auto ONE = std::make_shared<const Domain>(std::vector<std::string>{"null"});
    axes.push_back({Role::ACTION, -1, "null", ONE});
  }
  return axes;
}

/// Calls visit(p) for each number below a node that was ever set, zeros at least once.
void forEachCell(const TableNode* node, size_t axis, const std::vector<int>& sizes, Picks& digits,
                 const std::function<void(double)>& visit) {
  if (node == nullptr) return;
  if (axis + 1 == sizes.size()) {
    if (node->cells.rest == 0.0) visit(0.0);
    node->cells.forEach(sizes[axis], [&](int i, double p) {
      digits[axis] = i;
      visit(p);
    });
    return;
  }
  node->branches.forEach(sizes[axis], [&](int i, const TableLink& below) {
    digits[axis] = i;
    forEachCell(below.get(), axis + 1, sizes, digits, visit);
  });
}

/// Divides all below a node; nodes are not shared with other rows afterwards.
void divide(TableNode& node, double sum) {
  const auto deeper = [&](TableLink& below) {
    if (!below) return;
    below = std::make_shared<TableNode>(*below);
    divide(*below, sum);
  };
  deeper(node.branches.rest);
  for (auto& other : node.branches.others) deeper(other.second);
  node.cells.rest /= sum;
  for (auto& other : node.cells.others) other.second /= sum;
}

}  // namespace

Domain::Domain(std::vector<std::string> names) : names_(std::move(names)) {
  for (int i = 0; i < size(); ++i) index_.emplace(names_[static_cast<size_t>(i)], i);
}

int Domain::find(std::string_view token) const {
  const auto found = index_.find(token);
  if (found != index_.end()) return found->second;
  int value = -1;
  const char* end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, value);
  return error == std::errc() && stop == end && value >= 0 && value < size() ? value : -1;
}

Factor::Factor(std::string element, std::vector<Axis> axes, size_t children, size_t entries)
    : element_(std::move(element)),
      axes_(orOne(std::move(axes))),
      children_(children),
      tree_(sizesOf(axes_), entries) {}

Picks Factor::picked(const Tokens& instance) const {
  const bool none = axes_[0].variable < 0;
  const size_t wanted = none ? 0 : axes_.size();
  if (instance.size() != wanted) {
    throw ModelError(element_ + ": instance '" + join(instance, " ") + "' has " +
                     std::to_string(instance.size()) + " tokens, expected " +
                     std::to_string(wanted));
  }
  if (none) return {0};
  Picks picks;
  for (size_t i = 0; i < axes_.size(); ++i) {
    const bool listed = instance[i] == "-";
    picks.push_back(listed               ? int{LISTED}
                    : instance[i] == "*" ? int{ALL}
                                         : axes_[i].domain->find(instance[i]));
    if (picks.back() >= 0 || listed || instance[i] == "*") continue;
    throw ModelError(element_ + ": instance '" + join(instance, " ") + "': '" + instance[i] +
                     "' is no value of " + axes_[i].name + " (" +
                     join(axes_[i].domain->names(), ", ") + ")");
  }
  return picks;
}

void Factor::addEntry(const Tokens& instance, std::string_view table) {
  const Picks picks = picked(instance);
  Words words(table);
  const auto first = words.next();
  const bool alone = words.next().empty();
  if (alone && (first == "uniform" || first == "identity")) {
    refuseConflict(instance, std::hash<std::string_view>()(first));
    first == "uniform" ? setUniform(instance, picks) : setIdentity(instance, picks);
    return;
  }
  const auto values = readNumbers(instance, picks, table);
  const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                               values.size() * sizeof(double));
  refuseConflict(instance, std::hash<std::string_view>()(bytes));
  assign(picks, values);
}

std::vector<double> Factor::readNumbers(const Tokens& instance, const Picks& picks,
                                        std::string_view table) const {
  double wanted = 1.0;
  for (size_t i = 0; i < picks.size(); ++i) {
    if (picks[i] == LISTED) wanted *= axes_[i].domain->size();
  }
  std::vector<double> values;
  const auto rowOf = [&] {
    Tokens row = instance;
    auto index = values.size();
    for (size_t i = picks.size(); i-- > 0;) {
      if (picks[i] != LISTED) continue;
      const auto& names = axes_[i].domain->names();
      row[i] = names[index % names.size()];
      index /= names.size();
    }
    return place(row);
  };
  Words words(table);
  size_t count = 0;
  for (auto word = words.next(); !word.empty(); word = words.next(), ++count) {
    if (static_cast<double>(count) < wanted) values.push_back(number(word, rowOf) + 0.0);
  }
  if (static_cast<double>(count) != wanted) {
    throw ModelError(place(instance) + ": entry '" + join(instance, " ") + "' has " +
                     std::to_string(count) + " numbers, expected " + text(wanted));
  }
  return values;
}

void Factor::setUniform(const Tokens& instance, Picks picks) {
  if (picks.back() != LISTED || children_ == 0) {
    throw ModelError(element_ + ": 'uniform' needs '-' as the last token of its instance '" +
                     join(instance, " ") + "'");
  }
  double size = 1.0;
  for (size_t i = 0; i < picks.size(); ++i) {
    if (picks[i] != LISTED) continue;
    picks[i] = ALL;
    if (i >= numParents()) size *= axes_[i].domain->size();
  }
  assign(picks, 1.0 / size);
}

void Factor::setIdentity(const Tokens& instance, const Picks& picks) {
  std::vector<size_t> listed;
  for (size_t i = 0; i < picks.size(); ++i) {
    if (picks[i] == LISTED) listed.push_back(i);
  }
  if (listed.size() != 2 || axes_[listed[0]].domain->size() != axes_[listed[1]].domain->size()) {
    throw ModelError(element_ + ": 'identity' needs two '-' of equal size in its instance '" +
                     join(instance, " ") + "'");
  }
  assignIdentity(picks, listed[0], listed[1]);
}

void Factor::refuseConflict(const Tokens& instance, size_t hash) {
  const auto [known, fresh] = seen_.emplace(join(instance, " "), hash);
  if (fresh || known->second == hash) return;
  throw ModelError(place(instance) + ": entry '" + known->first +
                   "' is given twice with different values");
}

void Factor::assign(const Picks& picks, const std::vector<double>& values) {
  try {
    tree_.assign(picks, values);
  } catch (const std::length_error& error) {
    throw ModelError(element_ + ": " + error.what());
  }
}

void Factor::assign(const Picks& picks, double value) { assign(picks, std::vector<double>{value}); }

void Factor::assignIdentity(Picks picks, size_t first, size_t second) {
  picks[first] = picks[second] = ALL;
  assign(picks, 0.0);
  for (int i = 0; i < axes_[first].domain->size(); ++i) {
    picks[first] = picks[second] = i;
    assign(picks, 1.0);
  }
}

void Factor::checkRows(bool normalise) {
  checked_.clear();
  Picks row;
  checkNode(tree_.root(), row, normalise);
}

void Factor::checkNode(const TableNode* node, Picks& row, bool normalise) {
  if (node != nullptr && !checked_.insert(node).second) return;
  const size_t axis = row.size();
  if (axis == numParents()) {
    // Whole rows may be rescaled where they stand: all users of a node want it the same way.
    static TableNode empty;
    checkRow(node == nullptr ? empty : *const_cast<TableNode*>(node), row, normalise);
    return;
  }
  const TableNode* last = nullptr;
  for (int i = 0; i < axes_[axis].domain->size(); ++i) {
    const TableNode* below = node == nullptr ? nullptr : node->branches.at(i).get();
    if (i > 0 && below == last) continue;
    row.push_back(i);
    checkNode(last = below, row, normalise);
    row.pop_back();
  }
}

void Factor::checkRow(TableNode& node, const Picks& row, bool normalise) const {
  std::vector<int> sizes;
  for (size_t i = numParents(); i < axes_.size(); ++i) sizes.push_back(axes_[i].domain->size());
  Picks digits(children_);
  bool given = false;
  double sum = 0.0;
  forEachCell(&node, 0, sizes, digits, [&](double p) {
    given = true;
    sum += p;
    if (p >= 0.0 && p <= 1.0 + ROW_TOLERANCE) return;
    Tokens column;
    for (size_t i = 0; i < children_; ++i) {
      column.push_back(axes_[numParents() + i].domain->names()[static_cast<size_t>(digits[i])]);
    }
    throw RowError(
        placeOf(row) + " column " + join(column, "/") + " is " + text(p) + ", not a probability",
        row);
  });
  if (!given) throw RowError(placeOf(row) + " has no entry", row);
  if (std::abs(sum - 1.0) > ROW_TOLERANCE && !(normalise && sum > 0.0)) {
    throw RowError(placeOf(row) + " sums to " + text(sum) + ", not 1", row);
  }
  if (normalise) divide(node, sum);
}

double Factor::at(const Assignment& assignment) const {
  const TableNode* node = tree_.root();
  for (size_t i = 0; i + 1 < axes_.size() && node != nullptr; ++i) {
    node = node->branches.at(valueOf(axes_[i], assignment)).get();
  }
  if (node == nullptr) return 0.0;
  const auto& last = axes_.back();
  const double value = node->cells.at(last.variable < 0 ? 0 : valueOf(last, assignment));
  return std::isnan(value) ? 0.0 : value;
}

bool Factor::dependsOn(Role role) const {
  return std::any_of(axes_.begin(), axes_.end(),
                     [role](const Axis& a) { return a.role == role && a.variable >= 0; });
}

std::string Factor::place(const Tokens& tokens) const {
  Tokens actions;
  Tokens row;
  for (size_t i = 0; i < std::min(numParents(), tokens.size()); ++i) {
    (axes_[i].role == Role::ACTION ? actions : row).push_back(tokens[i]);
  }
  return element_ + (actions.empty() ? "" : "[" + join(actions, ",") + "]") +
         (row.empty() ? "" : " row " + join(row, "/"));
}

std::string Factor::placeOf(const Picks& row) const {
  Tokens tokens;
  for (size_t i = 0; i < row.size(); ++i) {
    tokens.push_back(axes_[i].domain->names()[static_cast<size_t>(row[i])]);
  }
  return place(tokens);
}

}  // namespace fabric::planner
