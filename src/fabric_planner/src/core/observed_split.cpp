// SPDX-License-Identifier: BSD-3-Clause
#include "observed_split.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <unordered_map>

namespace fabric::planner {
namespace {

/// The values of each part of the states' names, by index: (parts, S).
using Parts = std::vector<std::vector<int>>;

Parts partsOf(const std::vector<std::string>& states) {
  Parts parts;
  std::vector<std::unordered_map<std::string, int>> known;
  for (size_t s = 0; s < states.size(); ++s) {
    size_t begin = 0;
    for (size_t i = 0; begin <= states[s].size(); ++i) {
      const auto end = std::min(states[s].find('/', begin), states[s].size());
      if (i == parts.size()) {
        parts.emplace_back(states.size(), -1);
        known.emplace_back();
      }
      const auto fresh = static_cast<int>(known[i].size());
      parts[i][s] = known[i].emplace(states[s].substr(begin, end - begin), fresh).first->second;
      begin = end + 1;
    }
  }
  return parts;
}

int sizeOf(const std::vector<int>& part) { return 1 + *std::max_element(part.begin(), part.end()); }

/// Do all states that one symbol can come from agree in this part?
bool isObserved(const Pomdp& model, const std::vector<int>& part) {
  for (int a = 0; a < model.numActions(); ++a) {
    for (int o = 0; o < model.numObservations(); ++o) {
      int value = -1;
      for (SparseColumns::InnerIterator it(model.O(a), o); it; ++it) {
        const int here = part[static_cast<size_t>(it.row())];
        if (value >= 0 && here != value) return false;
        value = here;
      }
    }
  }
  return true;
}

/// True when every state has each part, in the order of a product.
bool isProduct(const Parts& parts) {
  for (size_t s = 0; s < parts[0].size(); ++s) {
    long long index = 0;
    for (const auto& part : parts) {
      if (part[s] < 0) return false;
      index = index * sizeOf(part) + part[s];
      if (index > static_cast<long long>(s)) return false;
    }
    if (index != static_cast<long long>(s)) return false;
  }
  return true;
}

}  // namespace

ObservedSplit splitObserved(const Pomdp& model, int observed_values, int hidden_values) {
  const auto size = static_cast<size_t>(model.numStates());
  ObservedSplit split{std::vector<int>(size, 0), std::vector<int>(size, 0)};
  if (observed_values == 1 && hidden_values == model.numStates()) {
    std::iota(split.hidden.begin(), split.hidden.end(), 0);
    return split;
  }
  const auto parts = partsOf(model.states());
  if (isProduct(parts)) {
    int observed = 1;
    int hidden = 1;
    for (const auto& part : parts) {
      const bool seen = isObserved(model, part);
      auto& index = seen ? split.observed : split.hidden;
      for (size_t s = 0; s < size; ++s) index[s] = index[s] * sizeOf(part) + part[s];
      (seen ? observed : hidden) *= sizeOf(part);
    }
    if (observed == observed_values && hidden == hidden_values) return split;
  }
  throw ModelError("vectors of " + std::to_string(hidden_values) + " numbers for each of " +
                   std::to_string(observed_values) + " observed values do not fit the " +
                   std::to_string(model.numStates()) + " states of " + model.name());
}

}  // namespace fabric::planner
