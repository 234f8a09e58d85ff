// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// What may be wrong with the meaning of a model whose numbers are all acceptable.
enum class FindingKind {
  ENDLESS,                  ///< discount 1, and states from which nothing ever ends
  REWARD_REPEATS,           ///< a reward that looks like that of an end is paid again and again
  END_NOT_ABSORBING,        ///< a state that looks like an end is left again
  ODD_REWARD,               ///< rewards whose sign looks wrong, or that decide nothing
  UNREACHABLE_STATE,        ///< never entered from the initial belief
  INDISTINGUISHABLE_STATE,  ///< states that no observation tells apart
  SILENT_ACTION,            ///< an action whose observation says nothing
  UNUSED_OBSERVATION,       ///< a symbol that never comes
  DUPLICATE_ACTION,         ///< an action that is another one in all it does
  NEVER_BEST_ACTION,        ///< an action that does what another one does, for less
};

enum class Severity {
  INFO,     ///< may well be meant
  WARNING,  ///< mostly a slip
  ERROR,    ///< the model has no finite value
};

struct Finding {
  FindingKind kind;
  Severity severity;
  std::vector<std::string> places;  ///< names of the states, actions or symbols it is about
  std::string sentence;             ///< names them and says why
};

/// Looks for what is allowed but seldom meant; the gravest first. Deterministic.
///
/// An end is known by its name (its last word, or that of a part between '/', is one of success,
/// fail, done, end, goal, ...) or by its structure: no initial state, stays there more often than
/// not, and no action makes a difference there. A reward repeats where a state that is no initial
/// one is absorbing and pays; or, in a model that has no end at all, where an action stays with at
/// least 1/2 and earns at least half the largest reward of the model, while coming there from
/// elsewhere earns as much.
/// Ends are not looked at for being told apart.
std::vector<Finding> lint(const Pomdp& model);

/// "end_not_absorbing" and so on.
std::string nameOf(FindingKind kind);
/// "info", "warning" or "error".
std::string nameOf(Severity severity);

}  // namespace fabric::planner
