// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <set>

#include "lint_rules.hpp"
#include "text.hpp"

namespace fabric::planner::linting {
namespace {

using WordSet = std::set<std::string>;

const WordSet SUCCESSES = {"success", "succeeded", "goal", "won", "win", "solved"};
const WordSet FAILURES = {"fail", "failed", "failure", "crash", "crashed", "dead", "lost"};
const WordSet ENDS = {"done",     "end",      "ended",     "terminal", "terminated", "finish",
                      "finished", "complete", "completed", "exit",     "over",       "absorbing"};

constexpr double STAYS = 0.5;   // an end keeps its state more often than not
constexpr double ALIKE = 0.02;  // actions that differ by less make no difference

/// The last word of a name in small letters: "GlobalSuccess" and "task_success" give "success".
std::string lastWord(const std::string& name) {
  size_t begin = name.size();
  while (begin > 0 && std::isalpha(static_cast<unsigned char>(name[begin - 1])) != 0) {
    --begin;
    const bool capital = std::isupper(static_cast<unsigned char>(name[begin])) != 0;
    const bool after_small =
        begin > 0 && std::islower(static_cast<unsigned char>(name[begin - 1])) != 0;
    if (capital && after_small) break;
  }
  std::string word = name.substr(begin);
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word;
}

/// Is the last word of one of the parts of a name among these?
bool isCalled(const std::string& name, const WordSet& words) {
  size_t begin = 0;
  while (begin <= name.size()) {
    const auto end = std::min(name.find('/', begin), name.size());
    if (words.count(lastWord(name.substr(begin, end - begin))) > 0) return true;
    begin = end + 1;
  }
  return false;
}

bool isCalledEnd(const std::string& name) {
  return isCalled(name, SUCCESSES) || isCalled(name, FAILURES) || isCalled(name, ENDS);
}

const std::string& stateName(const View& view, int s) {
  return view.model.states()[static_cast<size_t>(s)];
}

const std::string& actionName(const View& view, int a) {
  return view.model.actions()[static_cast<size_t>(a)];
}

/// P(s | s, a)
double stay(const View& view, int a, int s) { return view.model.T(a).coeff(s, s); }

bool isTerminal(const View& view, int s) { return view.model.terminal()[static_cast<size_t>(s)]; }

/// Stays for ever whatever is done.
bool isAbsorbing(const View& view, int s) {
  for (int a = 0; a < view.model.numActions(); ++a) {
    if (view.happens(a, s) && stay(view, a, s) < 1.0 - 1e-12) return false;
  }
  return true;
}

bool anyEnd(const View& view) {
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (view.reachable[static_cast<size_t>(s)] && isTerminal(view, s)) return true;
  }
  return false;
}

double largestReward(const View& view) { return view.model.R().maxCoeff(); }

/// Does some action lead to s from elsewhere, mostly, and earn at least that much?
bool arrivalEarns(const View& view, int s, double least) {
  for (int a = 0; a < view.model.numActions(); ++a) {
    for (int from = 0; from < view.model.numStates(); ++from) {
      if (from != s && view.happens(a, from) && view.model.R()(a, from) >= least &&
          view.model.T(a).coeff(from, s) >= STAYS) {
        return true;
      }
    }
  }
  return false;
}

void addRepeat(const View& view, int a, int s, Findings& findings) {
  const bool for_ever = isAbsorbing(view, s);
  findings.push_back(
      {FindingKind::REWARD_REPEATS,
       Severity::WARNING,
       {stateName(view, s)},
       "state " + stateName(view, s) + " is kept by " + actionName(view, a) + " with probability " +
           text(stay(view, a, s)) + " and pays " + text(view.model.R()(a, s)) + " each time" +
           (for_ever ? ", for ever: an end is absorbing and pays nothing once it is reached"
                     : ": if reaching it is a success, it is paid again at every step, because "
                       "it does not end there")});
}

/// Do all actions do nearly the same in s, with nearly the same reward?
bool noActionMatters(const View& view, int s, double range) {
  int first = -1;
  for (int a = 0; a < view.model.numActions(); ++a) {
    if (!view.happens(a, s)) continue;
    if (first < 0) first = a;
    if (std::abs(view.model.R()(a, s) - view.model.R()(first, s)) > ALIKE * range) return false;
    const Eigen::SparseVector<double, Eigen::RowMajor> gap =
        view.model.T(a).row(s) - view.model.T(first).row(s);
    if (gap.cwiseAbs().sum() > ALIKE) return false;
  }
  return true;
}

bool looksLikeEnd(const View& view, int s, double range) {
  if (view.model.numActions() < 2 || view.initial[static_cast<size_t>(s)]) return false;
  for (int a = 0; a < view.model.numActions(); ++a) {
    if (view.happens(a, s) && stay(view, a, s) < STAYS) return false;
  }
  return noActionMatters(view, s, range);
}

double leastStay(const View& view, int s) {
  double least = 1.0;
  for (int a = 0; a < view.model.numActions(); ++a) {
    if (view.happens(a, s)) least = std::min(least, stay(view, a, s));
  }
  return least;
}

/// The sign of the reward of every action in s: 1, -1, or 0 where they differ or are zero.
int signIn(const View& view, int s) {
  bool gains = true;
  bool costs = true;
  for (int a = 0; a < view.model.numActions(); ++a) {
    if (!view.happens(a, s)) continue;
    gains = gains && view.model.R()(a, s) > 0.0;
    costs = costs && view.model.R()(a, s) < 0.0;
  }
  return gains ? 1 : (costs ? -1 : 0);
}

void findOddSigns(const View& view, Findings& findings) {
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (!view.reachable[static_cast<size_t>(s)]) continue;
    const auto& name = stateName(view, s);
    const int sign = signIn(view, s);
    if (sign > 0 && isCalled(name, FAILURES)) {
      findings.push_back({FindingKind::ODD_REWARD,
                          Severity::WARNING,
                          {name},
                          "state " + name + " is called a failure, but every action earns there"});
    } else if (sign < 0 && isCalled(name, SUCCESSES)) {
      findings.push_back({FindingKind::ODD_REWARD,
                          Severity::WARNING,
                          {name},
                          "state " + name + " is called a success, but every action costs there"});
    }
  }
}

