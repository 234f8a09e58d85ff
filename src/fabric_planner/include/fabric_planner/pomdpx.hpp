// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "fabric_planner/model_file.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Reads a POMDPX file (version 1.0 of the format, APPL, National University of Singapore).
///
/// Several action, state and observation variables are flattened by product, the first varying
/// slowest; names are joined by '/'. A state variable with fullyObs="true" is observed as it is,
/// beside the observation variables if there are any. Parameters are tables (TBL) with `*`, `-`,
/// `uniform` and `identity`, or decision diagrams (DD) with every kind of SubDAG and templates; a
/// <Var> may list several variables, whose joint distribution is then given. In a table a later
/// entry overrides an earlier one where they overlap, and the very same instance with another
/// table is refused. Values may be called by their number where no value has that name. Rewards
/// over (a, s, s', o) are kept as their expectation R(a, s). A finite <Horizon> is refused.
///
/// @param path the file; its ending does not matter.
/// @param normalise rescale rows that do not sum to 1 instead of refusing them.
/// @throw ModelError naming file, line, element, row and token.
Pomdp loadPomdpx(const std::string& path, bool normalise = false);

/// The same from the bytes of a file; name: the model's name. Errors do not begin with a file.
Pomdp parsePomdpx(std::string_view bytes, const std::string& name, bool normalise = false,
                  const FileLimits& limits = {});

/// Writes the model with one variable of each kind, numbers with all their digits: what is read
/// back equals it bit for bit, but for the name, which is that of the file.
/// @throw ModelError when the file cannot be written, and for what the format cannot say: action
/// sets that differ by state, names that are `*` or `-` or hold control characters.
void savePomdpx(const Pomdp& model, const std::string& path);

}  // namespace fabric::planner
