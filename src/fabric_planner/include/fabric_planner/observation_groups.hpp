// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "fabric_planner/generative.hpp"

namespace fabric::planner {

/// Sorts items by their observation in linear time; groups come in the order of their first item.
class ObservationGroups {
 public:
  explicit ObservationGroups(int capacity);

  /// Groups items 0 .. count - 1, count <= capacity. @return the number of groups.
  int group(const Observation* observations, int count);
  [[nodiscard]] int size(int group) const { return sizes_[static_cast<std::size_t>(group)]; }
  /// The items, group after group, each group in their first order.
  [[nodiscard]] const std::int32_t* order() const { return order_.data(); }

 private:
  struct Slot {
    Observation key;
    std::uint32_t stamp;
    std::int32_t group;
  };
  int groupOf(Observation observation);
  void putInOrder(int count);

  std::vector<Slot> table_;  // open addressing; a slot counts when it bears the latest stamp
  std::uint32_t stamp_ = 0;
  std::vector<std::int32_t> labels_;  // per item: its group
  std::vector<std::int32_t> sizes_;   // per group
  std::vector<std::int32_t> starts_;  // per group
  std::vector<std::int32_t> order_;
  int groups_ = 0;
};

}  // namespace fabric::planner
