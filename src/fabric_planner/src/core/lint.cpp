// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/lint.hpp"

#include <algorithm>
#include <map>

#include "lint_rules.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace linting {
namespace {

using Names = std::vector<std::string>;
using Row = std::vector<std::pair<int, double>>;

Row rowOf(const SparseRows& table, int row) {
  Row entries;
  for (SparseRows::InnerIterator it(table, row); it; ++it) {
    entries.emplace_back(static_cast<int>(it.col()), it.value());
  }
  return entries;
}

void markReachable(const Pomdp& model, std::vector<bool>& reachable) {
  std::vector<int> open;
  for (int s = 0; s < model.numStates(); ++s) {
    if (reachable[static_cast<size_t>(s)]) open.push_back(s);
  }
  while (!open.empty()) {
    const int s = open.back();
    open.pop_back();
    for (int a = 0; a < model.numActions(); ++a) {
      if (model.allowed().size() > 0 && !model.allowed()(a, s)) continue;
      for (SparseRows::InnerIterator it(model.T(a), s); it; ++it) {
        const auto next = static_cast<size_t>(it.col());
        if (reachable[next]) continue;
        reachable[next] = true;
        open.push_back(static_cast<int>(it.col()));
      }
    }
  }
}

/// Do two actions do the same wherever both happen? They must be allowed in the same states.
bool doTheSame(const View& view, int a, int b) {
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (view.happens(a, s) != view.happens(b, s)) return false;
    if (view.happens(a, s) && rowOf(view.model.T(a), s) != rowOf(view.model.T(b), s)) return false;
  }
  for (int s = 0; s < view.model.numStates(); ++s) {
    const bool hit = view.hit[static_cast<size_t>(a)][static_cast<size_t>(s)];
    if (hit &&
        rowOf(view.O[static_cast<size_t>(a)], s) != rowOf(view.O[static_cast<size_t>(b)], s)) {
      return false;
    }
  }
  return true;
}

/// Is a nowhere better paid than b (1), the same everywhere (0), or better somewhere (-1)?
int worse(const View& view, int a, int b) {
  int result = 0;
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (!view.happens(a, s)) continue;
    const double gain = view.model.R()(a, s) - view.model.R()(b, s);
    if (gain > 0.0) return -1;
    if (gain < 0.0) result = 1;
  }
  return result;
}

}  // namespace

View::View(const Pomdp& of) : model(of) {
  for (int s = 0; s < model.numStates(); ++s) initial.push_back(model.initialBelief()(s) > 0.0);
  reachable = initial;
  markReachable(model, reachable);
  for (int a = 0; a < model.numActions(); ++a) {
    O.emplace_back(model.O(a));
    hit.emplace_back(initial.size(), false);
    for (int s = 0; s < model.numStates(); ++s) {
      if (!happens(a, s)) continue;
      for (SparseRows::InnerIterator it(model.T(a), s); it; ++it) {
        hit.back()[static_cast<size_t>(it.col())] = true;
      }
    }
  }
}

bool View::happens(int action, int state) const {
  return reachable[static_cast<size_t>(state)] &&
         (model.allowed().size() == 0 || model.allowed()(action, state));
}

std::string listed(const Names& names) {
  constexpr size_t SHOWN = 6;
  if (names.size() <= SHOWN + 1) return join(names, ", ");
  return join(Names(names.begin(), names.begin() + SHOWN), ", ") + " and " +
         std::to_string(names.size() - SHOWN) + " more";
}

void findUnreachable(const View& view, Findings& findings) {
  Names places;
  for (size_t s = 0; s < view.reachable.size(); ++s) {
    if (!view.reachable[s]) places.push_back(view.model.states()[s]);
  }
  if (places.empty()) return;
  findings.push_back({FindingKind::UNREACHABLE_STATE, Severity::WARNING, places,
                      "never entered from the initial belief: " + listed(places)});
}

void findIndistinguishable(const View& view, Findings& findings) {
  std::map<std::vector<Row>, Names> classes;
  for (int s = 0; s < view.model.numStates(); ++s) {
    const auto i = static_cast<size_t>(s);
    if (!view.reachable[i] || view.model.terminal()[i]) continue;
    std::vector<Row> rows;
    for (const auto& table : view.O) rows.push_back(rowOf(table, s));
    classes[std::move(rows)].push_back(view.model.states()[i]);
  }
  std::vector<Names> groups;
  for (const auto& [rows, names] : classes) {
    if (names.size() > 1) groups.push_back(names);
  }
  const auto place = [&](const Names& names) { return view.model.stateIndex(names[0]); };
  std::sort(groups.begin(), groups.end(),
            [&](const Names& x, const Names& y) { return place(x) < place(y); });
  constexpr size_t TOLD = 8;
  if (groups.size() > TOLD) {
    findings.push_back({FindingKind::INDISTINGUISHABLE_STATE, Severity::INFO, groups[0],
                        "no observation tells the states of " + std::to_string(groups.size()) +
                            " groups apart, the first of which is " + listed(groups[0])});
    return;
  }
  for (const auto& names : groups) {
    findings.push_back({FindingKind::INDISTINGUISHABLE_STATE, Severity::INFO, names,
                        "no observation tells these states apart: " + listed(names)});
  }
}

