// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/observation_groups.hpp"

#include <algorithm>
#include <numeric>

namespace fabric::planner {
namespace {

std::size_t tableSize(int capacity) {
  std::size_t size = 16;
  while (size < 2 * static_cast<std::size_t>(capacity)) size *= 2;
  return size;
}

}  // namespace

ObservationGroups::ObservationGroups(int capacity)
    : table_(tableSize(capacity), Slot{0, 0, 0}),
      labels_(static_cast<std::size_t>(capacity)),
      sizes_(static_cast<std::size_t>(capacity)),
      starts_(static_cast<std::size_t>(capacity)),
      order_(static_cast<std::size_t>(capacity)) {}

int ObservationGroups::group(const Observation* observations, int count) {
  if (count == 0) return 0;
  const bool same = std::all_of(observations + 1, observations + count,
                                [&](Observation o) { return o == observations[0]; });
  if (same) {
    std::iota(order_.begin(), order_.begin() + count, 0);
    sizes_[0] = count;
    return 1;
  }
  if (++stamp_ == 0) {  // the stamps went round
    std::fill(table_.begin(), table_.end(), Slot{0, 0, 0});
    stamp_ = 1;
  }
  groups_ = 0;
  for (int i = 0; i < count; ++i) {
    const int group = groupOf(observations[i]);
    labels_[static_cast<std::size_t>(i)] = group;
    ++sizes_[static_cast<std::size_t>(group)];
  }
  putInOrder(count);
  return groups_;
}

int ObservationGroups::groupOf(Observation observation) {
  const std::size_t mask = table_.size() - 1;
  std::size_t i = mixBits(observation) & mask;
  while (table_[i].stamp == stamp_ && table_[i].key != observation) i = (i + 1) & mask;
  if (table_[i].stamp != stamp_) {
    table_[i] = Slot{observation, stamp_, groups_};
    sizes_[static_cast<std::size_t>(groups_)] = 0;
    ++groups_;
  }
  return table_[i].group;
}

void ObservationGroups::putInOrder(int count) {
  std::int32_t start = 0;
  for (int g = 0; g < groups_; ++g) {
    starts_[static_cast<std::size_t>(g)] = start;
    start += sizes_[static_cast<std::size_t>(g)];
  }
  for (int i = 0; i < count; ++i) {
    const auto group = static_cast<std::size_t>(labels_[static_cast<std::size_t>(i)]);
    order_[static_cast<std::size_t>(starts_[group]++)] = i;
  }
}

}  // namespace fabric::planner
