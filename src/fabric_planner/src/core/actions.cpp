// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/actions.hpp"

#include <cctype>
#include <map>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {
namespace {

const std::array<std::string, 5> NAMES = {"idle", "planning", "point", "grasp", "cancel"};

// Lower case without separators.
const std::map<std::string, Action> ALIASES = {
    {"idle", Action::IDLE},
    {"planning", Action::PLANNING},
    {"graspplanning", Action::PLANNING},
    {"planningforgrasping", Action::PLANNING},
    {"planningforagrasp", Action::PLANNING},
    {"point", Action::POINT},
    {"pointtoremind", Action::POINT},
    {"pointtoremindhuman", Action::POINT},
    {"grasp", Action::GRASP},
    {"cancel", Action::CANCEL},
    {"cancelaction", Action::CANCEL},
    {"cancelallactions", Action::CANCEL},
};

std::string squeezed(const std::string& name) {
  std::string letters;
  for (const unsigned char c : name) {
    if (c != ' ' && c != '_' && c != '-') letters += static_cast<char>(std::tolower(c));
  }
  return letters;
}

}  // namespace

std::string actionName(Action action) { return NAMES.at(static_cast<std::size_t>(action)); }

Action actionFromName(const std::string& name) {
  const auto found = ALIASES.find(squeezed(name));
  if (found != ALIASES.end()) return found->second;
  throw ModelError("unknown action '" + name +
                   "'; known: idle, planning, point, grasp, cancel and their original names");
}

Action actionFromNumber(int number) {
  if (number >= 0 && number < static_cast<int>(ALL_ACTIONS.size())) return ALL_ACTIONS[number];
  throw ModelError("action " + std::to_string(number) + " is none of 0 (idle) to 4 (cancel)");
}

}  // namespace fabric::planner