void findSilentActions(const View& view, Findings& findings) {
  if (view.model.numObservations() < 2) return;
  for (int a = 0; a < view.model.numActions(); ++a) {
    const auto i = static_cast<size_t>(a);
    Row first;
    int states = 0;
    bool silent = true;
    for (int s = 0; s < view.model.numStates() && silent; ++s) {
      if (!view.hit[i][static_cast<size_t>(s)]) continue;
      const Row row = rowOf(view.O[i], s);
      if (states++ == 0) first = row;
      silent = row == first;
    }
    if (!silent || states < 2) continue;
    const auto& name = view.model.actions()[i];
    findings.push_back({FindingKind::SILENT_ACTION,
                        Severity::INFO,
                        {name},
                        "the observation after " + name + " says nothing about the state"});
  }
}

void findUnusedObservations(const View& view, Findings& findings) {
  std::vector<bool> comes(static_cast<size_t>(view.model.numObservations()), false);
  for (size_t a = 0; a < view.O.size(); ++a) {
    for (int s = 0; s < view.model.numStates(); ++s) {
      if (!view.hit[a][static_cast<size_t>(s)]) continue;
      for (const auto& [o, p] : rowOf(view.O[a], s)) comes[static_cast<size_t>(o)] = true;
    }
  }
  Names places;
  for (size_t o = 0; o < comes.size(); ++o) {
    if (!comes[o]) places.push_back(view.model.observations()[o]);
  }
  if (places.empty()) return;
  findings.push_back({FindingKind::UNUSED_OBSERVATION, Severity::INFO, places,
                      "observations that never come: " + listed(places)});
}

void findNeedlessActions(const View& view, Findings& findings) {
  for (int a = 0; a < view.model.numActions(); ++a) {
    for (int b = 0; b < view.model.numActions(); ++b) {
      const int verdict = a == b ? -1 : worse(view, a, b);
      if (verdict < 0 || (verdict == 0 && b > a) || !doTheSame(view, a, b)) continue;
      const auto& name = view.model.actions()[static_cast<size_t>(a)];
      const auto& other = view.model.actions()[static_cast<size_t>(b)];
      const bool same = verdict == 0;
      findings.push_back({same ? FindingKind::DUPLICATE_ACTION : FindingKind::NEVER_BEST_ACTION,
                          Severity::WARNING,
                          {name, other},
                          name + (same ? " is the same as " : " does what ") + other +
                              (same ? " in all it does" : " does and never earns more")});
      break;
    }
  }
}

}  // namespace linting

std::vector<Finding> lint(const Pomdp& model) {
  const linting::View view(model);
  std::vector<Finding> findings;
  linting::findEndless(view, findings);
  linting::findRepeatedRewards(view, findings);
  linting::findOpenEnds(view, findings);
  linting::findOddRewards(view, findings);
  linting::findUnreachable(view, findings);
  linting::findIndistinguishable(view, findings);
  linting::findSilentActions(view, findings);
  linting::findUnusedObservations(view, findings);
  linting::findNeedlessActions(view, findings);
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& x, const Finding& y) { return x.severity > y.severity; });
  return findings;
}

std::string nameOf(FindingKind kind) {
  switch (kind) {
    case FindingKind::ENDLESS:
      return "endless";
    case FindingKind::REWARD_REPEATS:
      return "reward_repeats";
    case FindingKind::END_NOT_ABSORBING:
      return "end_not_absorbing";
    case FindingKind::ODD_REWARD:
      return "odd_reward";
    case FindingKind::UNREACHABLE_STATE:
      return "unreachable_state";
    case FindingKind::INDISTINGUISHABLE_STATE:
      return "indistinguishable_state";
    case FindingKind::SILENT_ACTION:
      return "silent_action";
    case FindingKind::UNUSED_OBSERVATION:
      return "unused_observation";
    case FindingKind::DUPLICATE_ACTION:
      return "duplicate_action";
    case FindingKind::NEVER_BEST_ACTION:
      return "never_best_action";
  }
  return "unknown";
}

std::string nameOf(Severity severity) {
  return severity == Severity::INFO ? "info"
                                    : (severity == Severity::WARNING ? "warning" : "error");
}

}  // namespace fabric::planner
