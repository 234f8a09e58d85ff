// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// The states of a mixed observability model as pairs: what is fully observed, and what is hidden.
struct ObservedSplit {
  std::vector<int> observed;  ///< (S,): index of the observed part, first variable slowest
  std::vector<int> hidden;    ///< (S,): index of the hidden part
};

/// Finds the pairs when there are that many values of each.
/// @throw ModelError when the model's states do not fall apart that way.
ObservedSplit splitObserved(const Pomdp& model, int observed_values, int hidden_values);

}  // namespace fabric::planner
