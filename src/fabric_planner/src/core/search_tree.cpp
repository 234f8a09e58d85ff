// SPDX-License-Identifier: BSD-3-Clause
#include "search_tree.hpp"

#include <algorithm>
#include <limits>

namespace fabric::planner {
namespace {

constexpr double MAX_CHILDREN = 1 << 28;
constexpr double WORK_BETWEEN_LOOKS = 2e5;  // multiplications, some 0.1 ms

}  // namespace

bool Stopwatch::timeIsUp() {
  const double now = elapsed();
  longest_ = std::max(longest_, now - last_check_);
  last_check_ = now;
  return now + std::min(longest_, 0.1 * deadline_) >= deadline_;
}

SearchTree::SearchTree(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper,
                       int max_nodes)
    : m_(model), lower_(lower), upper_(upper) {
  const double children = static_cast<double>(max_nodes) * m_.numActions() * m_.numObservations();
  if (children > MAX_CHILDREN || static_cast<double>(max_nodes) * m_.numStates() > MAX_CHILDREN) {
    throw ModelError("max_nodes is " + std::to_string(max_nodes) + ", too many for " + m_.name());
  }
  const double column_work = static_cast<double>(m_.numStates()) *
                             static_cast<double>(lower_.vectors.rows() +
                                                 upper_.base().vectors.rows() + upper_.numPoints());
  block_ = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(WORK_BETWEEN_LOOKS / column_work), 1,
                                    m_.numObservations());
  nodes_.reserve(static_cast<size_t>(children) + 1);
  branches_.reserve(static_cast<size_t>(max_nodes) * static_cast<size_t>(m_.numActions()));
  beliefs_.resize(m_.numStates(), std::max(1, max_nodes));
  predicted_.resize(m_.numStates());
  joint_.resize(m_.numStates(), block_);
}

void SearchTree::start(const Eigen::VectorXd& belief) {
  nodes_.clear();
  branches_.clear();
  expanded_ = 0;
  beliefs_.col(0) = belief;
  const double lower = lower_.value(belief);
  const double upper = std::max(lower, upper_.value(belief));
  nodes_.push_back({lower, upper, 1.0, upper - lower, -1, -1, -1});
}

int SearchTree::mostImportantLeaf() const {
  int index = 0;
  while (nodes_[static_cast<size_t>(index)].slot >= 0) {
    const int first = nodes_[static_cast<size_t>(index)].slot * m_.numActions();
    int best = first;
    for (int b = first + 1; b < first + m_.numActions(); ++b) {
      if (branches_[static_cast<size_t>(b)].upper > branches_[static_cast<size_t>(best)].upper) {
        best = b;
      }
    }
    index = branches_[static_cast<size_t>(best)].best_child;
  }
  return index;
}

/// Bayes' rule from the parent's belief into the next free column.
void SearchTree::placeBelief(int index) {
  const Node& node = nodes_[static_cast<size_t>(index)];
  if (node.branch < 0) return;
  const Branch& branch = branches_[static_cast<size_t>(node.branch)];
  const int action = node.branch % m_.numActions();
  const int parent_slot = nodes_[static_cast<size_t>(branch.node)].slot;
  auto belief = beliefs_.col(expanded_);
  belief.noalias() = m_.T(action).transpose() * beliefs_.col(parent_slot);
  belief.array() *= Eigen::ArrayXd(Eigen::VectorXd(m_.O(action).col(node.observation)));
  belief /= belief.sum();
}

bool SearchTree::grow(Stopwatch& watch) {
  if (watch.timeIsUp()) return false;
  const int leaf = mostImportantLeaf();
  if (!expand(leaf, watch)) return false;
  backUp(leaf);
  return true;
}

bool SearchTree::expand(int index, Stopwatch& watch) {
  placeBelief(index);
  const size_t nodes_before = nodes_.size();
  const size_t branches_before = branches_.size();
  for (int a = 0; a < m_.numActions(); ++a) {
    if (addBranch(index, a, watch)) continue;
    nodes_.resize(nodes_before);
    branches_.resize(branches_before);
    return false;
  }
  nodes_[static_cast<size_t>(index)].slot = expanded_++;
  return true;
}

