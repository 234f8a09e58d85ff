// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace fabric::planner {

/// What an entry says of one axis: a value >= 0, or one of these.
enum Pick : int { ALL = -1, LISTED = -2 };
using Picks = std::vector<int>;

/// Values by index, of which most are alike.
template <typename T>
struct Alike {
  T rest;                                 ///< of every index not among the others
  std::vector<std::pair<int, T>> others;  ///< by rising index

  [[nodiscard]] auto position(int index) const {
    // Full and nearly full ones are read far more often than any: guess before searching.
    const auto size = static_cast<std::ptrdiff_t>(others.size());
    const auto guess = others.begin() + std::min<std::ptrdiff_t>(index, size);
    if (guess != others.end() && guess->first == index) return guess;
    return std::lower_bound(others.begin(), guess, index,
                            [](const auto& other, int wanted) { return other.first < wanted; });
  }
  [[nodiscard]] const T& at(int index) const {
    const auto found = position(index);
    return found != others.end() && found->first == index ? found->second : rest;
  }
  /// The value of that index, made one of the others if it is none.
  T& slot(int index) {
    const auto found = others.begin() + (position(index) - others.cbegin());
    if (found != others.end() && found->first == index) return found->second;
    return others.emplace(found, index, rest)->second;
  }
  /// visit(index, value) for all of 0 .. size - 1; the rest only if it is neither
  /// empty nor zero nor NaN.
  template <typename Visit>
  void forEach(int size, const Visit& visit) const {
    if (rest == T{} || rest != rest) {
      for (const auto& [index, value] : others) visit(index, value);
      return;
    }
    auto next = others.begin();
    for (int i = 0; i < size; ++i) {
      const bool other = next != others.end() && next->first == i;
      visit(i, other ? (next++)->second : rest);
    }
  }
};

struct TableNode;
using TableLink = std::shared_ptr<TableNode>;

/// The part of a table below some choice of values: by the next axis, a further node or, at the
/// last axis, a number. No node, and NaN: never set.
struct TableNode {
  Alike<TableLink> branches{nullptr, {}};
  Alike<double> cells{std::numeric_limits<double>::quiet_NaN(), {}};
};

/// A table of numbers as a tree over its axes in which equal parts are kept once: the rest of a
/// node stands for all values nobody spoke of alone, and nodes are copied when one user of a
/// shared one changes it. So `*` costs one step, however many values there are.
class TableTree {
 public:
  /// sizes: of the axes, at least one. limit: numbers and branches that may be written.
  TableTree(std::vector<int> sizes, std::size_t limit) : sizes_(std::move(sizes)), limit_(limit) {}

  [[nodiscard]] const TableNode* root() const { return root_.get(); }
  [[nodiscard]] TableLink& rootLink() { return root_; }

  /// Sets all that the picks reach: values[i], i counting the LISTED axes, last axis fastest.
  /// @throw std::length_error when too much was written.
  void assign(const Picks& picks, const std::vector<double>& values);

 private:
  struct Change;
  void set(TableLink& node, std::size_t axis, std::size_t offset, const Change& change);
  void setCells(Alike<double>& cells, int pick, std::size_t offset, const Change& change);
  void spend(std::size_t count);
  void own(TableLink& node);

  std::vector<int> sizes_;
  std::size_t limit_;
  std::size_t spent_ = 0;
  TableLink root_;
};

}  // namespace fabric::planner
