// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomdp.hpp"
#include "simd.hpp"
#include "stopwatch.hpp"
#include "successors.hpp"

namespace fabric::planner {

/// The and-or tree of a search that goes on from step to step.
///
/// An expanded belief has a slot, and a slot has room for all A * O beliefs after it, so that the
/// belief after action a and observation o of slot k is number (k * A + a) * O + o. Slots come from
/// memory reserved once. What is cut off when the root moves is not walked through: its topmost
/// slots wait in a list, and whoever takes one from there puts the ones below it in its place.
class SearchTree {
 public:
  /// lower, upper: must outlive the tree. @throw ModelError when max_nodes is too many.
  SearchTree(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper,
             int max_nodes);

  /// Forgets everything. The tree has no root then.
  void clear();
  /// Forgets everything but a root. belief: (S,), sums to 1.
  void start(const Eigen::VectorXd& belief);
  /// Moves the root to the belief after an action and an observation and keeps what is below.
  /// Without such a belief the tree has no root any more.
  void advance(int action, int observation);
  /// True when the root's belief is this one, but for rounding.
  [[nodiscard]] bool isAt(const Eigen::VectorXd& belief) const;

  /// Expands the most important leaf and brings its news to the root.
  /// @return false when time was up first; the tree is then as before.
  bool grow(Stopwatch& watch);

  /// Expanded beliefs of the tree.
  [[nodiscard]] int expanded() const { return root_slot_ < 0 ? 0 : slots_[index(root_slot_)].size; }
  /// True when no leaf has a gap left that matters to the root.
  [[nodiscard]] bool exhausted() const { return root_slot_ >= 0 && root_.priority <= 0.0; }
  [[nodiscard]] double lower() const { return root_.lower; }
  [[nodiscard]] double upper() const { return root_.upper; }
  /// Bounds of an action at the root, which must be expanded; -inf where it is not allowed.
  [[nodiscard]] double actionLower(int action) const;
  [[nodiscard]] double actionUpper(int action) const;

  /// The tree as plain data, level by level; see OnlinePlanner::tree.
  [[nodiscard]] std::vector<TreeEntry> describe(int max_depth, double min_probability) const;

 private:
  static constexpr int ROOT = -1;

  struct Bounds {
    double lower;
    double upper;
    double priority;  ///< largest discounted, weighted gap of a leaf below
  };
  /// A belief that was reached: nodes are numbered slot * A * O + a * O + o of their parent's slot.
  struct Slot {
    int node;         ///< the belief's own number, or ROOT
    int size;         ///< expanded beliefs from here down
    int best_branch;  ///< action with the largest upper bound
  };
  /// An action at a belief.
  struct Branch {
    double reward;
    double lower;
    double upper;
    double priority;
    int best_child;  ///< node, -1 for none
  };

  [[nodiscard]] static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] double* beliefOf(int slot) { return beliefs_.data() + index(slot) * width_; }
  [[nodiscard]] const double* beliefOf(int slot) const {
    return beliefs_.data() + index(slot) * width_;
  }
  [[nodiscard]] const double* rootBelief() const;
  [[nodiscard]] int slotOf(int node) const {
    return node == ROOT ? root_slot_ : child_slots_[index(node)];
  }
  [[nodiscard]] Bounds boundsOf(int node) const;
  void setBounds(int node, const Bounds& bounds);

  int takeSlot();
  void giveBack(int slot);
  [[nodiscard]] int mostImportantLeaf() const;
  bool expand(int node, Stopwatch& watch);
  bool fillIn(int slot, Stopwatch& watch);
  void refreshBranch(int slot, int action);
  void refreshSlot(int slot);
  void backUp(int slot);
  void describeActions(int parent, int slot, std::vector<TreeEntry>& entries) const;
  void describeBeliefs(int parent, int slot, double min_probability,
                       std::vector<TreeEntry>& entries, std::vector<int>& slots) const;

  const Pomdp& m_;
  Successors successors_;
  std::size_t width_;
  int actions_;
  int symbols_;
  int children_;  ///< A * O
  bool has_root_ = false;
  Bounds root_{0.0, 0.0, 0.0};
  int root_slot_ = -1;  ///< -1 while the root is a leaf
  int fresh_ = 0;       ///< slots from here on were never used
  std::vector<double> root_belief_;
  std::vector<int> free_;  ///< slots to be used again, with all that is below them
  AlignedArray<Slot> slots_;
  AlignedArray<Branch> branches_;     ///< (slots, A)
  AlignedArray<double> beliefs_;      ///< (slots, width)
  AlignedArray<double> probability_;  ///< (slots, A, O), and so on
  AlignedArray<double> lower_;
  AlignedArray<double> upper_;
  AlignedArray<double> priority_;
  AlignedArray<int> child_slots_;  ///< -1 for a leaf
};

}  // namespace fabric::planner