bool SearchTree::addBranch(int index, int action, Stopwatch& watch) {
  const auto belief = beliefs_.col(expanded_);
  predicted_.noalias() = m_.T(action).transpose() * belief;
  const int branch = static_cast<int>(branches_.size());
  branches_.push_back({m_.R().row(action).dot(belief), 0.0, 0.0, 0.0, index,
                       static_cast<int>(nodes_.size()), 0, -1});
  for (Eigen::Index first = 0; first < m_.numObservations(); first += block_) {
    if (block_ < m_.numObservations() && watch.timeIsUp()) return false;
    addChildren(branch, first, std::min<Eigen::Index>(block_, m_.numObservations() - first));
  }
  auto& added = branches_.back();
  added.children = static_cast<int>(nodes_.size()) - added.first_child;
  refreshBranch(added);
  return true;
}

/// Bounds the successors for observations first .. first + count - 1. Both bounds are homogeneous,
/// so that they may be taken at P(s', o | b, a) and divided by its sum afterwards.
void SearchTree::addChildren(int branch, Eigen::Index first, Eigen::Index count) {
  const int action = branch % m_.numActions();
  auto joint = joint_.leftCols(count);
  joint = m_.O(action).middleCols(first, count);
  joint.array().colwise() *= predicted_.array();
  scores_.noalias() = lower_.vectors * joint;
  const Eigen::RowVectorXd lower = scores_.colwise().maxCoeff();
  for (Eigen::Index i = 0; i < count; ++i) {
    const double probability = joint.col(i).sum();
    if (probability < std::numeric_limits<double>::min()) continue;
    Node child{lower(i) / probability,
               upper_.value(joint.col(i)) / probability,
               probability,
               0.0,
               branch,
               static_cast<int>(first + i),
               -1};
    child.upper = std::max(child.upper, child.lower);
    child.priority = child.upper - child.lower;
    nodes_.push_back(child);
  }
}

void SearchTree::refreshBranch(Branch& branch) {
  double lower = 0.0;
  double upper = 0.0;
  double priority = -1.0;
  for (int i = branch.first_child; i < branch.first_child + branch.children; ++i) {
    const Node& child = nodes_[static_cast<size_t>(i)];
    lower += child.probability * child.lower;
    upper += child.probability * child.upper;
    const double weighted = child.probability * child.priority;
    if (weighted <= priority) continue;
    priority = weighted;
    branch.best_child = i;
  }
  branch.lower = branch.reward + m_.discount() * lower;
  branch.upper = branch.reward + m_.discount() * upper;
  branch.priority = m_.discount() * priority;
}

/// A node may keep a bound that is better than its branches': both hold.
void SearchTree::refreshNode(Node& node) {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = lower;
  const int first = node.slot * m_.numActions();
  for (int b = first; b < first + m_.numActions(); ++b) {
    const Branch& branch = branches_[static_cast<size_t>(b)];
    lower = std::max(lower, branch.lower);
    if (branch.upper <= upper) continue;
    upper = branch.upper;
    node.priority = branch.priority;
  }
  node.lower = std::max(node.lower, lower);
  node.upper = std::max(node.lower, std::min(node.upper, upper));
}

void SearchTree::backUp(int index) {
  for (;;) {
    Node& node = nodes_[static_cast<size_t>(index)];
    refreshNode(node);
    if (node.branch < 0) return;
    Branch& branch = branches_[static_cast<size_t>(node.branch)];
    refreshBranch(branch);
    index = branch.node;
  }
}

Eigen::VectorXd SearchTree::actionLower() const {
  Eigen::VectorXd values(m_.numActions());
  for (int a = 0; a < m_.numActions(); ++a) values(a) = branches_[static_cast<size_t>(a)].lower;
  return values;
}

Eigen::VectorXd SearchTree::actionUpper() const {
  Eigen::VectorXd values(m_.numActions());
  for (int a = 0; a < m_.numActions(); ++a) values(a) = branches_[static_cast<size_t>(a)].upper;
  return values;
}

}  // namespace fabric::planner
