// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/model_file.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Reads alpha vectors from a .policy file of SARSOP (the format PolicyX, type "value"), with
/// <Vector> or <SparseVector> elements.
///
/// A policy over a mixed observability model (numObsValue > 1) gives each vector for one value of
/// the fully observed variables only; it is widened to all states, FORBIDDEN where that value is
/// another. Which states those are is told by the model's state names (parts joined by '/') and by
/// its observations.
///
/// @throw ModelError naming file, line, vector, state and token, also when sizes or actions do not
/// fit the model.
AlphaVectors loadPolicy(const std::string& path, const Pomdp& model);

/// The same from the bytes of a file. Errors do not begin with a file.
AlphaVectors parsePolicy(std::string_view bytes, const Pomdp& model, const FileLimits& limits = {});

/// Writes the vectors over all states, with the shortest digits that read back the same.
/// @throw ModelError when they do not fit the model or the file cannot be written.
void savePolicy(const AlphaVectors& policy, const Pomdp& model, const std::string& path);

}  // namespace fabric::planner
