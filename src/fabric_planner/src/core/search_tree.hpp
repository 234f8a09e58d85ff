// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <chrono>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// A deadline on the steady clock that leaves room for the longest stretch of work seen so far.
class Stopwatch {
 public:
  explicit Stopwatch(double deadline) : deadline_(deadline), begin_(Clock::now()) {}

  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(Clock::now() - begin_).count();
  }
  /// True when another stretch as long as the longest might not end in time.
  bool timeIsUp();

 private:
  using Clock = std::chrono::steady_clock;
  double deadline_;
  Clock::time_point begin_;
  double last_check_ = 0.0;
  double longest_ = 0.0;
};

/// The and-or tree of one search. Nodes live in arrays that keep their memory between searches.
class SearchTree {
 public:
  /// lower, upper: must outlive the tree. @throw ModelError when max_nodes is too many.
  SearchTree(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper,
             int max_nodes);

  /// Forgets everything but the root. belief: (S,), sums to 1.
  void start(const Eigen::VectorXd& belief);

  /// Expands the most important leaf and brings its news to the root.
  /// @return false when time was up first; the tree is then as before.
  bool grow(Stopwatch& watch);

  [[nodiscard]] int expanded() const { return expanded_; }
  /// True when no leaf has a gap left that matters to the root.
  [[nodiscard]] bool exhausted() const { return expanded_ > 0 && nodes_[0].priority <= 0.0; }
  [[nodiscard]] double lower() const { return nodes_[0].lower; }
  [[nodiscard]] double upper() const { return nodes_[0].upper; }
  /// (A,): bounds of each action at the root, once it is expanded.
  [[nodiscard]] Eigen::VectorXd actionLower() const;
  [[nodiscard]] Eigen::VectorXd actionUpper() const;

 private:
  /// A belief, reached from its parent's by a branch's action and an observation.
  struct Node {
    double lower;
    double upper;
    double probability;  ///< of the observation, given parent and action
    double priority;     ///< largest discounted, weighted gap of a leaf below
    int branch;          ///< that led here, -1 at the root
    int observation;
    int slot;  ///< of its belief and branches, -1 for a leaf
  };
  /// An action at a belief. The branches of slot k are k * A .. k * A + A - 1.
  struct Branch {
    double reward;
    double lower;
    double upper;
    double priority;
    int node;
    int first_child;
    int children;
    int best_child;
  };

  [[nodiscard]] int mostImportantLeaf() const;
  void placeBelief(int node);
  bool expand(int node, Stopwatch& watch);
  bool addBranch(int node, int action, Stopwatch& watch);
  void addChildren(int branch, Eigen::Index first, Eigen::Index count);
  void refreshBranch(Branch& branch);
  void refreshNode(Node& node);
  void backUp(int node);

  const Pomdp& m_;
  const AlphaVectors& lower_;
  const PointUpperBound& upper_;
  Eigen::Index block_;  ///< observations bounded between two looks at the clock
  int expanded_ = 0;
  std::vector<Node> nodes_;
  std::vector<Branch> branches_;
  Eigen::MatrixXd beliefs_;  ///< (S, max_nodes), one column a slot
  Eigen::VectorXd predicted_;
  Eigen::MatrixXd joint_;  ///< (S, block): P(s', o | b, a)
  Eigen::MatrixXd scores_;
};

}  // namespace fabric::planner
