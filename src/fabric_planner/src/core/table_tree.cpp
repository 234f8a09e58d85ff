// SPDX-License-Identifier: BSD-3-Clause
#include "table_tree.hpp"

#include <stdexcept>

namespace fabric::planner {

/// One assignment on its way down the tree.
struct TableTree::Change {
  const Picks& picks;
  const std::vector<double>& values;
  std::vector<bool> covers;  // per axis: is everything from here on replaced
};

void TableTree::assign(const Picks& picks, const std::vector<double>& values) {
  Change change{picks, values, std::vector<bool>(picks.size())};
  bool all = true;
  for (std::size_t i = picks.size(); i-- > 0;) change.covers[i] = all = all && picks[i] < 0;
  set(root_, 0, 0, change);
}

void TableTree::set(TableLink& node, std::size_t axis, std::size_t offset, const Change& change) {
  if (change.covers[axis]) node.reset();
  own(node);
  const int pick = change.picks[axis];
  if (axis + 1 == sizes_.size()) {
    setCells(node->cells, pick, offset, change);
  } else if (pick >= 0) {
    set(node->branches.slot(pick), axis + 1, offset, change);
  } else if (pick == ALL) {
    set(node->branches.rest, axis + 1, offset, change);
    for (auto& other : node->branches.others) set(other.second, axis + 1, offset, change);
  } else {
    const auto size = static_cast<std::size_t>(sizes_[axis]);
    node->branches.others.reserve(size);
    for (std::size_t i = 0; i < size; ++i) {
      set(node->branches.slot(static_cast<int>(i)), axis + 1, offset * size + i, change);
    }
  }
}

void TableTree::setCells(Alike<double>& cells, int pick, std::size_t offset, const Change& change) {
  if (pick >= 0) {
    cells.slot(pick) = change.values[offset];
  } else if (pick == ALL) {
    cells.others.clear();
    cells.rest = change.values[offset];
  } else {
    const auto size = static_cast<std::size_t>(sizes_.back());
    const double* row = change.values.data() + offset * size;
    cells.others.clear();
    cells.rest = 0.0;
    for (std::size_t i = 0; i < size; ++i) {
      if (row[i] != 0.0) cells.others.emplace_back(static_cast<int>(i), row[i]);
    }
    cells.others.shrink_to_fit();
    spend(cells.others.size());
  }
}

void TableTree::own(TableLink& node) {
  spend(1);
  if (!node) {
    node = std::make_shared<TableNode>();
  } else if (node.use_count() > 1) {
    spend(node->branches.others.size() + node->cells.others.size());
    node = std::make_shared<TableNode>(*node);
  }
}

void TableTree::spend(std::size_t count) {
  spent_ += count;
  if (spent_ > limit_) throw std::length_error("table too large");
}

}  // namespace fabric::planner
