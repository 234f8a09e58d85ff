// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/observation_map.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "file.hpp"
#include "yaml.hpp"

namespace fabric::planner {
namespace {

using Rule = ObservationMap::Rule;

const std::map<std::string, bool Features::*> FLAGS = {
    {"task_success", &Features::task_success},
    {"task_failure", &Features::task_failure},
    {"detected", &Features::detected},
    {"looking_around", &Features::looking_around},
    {"grasp_attempt", &Features::grasp_attempt},
    {"warning", &Features::warning},
    {"idle", &Features::idle},
    {"subtask_success", &Features::subtask_success},
    {"subtask_failure", &Features::subtask_failure},
    {"robot_success", &Features::robot_success},
    {"robot_failure", &Features::robot_failure},
};

const std::map<std::string, double Features::*> NUMBERS = {
    {"subtask_elapsed", &Features::subtask_elapsed},
    {"waiting_time", &Features::waiting_time},
    {"failed_attempts", &Features::failed_attempts},
};

const char* const PREVIOUS = "previous";

std::set<std::string> conditionNames() {
  std::set<std::string> names = {PREVIOUS};
  for (const auto& [name, field] : FLAGS) names.insert(name);
  for (const auto& [name, field] : NUMBERS) names.insert(name);
  return names;
}

int symbolIndex(const std::string& symbol, const std::vector<std::string>& observations,
                const std::string& place) {
  const auto found = std::find(observations.begin(), observations.end(), symbol);
  if (found == observations.end()) {
    throw ModelError(place + ": the model has no observation '" + symbol + "'");
  }
  return static_cast<int>(found - observations.begin());
}

ObservationMap::Threshold readThreshold(double Features::*field, const YAML::Node& node,
                                        const std::string& place) {
  yaml::checkMap(node, place, {"at_least", "below"});
  ObservationMap::Threshold threshold{field, std::nullopt, std::nullopt};
  if (node["at_least"]) threshold.at_least = yaml::number(node["at_least"], place + ": at_least");
  if (node["below"]) threshold.below = yaml::number(node["below"], place + ": below");
  if (!threshold.at_least && !threshold.below) {
    throw ModelError(place + ": expected at_least or below");
  }
  return threshold;
}

std::vector<int> readPrevious(const YAML::Node& node, const std::vector<std::string>& observations,
                              const std::string& place) {
  std::vector<int> symbols;
  if (node.IsScalar()) symbols.push_back(symbolIndex(node.Scalar(), observations, place));
  if (node.IsSequence()) {
    for (const YAML::Node& entry : node) {
      const std::string name = entry.IsScalar() ? entry.Scalar() : "(no name)";
      symbols.push_back(symbolIndex(name, observations, place));
    }
  }
  if (symbols.empty()) throw ModelError(place + ": expected a symbol or a list of symbols");
  return symbols;
}

void readConditions(const YAML::Node& when, const std::vector<std::string>& observations,
                    const std::string& place, Rule& rule) {
  static const std::set<std::string> NAMES = conditionNames();
  yaml::checkMap(when, place + ": when", NAMES);
  for (const auto& entry : when) {
    const std::string name = entry.first.Scalar();
    const std::string condition = place + ": " + name;
    if (const auto flag = FLAGS.find(name); flag != FLAGS.end()) {
      rule.flags.push_back({flag->second, yaml::boolean(entry.second, condition)});
    } else if (const auto field = NUMBERS.find(name); field != NUMBERS.end()) {
      rule.thresholds.push_back(readThreshold(field->second, entry.second, condition));
    } else {
      rule.previous = readPrevious(entry.second, observations, condition);
    }
  }
}

Rule readRule(const YAML::Node& node, const std::vector<std::string>& observations,
              const std::string& place) {
  yaml::checkMap(node, place, {"when", "symbol"});
  Rule rule;
  rule.symbol = symbolIndex(yaml::text(node, "symbol", place), observations, place);
  if (node["when"]) {
    readConditions(node["when"], observations, place, rule);
    if (rule.unconditional()) throw ModelError(place + ": when: has no condition");
  }
  return rule;
}

std::vector<Rule> readRules(const YAML::Node& node, const std::vector<std::string>& observations,
                            const std::string& name) {
  if (!node || !node.IsSequence() || node.size() == 0) {
    throw ModelError(name + ": rules: expected a list with at least one rule");
  }
  std::vector<Rule> rules;
  for (const YAML::Node& entry : node) {
    const std::string place = name + ": rule " + std::to_string(rules.size() + 1);
    if (!rules.empty() && rules.back().unconditional()) {
      throw ModelError(place + ": is never reached, the rule before it always holds");
    }
    rules.push_back(readRule(entry, observations, place));
  }
  if (!rules.back().unconditional()) {
    throw ModelError(name + ": rule " + std::to_string(rules.size()) +
                     ": the last rule has conditions, so the map is not total");
  }
  return rules;
}

bool usesPrevious(const std::vector<Rule>& rules) {
  return std::any_of(rules.begin(), rules.end(),
                     [](const Rule& rule) { return !rule.previous.empty(); });
}

}  // namespace

ObservationMap ObservationMap::load(const std::string& path,
                                    const std::vector<std::string>& observations) {
  return parse(readFile(path), path, observations);
}

ObservationMap ObservationMap::parse(const std::string& text, const std::string& name,
                                     const std::vector<std::string>& observations) {
  const YAML::Node root = yaml::load(text, name);
  yaml::checkMap(root, name, {"initial", "rules"});
  std::vector<Rule> rules = readRules(root["rules"], observations, name);
  int initial = -1;
  if (root["initial"]) {
    initial = symbolIndex(yaml::text(root, "initial", name), observations, name + ": initial");
  } else if (usesPrevious(rules)) {
    throw ModelError(name + ": a rule asks for the previous symbol, but initial is not given");
  }
  return ObservationMap(observations, std::move(rules), initial);
}

ObservationMap::ObservationMap(std::vector<std::string> observations, std::vector<Rule> rules,
                               int initial)
    : observations_(std::move(observations)), rules_(std::move(rules)), initial_(initial) {}

int ObservationMap::symbol(const Features& features, std::optional<int> previous) const {
  if (previous && (*previous < 0 || *previous >= static_cast<int>(observations_.size()))) {
    throw std::out_of_range("previous observation " + std::to_string(*previous) + " of " +
                            std::to_string(observations_.size()));
  }
  const int before = previous.value_or(initial_);
  return std::find_if(rules_.begin(), rules_.end(),
                      [&](const Rule& rule) { return rule.holds(features, before); })
      ->symbol;
}

bool ObservationMap::Rule::holds(const Features& features, int before) const {
  const auto flag_holds = [&](const Flag& flag) { return features.*flag.field == flag.wanted; };
  const auto threshold_holds = [&](const Threshold& threshold) {
    const double value = features.*threshold.field;
    return (!threshold.at_least || value >= *threshold.at_least) &&
           (!threshold.below || value < *threshold.below);
  };
  return std::all_of(flags.begin(), flags.end(), flag_holds) &&
         std::all_of(thresholds.begin(), thresholds.end(), threshold_holds) &&
         (previous.empty() ||
          std::find(previous.begin(), previous.end(), before) != previous.end());
}

}  // namespace fabric::planner