/// With ends in reach and every step before them paid, it is best never to end.
void findPaidDelay(const View& view, Findings& findings) {
  bool steps = false;
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (!view.reachable[static_cast<size_t>(s)] || isTerminal(view, s)) continue;
    if (signIn(view, s) <= 0) return;
    steps = true;
  }
  if (!steps || !anyEnd(view)) return;
  findings.push_back({FindingKind::ODD_REWARD,
                      Severity::WARNING,
                      {},
                      "every action earns something in every state but the ends, so that ending "
                      "never pays: costs without their minus sign?"});
}

}  // namespace

void findEndless(const View& view, Findings& findings) {
  if (view.model.discount() < 1.0) return;
  const int n = view.model.numStates();
  std::vector<bool> ends(static_cast<size_t>(n), false);
  for (int s = 0; s < n; ++s) ends[static_cast<size_t>(s)] = isTerminal(view, s);
  for (bool more = true; more;) {
    more = false;
    for (int a = 0; a < view.model.numActions(); ++a) {
      for (int s = 0; s < n; ++s) {
        if (ends[static_cast<size_t>(s)] || !view.happens(a, s)) continue;
        for (SparseRows::InnerIterator it(view.model.T(a), s); it; ++it) {
          if (!ends[static_cast<size_t>(it.col())]) continue;
          more = ends[static_cast<size_t>(s)] = true;
          break;
        }
      }
    }
  }
  std::vector<std::string> places;
  for (int s = 0; s < n; ++s) {
    const auto i = static_cast<size_t>(s);
    if (view.reachable[i] && !ends[i]) places.push_back(stateName(view, s));
  }
  if (places.empty()) return;
  findings.push_back({FindingKind::ENDLESS, Severity::ERROR, places,
                      "the discount is 1, but nothing ever ends from " + listed(places) +
                          ": rewards add up without limit"});
}

void findRepeatedRewards(const View& view, Findings& findings) {
  const double least = largestReward(view) / 2.0;
  const bool ends = anyEnd(view);
  for (int s = 0; s < view.model.numStates(); ++s) {
    const auto i = static_cast<size_t>(s);
    if (!view.reachable[i] || view.initial[i]) continue;
    int best = -1;
    for (int a = 0; a < view.model.numActions(); ++a) {
      if (!view.happens(a, s)) continue;
      const double reward = view.model.R()(a, s);
      const bool pays = isAbsorbing(view, s)
                            ? reward != 0.0
                            : reward > 0.0 && reward >= least && stay(view, a, s) >= STAYS;
      if (pays && (best < 0 || reward > view.model.R()(best, s))) best = a;
    }
    if (best < 0) continue;
    if (!isAbsorbing(view, s) && (ends || !arrivalEarns(view, s, least))) continue;
    addRepeat(view, best, s, findings);
  }
}

void findOpenEnds(const View& view, Findings& findings) {
  const double range = view.model.R().maxCoeff() - view.model.R().minCoeff();
  for (int s = 0; s < view.model.numStates(); ++s) {
    if (!view.reachable[static_cast<size_t>(s)] || isAbsorbing(view, s)) continue;
    const auto& name = stateName(view, s);
    const bool called = isCalledEnd(name);
    if (!called && !looksLikeEnd(view, s, range)) continue;
    findings.push_back({FindingKind::END_NOT_ABSORBING,
                        called ? Severity::WARNING : Severity::INFO,
                        {name},
                        "state " + name +
                            (called ? " is called an end"
                                    : " looks like an end, as no action "
                                      "makes a difference there") +
                            ", but it is left again (it stays with " + text(leastStay(view, s)) +
                            ")"});
  }
}

void findOddRewards(const View& view, Findings& findings) {
  const auto& R = view.model.R();
  if (view.model.numActions() > 1 && R.maxCoeff() == R.minCoeff()) {
    findings.push_back({FindingKind::ODD_REWARD,
                        Severity::WARNING,
                        {},
                        "every reward is " + text(R.maxCoeff()) +
                            ": no action is better than "
                            "another"});
    return;
  }
  findOddSigns(view, findings);
  findPaidDelay(view, findings);
}

}  // namespace fabric::planner::linting
