// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "fabric_planner/arena.hpp"
#include "fabric_planner/decision.hpp"

namespace fabric::planner {

struct DespotEdge;

/// A history, by the scenarios that lead to it. All values are shares of the root's: weighted by
/// |Phi_b| / K and discounted to the root.
struct DespotNode {
  double lower;        ///< l(b), of the regularised value
  double upper;        ///< mu(b), of the regularised value
  double plain_upper;  ///< U(b), of the value without the price of policy nodes
  double floor;        ///< l0(b): the default policy
  DespotEdge* parent;  ///< nullptr at the root
  DespotEdge* edges;   ///< nullptr at a leaf
  const void* states;
  const std::uint32_t* scenarios;
  std::int32_t count;  ///< |Phi_b|
  std::int32_t num_edges;
  std::int32_t depth;
  std::int32_t default_action;
};

/// An action at a node. Until it is simulated it is known by an upper bound only.
struct DespotEdge {
  double reward;  ///< immediate, the price of a policy node taken off
  double lower;
  double upper;
  double plain_upper;
  DespotNode* node;
  DespotNode* children;  ///< one for each observation
  std::int32_t num_children;
  std::int32_t action;
  bool simulated;
};

/// Numbers of the search that the tree needs.
struct DespotTreeOptions {
  double price = 0.0;   ///< lambda: of one policy node
  double target = 0.0;  ///< xi: the share of the root's gap that is good enough for the rest
  int scenarios = 1;    ///< K
  int depth = 1;        ///< D: no node below it is opened
};

/// The part of DESPOT that knows no model: bounds, where to look next, what to do in the end.
///
/// Ye, Somani, Hsu & Lee, "DESPOT: Online POMDP planning with regularization", JAIR 58 (2017),
/// Section 5: l(b) = max{l0(b), max_a rho(b, a) + sum l(b')} and the same for mu and U.
class DespotTree {
 public:
  DespotTree(std::size_t memory, DespotTreeOptions options) : arena_(memory), options_(options) {}

  /// Forgets everything. @return the root, whose values the caller sets; nullptr without room.
  DespotNode* clear();
  [[nodiscard]] Arena& arena() { return arena_; }
  [[nodiscard]] const Arena& arena() const { return arena_; }
  [[nodiscard]] const DespotNode& root() const { return *root_; }

  /// Sets the bounds of a new node from the value of the default policy and the upper bound.
  void bound(DespotNode& node, double floor, double plain_upper) const;
  /// The action with the largest mu.
  [[nodiscard]] static DespotEdge& promising(const DespotNode& node);
  /// The observation with the largest excess uncertainty,
  /// E(b) = mu(b) - l(b) - |Phi_b| / K xi (mu(b0) - l(b0)); nullptr when none is positive.
  [[nodiscard]] DespotNode* uncertain(const DespotEdge& edge) const;
  /// Puts the sums over the children into an edge just simulated.
  static void sum(DespotEdge& edge);
  /// Backs up one node, and the difference into the edge that leads to it.
  static void refresh(DespotNode& node);
  /// The same from a node up to the root.
  static void backUp(DespotNode* node);
  /// Leaves a node to the default policy.
  static void close(DespotNode& node);
  /// Would any policy below the node cost more than it can gain at some ancestor? Then the
  /// default policy is best there: U(b) - l0(b) <= lambda times the nodes from b to here.
  [[nodiscard]] bool blocked(const DespotNode& node) const;
  /// The root's answer.
  void choose(Decision& decision) const;

 private:
  Arena arena_;
  DespotTreeOptions options_;
  DespotNode* root_ = nullptr;
};

}  // namespace fabric::planner
