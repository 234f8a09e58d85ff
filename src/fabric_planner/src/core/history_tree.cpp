// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/history_tree.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {
namespace {

constexpr std::size_t FEWEST = 16;         // histories worth a search
constexpr std::size_t MOST = 0x40000000U;  // so that slots fit 32 bits with few actions

}  // namespace

HistoryTree::HistoryTree(int actions, std::size_t memory)
    : actions_(static_cast<std::uint32_t>(std::max(actions, 1))) {
  const std::size_t node = sizeof(Node) + actions_ * sizeof(Edge);
  std::size_t entries = 2 * FEWEST;  // a power of two, half of it used at most
  const auto bytesFor = [&](std::size_t n) { return n * sizeof(Entry) + n / 2 * node; };
  if (memory < bytesFor(entries)) {
    throw ModelError("POMCP: memory is " + std::to_string(memory) +
                     " bytes, expected >= " + std::to_string(bytesFor(entries)));
  }
  while (bytesFor(2 * entries) <= memory && entries < MOST / actions_) entries *= 2;
  // What the power of two leaves over goes into longer chains of the table.
  const std::size_t left = (memory - bytesFor(entries)) / node;
  const std::size_t nodes = std::min(entries / 2 + left, entries / 4 * 3);
  nodes_.resize(nodes);
  edges_.resize(nodes * actions_);
  table_.resize(entries);
  mask_ = entries - 1;
}

void HistoryTree::forgetTable() {
  std::fill(table_.begin(), table_.end(), Entry{0, 0});
  generation_ = 1;
}

bool HistoryTree::moveRoot(int action, Observation observation) {
  if (size_ == 0) return false;
  const std::uint32_t parent = slot(root_, action);
  for (std::size_t at = home(parent, observation); isUsed(table_[at]); at = (at + 1) & mask_) {
    const std::uint32_t found = table_[at].node;
    if (nodes_[found].parent != parent || nodes_[found].observation != observation) continue;
    root_ = found;
    return true;
  }
  return false;
}

int HistoryTree::choose(std::uint32_t node, double exploration) const {
  const Edge* edges = &edges_[node * static_cast<std::size_t>(actions_)];
  const double width =
      exploration * std::sqrt(std::log(static_cast<float>(nodes_[node].visits) + 1.0F));
  int best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::uint32_t a = 0; a < actions_; ++a) {
    if (edges[a].scale < 0.0F) continue;
    if (edges[a].visits == 0) return static_cast<int>(a);
    const double bound = edges[a].value + width * static_cast<double>(edges[a].scale);
    if (bound > most) {
      most = bound;
      best = static_cast<int>(a);
    }
  }
  return best;
}

HistoryTree::Best HistoryTree::bestActions() const {
  Best best;
  double second = 0.0;
  for (std::uint32_t a = 0; a < actions_; ++a) {
    const Edge& edge = edges_[root_ * static_cast<std::size_t>(actions_) + a];
    if (edge.visits == 0) continue;
    if (best.first < 0 || edge.value > best.value) {
      best.second = best.first;
      second = best.value;
      best.first = static_cast<int>(a);
      best.value = edge.value;
    } else if (best.second < 0 || edge.value > second) {
      best.second = static_cast<int>(a);
      second = edge.value;
    }
  }
  best.gap = best.second < 0 ? 0.0 : best.value - second;
  return best;
}

std::size_t HistoryTree::bytes() const {
  return nodes_.size() * sizeof(Node) + edges_.size() * sizeof(Edge) +
         table_.size() * sizeof(Entry);
}

}  // namespace fabric::planner
