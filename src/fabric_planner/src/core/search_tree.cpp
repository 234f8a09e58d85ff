// SPDX-License-Identifier: BSD-3-Clause
#include "search_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fabric::planner {
namespace {

constexpr double MAX_CHILDREN = 1 << 28;
constexpr double SAME_BELIEF = 1e-9;  // largest difference of an entry that rounding may cause
constexpr double LOWEST = -std::numeric_limits<double>::infinity();

}  // namespace

SearchTree::SearchTree(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper,
                       int max_nodes)
    : m_(model),
      successors_(model, lower, upper),
      width_(static_cast<std::size_t>(successors_.width())),
      actions_(model.numActions()),
      symbols_(model.numObservations()),
      children_(actions_ * symbols_),
      root_belief_(width_) {
  const auto slots = static_cast<std::size_t>(std::max(1, max_nodes));
  if (static_cast<double>(slots) * std::max<double>(children_, m_.numStates()) > MAX_CHILDREN) {
    throw ModelError("max_nodes is " + std::to_string(max_nodes) + ", too many for " + m_.name());
  }
  free_.reserve(slots);
  slots_ = AlignedArray<Slot>(slots);
  branches_ = AlignedArray<Branch>(slots * index(actions_));
  beliefs_ = AlignedArray<double>(slots * width_);
  probability_ = AlignedArray<double>(slots * index(children_));
  lower_ = AlignedArray<double>(slots * index(children_));
  upper_ = AlignedArray<double>(slots * index(children_));
  priority_ = AlignedArray<double>(slots * index(children_));
  child_slots_ = AlignedArray<int>(slots * index(children_));
}

void SearchTree::clear() {
  has_root_ = false;
  root_slot_ = -1;
  fresh_ = 0;
  free_.clear();
}

void SearchTree::start(const Eigen::VectorXd& belief) {
  clear();
  has_root_ = true;
  std::copy(belief.data(), belief.data() + belief.size(), root_belief_.begin());
  successors_.boundsAt(root_belief_.data(), root_.lower, root_.upper);
  root_.priority = root_.upper - root_.lower;
}

void SearchTree::advance(int action, int observation) {
  if (!has_root_ || root_slot_ < 0) return clear();
  const int old_root = root_slot_;
  const int node = old_root * children_ + action * symbols_ + observation;
  if (probability_[index(node)] <= 0.0 ||
      !successors_.follow(beliefOf(old_root), action, observation, root_belief_.data())) {
    return clear();
  }
  root_ = boundsOf(node);
  root_slot_ = child_slots_[index(node)];
  child_slots_[index(node)] = -1;
  if (root_slot_ >= 0) slots_[index(root_slot_)].node = ROOT;
  giveBack(old_root);
}

const double* SearchTree::rootBelief() const {
  return root_slot_ < 0 ? root_belief_.data() : beliefOf(root_slot_);
}

bool SearchTree::isAt(const Eigen::VectorXd& belief) const {
  if (!has_root_) return false;
  const double* root = rootBelief();
  for (Eigen::Index s = 0; s < belief.size(); ++s) {
    if (!(std::abs(root[s] - belief(s)) <= SAME_BELIEF)) return false;
  }
  return true;
}

SearchTree::Bounds SearchTree::boundsOf(int node) const {
  if (node == ROOT) return root_;
  return {lower_[index(node)], upper_[index(node)], priority_[index(node)]};
}

void SearchTree::setBounds(int node, const Bounds& bounds) {
  if (node == ROOT) {
    root_ = bounds;
    return;
  }
  lower_[index(node)] = bounds.lower;
  upper_[index(node)] = bounds.upper;
  priority_[index(node)] = bounds.priority;
}

int SearchTree::takeSlot() {
  if (free_.empty()) return fresh_++;
  const int slot = free_.back();
  free_.pop_back();
  const int* below = child_slots_.data() + index(slot) * index(children_);
  for (int i = 0; i < children_; ++i) {
    if (below[i] >= 0) free_.push_back(below[i]);
  }
  return slot;
}

void SearchTree::giveBack(int slot) { free_.push_back(slot); }

