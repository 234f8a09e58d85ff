// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// What a reader may build before it refuses to go on; so a small hostile file cannot fill the
/// memory. All are counts, >= 1.
struct FileLimits {
  std::size_t values = std::size_t{1} << 20;   ///< states, actions, observations: of each
  std::size_t entries = std::size_t{1} << 26;  ///< numbers kept of all tables together
};

/// Reads a model from a file of any of the formats: POMDPX when its first character is `<`, else
/// Cassandra's .pomdp. The file's ending does not matter.
/// @param normalise rescale rows that do not sum to 1 instead of refusing them.
/// @throw ModelError naming file, line, element, row and token.
Pomdp loadModel(const std::string& path, bool normalise = false);

}  // namespace fabric::planner
