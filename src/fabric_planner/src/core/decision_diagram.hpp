// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "factor.hpp"
#include "xml.hpp"

namespace fabric::planner {

/// Fills a table from POMDPX's <Parameter type="DD">: one <DAG> of <Node>, <Edge>, <Terminal> and
/// <SubDAG> (deterministic, persistent, uniform, template), and any number of <SubDAGTemplate>.
///
/// A path from the root to a <Terminal> sets all numbers that agree with the values on its edges;
/// a variable not met on the path does not matter. Values without an edge are left as they are.
///
/// previous: for the name of a state variable after the step, its name before it; else empty.
/// @throw ModelError naming line, variable and value.
void readDiagram(const xml::XMLElement& parameter, Factor& factor,
                 const std::function<std::string(const std::string&)>& previous);

}  // namespace fabric::planner