int SearchTree::mostImportantLeaf() const {
  int node = ROOT;
  for (int slot = root_slot_; slot >= 0; slot = slotOf(node)) {
    node = branches_[index(slot * actions_ + slots_[index(slot)].best_branch)].best_child;
  }
  return node;
}

bool SearchTree::grow(Stopwatch& watch) {
  if (watch.timeIsUp()) return false;
  return expand(mostImportantLeaf(), watch);
}

bool SearchTree::expand(int node, Stopwatch& watch) {
  const int slot = takeSlot();
  slots_[index(slot)] = {node, 0, 0};
  std::fill_n(child_slots_.data() + index(slot) * index(children_), children_, -1);
  double* belief = beliefOf(slot);
  if (node == ROOT) {
    std::copy(root_belief_.begin(), root_belief_.end(), belief);
  } else {
    const int parent = node / children_;
    successors_.follow(beliefOf(parent), node % children_ / symbols_, node % symbols_, belief);
  }
  if (!fillIn(slot, watch)) {
    giveBack(slot);
    return false;
  }
  (node == ROOT ? root_slot_ : child_slots_[index(node)]) = slot;
  backUp(slot);
  return true;
}

bool SearchTree::fillIn(int slot, Stopwatch& watch) {
  const std::size_t first = index(slot) * index(children_);
  if (!successors_.bound(beliefOf(slot), watch, &probability_[first], &lower_[first],
                         &upper_[first])) {
    return false;
  }
  for (std::size_t i = first; i < first + index(children_); ++i) {
    priority_[i] = upper_[i] - lower_[i];
  }
  const Eigen::Map<const Eigen::VectorXd> belief(beliefOf(slot), m_.numStates());
  for (int a = 0; a < actions_; ++a) {
    Branch& branch = branches_[index(slot * actions_ + a)];
    if (m_.isAllowed(a, belief)) {
      branch.reward = successors_.reward(belief.data(), a);
      refreshBranch(slot, a);
    } else {
      branch = {LOWEST, LOWEST, LOWEST, LOWEST, -1};
    }
  }
  return true;
}

void SearchTree::refreshBranch(int slot, int action) {
  double lower = 0.0;
  double upper = 0.0;
  double priority = -1.0;
  Branch& branch = branches_[index(slot * actions_ + action)];
  const int first = slot * children_ + action * symbols_;
  for (int i = first; i < first + symbols_; ++i) {
    const double probability = probability_[index(i)];
    lower += probability * lower_[index(i)];
    upper += probability * upper_[index(i)];
    const double weighted = probability * priority_[index(i)];
    if (probability <= 0.0 || weighted <= priority) continue;
    priority = weighted;
    branch.best_child = i;
  }
  branch.lower = branch.reward + m_.discount() * lower;
  branch.upper = branch.reward + m_.discount() * upper;
  branch.priority = m_.discount() * priority;
}

/// A belief may keep a bound that is better than its branches': both hold.
void SearchTree::refreshSlot(int slot) {
  Slot& at = slots_[index(slot)];
  Bounds bounds = boundsOf(at.node);
  double lower = LOWEST;
  double upper = LOWEST;
  bounds.priority = 0.0;  // stays where no action is allowed, so that nobody looks further there
  for (int a = 0; a < actions_; ++a) {
    const Branch& branch = branches_[index(slot * actions_ + a)];
    lower = std::max(lower, branch.lower);
    if (branch.upper <= upper) continue;
    upper = branch.upper;
    bounds.priority = branch.priority;
    at.best_branch = a;
  }
  if (upper == LOWEST) return setBounds(at.node, bounds);
  bounds.lower = std::max(bounds.lower, lower);
  bounds.upper = std::max(bounds.lower, std::min(bounds.upper, upper));
  setBounds(at.node, bounds);
}

void SearchTree::backUp(int slot) {
  for (;;) {
    ++slots_[index(slot)].size;
    refreshSlot(slot);
    const int node = slots_[index(slot)].node;
    if (node == ROOT) return;
    slot = node / children_;
    refreshBranch(slot, node % children_ / symbols_);
  }
}

double SearchTree::actionLower(int action) const {
  return branches_[index(root_slot_ * actions_ + action)].lower;
}

double SearchTree::actionUpper(int action) const {
  return branches_[index(root_slot_ * actions_ + action)].upper;
}

}  // namespace fabric::planner
