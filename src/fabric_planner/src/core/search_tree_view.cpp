// SPDX-License-Identifier: BSD-3-Clause
#include "search_tree.hpp"

namespace fabric::planner {

std::vector<TreeEntry> SearchTree::describe(int max_depth, double min_probability) const {
  std::vector<TreeEntry> entries;
  if (!has_root_) return entries;
  entries.push_back({-1, 0, -1, -1, 1.0, 1.0, root_.lower, root_.upper, expanded()});
  std::vector<int> slots{root_slot_};  // of each entry's belief, -1 for a leaf
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (slots[i] < 0 || entries[i].depth >= max_depth) continue;
    if (entries[i].isBelief()) {
      describeActions(static_cast<int>(i), slots[i], entries);
      slots.resize(entries.size(), slots[i]);
    } else {
      describeBeliefs(static_cast<int>(i), slots[i], min_probability, entries, slots);
    }
  }
  return entries;
}

void SearchTree::describeActions(int parent, int slot, std::vector<TreeEntry>& entries) const {
  const TreeEntry belief = entries[index(parent)];
  for (int a = 0; a < actions_; ++a) {
    const Branch& branch = branches_[index(slot * actions_ + a)];
    if (branch.best_child < 0) continue;
    int below = 0;
    for (int i = 0; i < symbols_; ++i) {
      const int child = child_slots_[index(slot * children_ + a * symbols_ + i)];
      below += child < 0 ? 0 : slots_[index(child)].size;
    }
    entries.push_back(
        {parent, belief.depth, a, -1, 1.0, belief.reach, branch.lower, branch.upper, below});
  }
}

void SearchTree::describeBeliefs(int parent, int slot, double min_probability,
                                 std::vector<TreeEntry>& entries, std::vector<int>& slots) const {
  const TreeEntry action = entries[index(parent)];
  for (int o = 0; o < symbols_; ++o) {
    const int node = slot * children_ + action.action * symbols_ + o;
    const double probability = probability_[index(node)];
    const double reach = action.reach * probability;
    if (probability <= 0.0 || reach < min_probability) continue;
    const int below = child_slots_[index(node)];
    const int size = below < 0 ? 0 : slots_[index(below)].size;
    entries.push_back({parent, action.depth + 1, action.action, o, probability, reach,
                       lower_[index(node)], upper_[index(node)], size});
    slots.push_back(below);
  }
}

}  // namespace fabric::planner
