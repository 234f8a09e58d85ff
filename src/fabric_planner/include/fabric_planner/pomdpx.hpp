// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Reads a POMDPX file.
///
/// Several action, state and observation variables are flattened by product, the first varying
/// slowest; names are joined by '/'. A state variable with fullyObs="true" is observed as it is,
/// beside the observation variables if there are any. Tables are of type TBL with `*`, `-`,
/// `uniform` and `identity`; a later entry overrides an earlier one where they overlap, and the
/// very same instance with another table is refused. Rewards over (a, s, s', o) are kept as their
/// expectation R(a, s).
///
/// @param path the file; its ending does not matter.
/// @param normalise rescale rows that do not sum to 1 instead of refusing them.
/// @throw ModelError naming file, line, element, row and token.
Pomdp loadPomdpx(const std::string& path, bool normalise = false);

/// Writes the model with one variable of each kind, numbers with all their digits.
/// @throw ModelError when the file cannot be written.
void savePomdpx(const Pomdp& model, const std::string& path);

}  // namespace fabric::planner
