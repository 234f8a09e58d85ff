// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "fabric_planner/lint.hpp"

namespace fabric::planner::linting {

/// A model with what several rules ask of it.
struct View {
  explicit View(const Pomdp& of);

  /// May the action be taken in this state, and can the state come up at all?
  [[nodiscard]] bool happens(int action, int state) const;

  const Pomdp& model;
  std::vector<bool> initial;           ///< (S,): possible at first
  std::vector<bool> reachable;         ///< (S,): possible at any time
  std::vector<SparseRows> O;           ///< per action (S', O), by rows
  std::vector<std::vector<bool>> hit;  ///< [a][s']: can the action lead there
};

using Findings = std::vector<Finding>;

/// "a, b, c and 7 more"
std::string listed(const std::vector<std::string>& names);

// One function a rule; each adds what it finds.
void findEndless(const View& view, Findings& findings);
void findRepeatedRewards(const View& view, Findings& findings);
void findOpenEnds(const View& view, Findings& findings);
void findOddRewards(const View& view, Findings& findings);
void findUnreachable(const View& view, Findings& findings);
void findIndistinguishable(const View& view, Findings& findings);
void findSilentActions(const View& view, Findings& findings);
void findUnusedObservations(const View& view, Findings& findings);
void findNeedlessActions(const View& view, Findings& findings);

}  // namespace fabric::planner::linting
