// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "fabric_planner/model_file.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Reads a file of A. R. Cassandra's format (.pomdp, as for pomdp-solve).
///
/// Everything of the format is understood: names or counts; values: reward or cost (costs become
/// negative rewards); start as distribution, `uniform`, one state, `include:` or `exclude:`;
/// T, O and R as single numbers, rows and matrices with `*`, `uniform`, `identity` and `reset`
/// (the start distribution); comments; numbers in place of names. What is said last holds.
/// Without `start` every state is equally likely at first, as the format has it. Rewards are kept
/// as their expectation R(a, s).
///
/// Without `observations` it is an MDP: the state is observed, there is no O, and R is given
/// over (a, s, s').
///
/// @param path the file; its ending does not matter.
/// @param normalise rescale rows that do not sum to 1 instead of refusing them.
/// @throw ModelError naming file, line, element, row and token.
Pomdp loadPomdpFile(const std::string& path, bool normalise = false);

/// The same from the bytes of a file; name: the model's name. Errors do not begin with a file.
Pomdp parsePomdpFile(std::string_view bytes, const std::string& name, bool normalise = false,
                     const FileLimits& limits = {});

}  // namespace fabric::planner
