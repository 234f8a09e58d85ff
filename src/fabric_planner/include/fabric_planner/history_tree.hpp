// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "fabric_planner/generative.hpp"

namespace fabric::planner {

/// The tree of histories of POMCP in one block of memory.
///
/// A history is a number; its children are found by hashing (history, action, observation) into a
/// table of history numbers. Both are taken once; reset() is done in constant time.
class HistoryTree {
 public:
  struct Child {
    std::uint32_t node;
    bool known;  ///< false when it was made just now, or could not be for want of memory
  };
  struct Best {
    int first = -1;   ///< -1 when no action was ever tried
    int second = -1;  ///< -1 when only one was
    double value = 0.0;
    double gap = 0.0;
  };

  /// @throw ModelError when the memory is too small for a few histories.
  HistoryTree(int actions, std::size_t memory);

  /// A single history, the root. legal(action) says which actions it has.
  template <class Legal>
  void reset(const Legal& legal) {
    ++generation_;
    if (generation_ == 0) forgetTable();
    size_ = 0;
    root_ = add(0, 0, legal);
  }
  /// Makes the child the root. False when there is none; the tree must then be reset.
  bool moveRoot(int action, Observation observation);

  /// The child of a history; made with legal(action) when it is not there and memory is left.
  template <class Legal>
  Child child(std::uint32_t node, int action, Observation observation, const Legal& legal) {
    const std::uint32_t parent = slot(node, action);
    std::size_t at = home(parent, observation);
    while (isUsed(table_[at])) {
      const std::uint32_t found = table_[at].node;
      if (nodes_[found].parent == parent && nodes_[found].observation == observation) {
        return {found, true};
      }
      at = (at + 1) & mask_;
    }
    if (size_ == nodes_.size()) return {0, false};
    const std::uint32_t made = add(parent, observation, legal);
    table_[at] = {made, generation_};
    return {made, false};
  }

  /// UCB1: an action not tried yet, else the largest Q + exploration sqrt(log N / n).
  [[nodiscard]] int choose(std::uint32_t node, double exploration) const;
  /// Counts a return that followed the action in the history.
  void record(std::uint32_t node, int action, double value) {
    Edge& edge = edges_[slot(node, action)];
    ++nodes_[node].visits;
    ++edge.visits;
    edge.scale = 1.0F / std::sqrt(static_cast<float>(edge.visits));
    edge.value += (value - edge.value) / edge.visits;
  }
  /// The root's best tried actions by value.
  [[nodiscard]] Best bestActions() const;

  [[nodiscard]] std::uint32_t root() const { return root_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool isMostlyFree() const { return size_ < nodes_.size() / 4 * 3; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Node {
    Observation observation;
    std::uint32_t parent;  // slot of the edge above
    std::uint32_t visits;
  };
  struct Edge {
    double value;
    std::uint32_t visits;
    float scale;  // 1 / sqrt(visits); < 0 for an action that is not legal
  };
  struct Entry {
    std::uint32_t node;
    std::uint32_t generation;
  };

  [[nodiscard]] std::uint32_t slot(std::uint32_t node, int action) const {
    return node * actions_ + static_cast<std::uint32_t>(action);
  }
  [[nodiscard]] bool isUsed(const Entry& entry) const { return entry.generation == generation_; }
  [[nodiscard]] std::size_t home(std::uint32_t parent, Observation observation) const {
    return mixBits(observation ^ mixBits(parent)) & mask_;
  }
  template <class Legal>
  std::uint32_t add(std::uint32_t parent, Observation observation, const Legal& legal) {
    const auto node = static_cast<std::uint32_t>(size_++);
    nodes_[node] = {observation, parent, 0};
    for (std::uint32_t a = 0; a < actions_; ++a) {
      edges_[node * actions_ + a] = {0.0, 0, legal(static_cast<int>(a)) ? 0.0F : -1.0F};
    }
    return node;
  }
  void forgetTable();

  std::uint32_t actions_;
  std::uint32_t generation_ = 0;
  std::uint32_t root_ = 0;
  std::size_t size_ = 0;
  std::size_t mask_ = 0;
  std::vector<Node> nodes_;
  std::vector<Edge> edges_;
  std::vector<Entry> table_;
};

}  // namespace fabric::planner
