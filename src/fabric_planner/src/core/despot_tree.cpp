// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/despot_tree.hpp"

#include <algorithm>
#include <limits>

namespace fabric::planner {

DespotNode* DespotTree::clear() {
  arena_.release(0);
  root_ = arena_.take<DespotNode>(1);
  if (root_ != nullptr) *root_ = DespotNode{};
  return root_;
}

void DespotTree::bound(DespotNode& node, double floor, double plain_upper) const {
  node.floor = floor;
  node.lower = floor;
  // A relaxation bounds the model, not these few scenarios: the default policy may beat it here.
  node.plain_upper = std::max(floor, plain_upper);
  node.upper = node.depth < options_.depth ? std::max(floor, plain_upper - options_.price) : floor;
}

DespotEdge& DespotTree::promising(const DespotNode& node) {
  return *std::max_element(
      node.edges, node.edges + node.num_edges,
      [](const DespotEdge& a, const DespotEdge& b) { return a.upper < b.upper; });
}

DespotNode* DespotTree::uncertain(const DespotEdge& edge) const {
  const double enough = options_.target * (root_->upper - root_->lower) / options_.scenarios;
  DespotNode* best = nullptr;
  double most = 0.0;
  for (int i = 0; i < edge.num_children; ++i) {
    DespotNode& child = edge.children[i];
    const double excess = child.upper - child.lower - child.count * enough;
    if (excess > most) {
      most = excess;
      best = &child;
    }
  }
  return best;
}

void DespotTree::sum(DespotEdge& edge) {
  edge.lower = edge.upper = edge.reward;
  for (int i = 0; i < edge.num_children; ++i) {
    edge.lower += edge.children[i].lower;
    edge.upper += edge.children[i].upper;
    edge.plain_upper += edge.children[i].plain_upper;
  }
  edge.simulated = true;
}

void DespotTree::refresh(DespotNode& node) {
  const DespotNode before = node;
  node.upper = node.plain_upper = node.floor;
  for (int i = 0; i < node.num_edges; ++i) {
    const DespotEdge& edge = node.edges[i];
    node.lower = std::max(node.lower, edge.lower);
    node.upper = std::max(node.upper, edge.upper);
    node.plain_upper = std::max(node.plain_upper, edge.plain_upper);
  }
  node.upper = std::max(node.lower, std::min(node.upper, before.upper));
  node.plain_upper = std::min(node.plain_upper, before.plain_upper);
  if (node.parent == nullptr) return;
  node.parent->lower += node.lower - before.lower;
  node.parent->upper += node.upper - before.upper;
  node.parent->plain_upper += node.plain_upper - before.plain_upper;
}

void DespotTree::backUp(DespotNode* node) {
  for (; node != nullptr; node = node->parent != nullptr ? node->parent->node : nullptr) {
    if (node->edges != nullptr) refresh(*node);
  }
}

void DespotTree::close(DespotNode& node) {
  if (node.parent != nullptr) {
    node.parent->lower += node.floor - node.lower;
    node.parent->upper += node.floor - node.upper;
    node.parent->plain_upper += node.floor - node.plain_upper;
  }
  node.lower = node.upper = node.plain_upper = node.floor;
}

bool DespotTree::blocked(const DespotNode& node) const {
  for (const DespotNode* above = &node;; above = above->parent->node) {
    const int between = node.depth - above->depth + 1;
    if (above->plain_upper - above->floor <= options_.price * between) return true;
    if (above->parent == nullptr) return false;
  }
}

void DespotTree::choose(Decision& decision) const {
  decision.action = root_->default_action;
  decision.value = root_->floor;
  double second = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < root_->num_edges; ++i) {
    const DespotEdge& edge = root_->edges[i];
    if (edge.action == decision.action) {
      decision.value = std::max(decision.value, edge.lower);
    } else if (edge.lower > decision.value) {
      second = decision.value;
      decision.runner_up = decision.action;
      decision.action = edge.action;
      decision.value = edge.lower;
    } else if (edge.simulated && edge.lower > second) {
      second = edge.lower;
      decision.runner_up = edge.action;
    }
  }
  if (decision.runner_up >= 0) decision.runner_up_gap = decision.value - second;
  decision.lower_bound = root_->lower;
  decision.upper_bound = root_->upper;
}

}  // namespace fabric::planner
