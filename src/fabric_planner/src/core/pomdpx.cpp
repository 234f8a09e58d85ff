// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/pomdpx.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <set>

#include "factored_model.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

using tinyxml2::XMLElement;
using Names = std::vector<std::string>;

[[noreturn]] void refuse(const XMLElement& at, const std::string& what) {
  throw ModelError("line " + std::to_string(at.GetLineNum()) + ": " + what);
}

/// The words inside an element; comments between them do not count.
Names words(const XMLElement& element) {
  std::string all;
  for (const auto* node = element.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (const auto* chars = node->ToText()) all += std::string(" ") + chars->Value();
    if (const auto* child = node->ToElement()) {
      refuse(*child, std::string("unexpected <") + child->Name() + "> in <" + element.Name() + ">");
    }
  }
  return split(all);
}

const XMLElement& child(const XMLElement& parent, const char* name) {
  const auto* found = parent.FirstChildElement(name);
  if (found == nullptr) {
    refuse(parent, std::string("<") + parent.Name() + "> has no <" + name + ">");
  }
  if (const auto* second = found->NextSiblingElement(name)) {
    refuse(*second, std::string("a second <") + name + "> in <" + parent.Name() + ">");
  }
  return *found;
}

std::string attribute(const XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  const auto tokens = split(value == nullptr ? "" : value);
  if (tokens.size() != 1) {
    refuse(element, std::string("<") + element.Name() + "> needs " + name + "=\"one name\"");
  }
  return tokens[0];
}

std::string onlyWord(const XMLElement& element) {
  const auto found = words(element);
  if (found.size() != 1) {
    refuse(element, std::string("<") + element.Name() + "> needs exactly one word");
  }
  return found[0];
}

/// Reads one POMDPX document into a FactoredModel.
class Reader {
 public:
  Reader(const XMLElement& root, bool normalise) : root_(root), normalise_(normalise) {}

  FactoredModel run() {
    checkSections();
    readDiscount();
    readVariables();
    readConditionals("InitialStateBelief", "b", model_.initial, model_.states);
    readConditionals("StateTransitionFunction", "T", model_.transition, model_.states);
    if (!model_.observations.empty()) {
      readConditionals("ObsFunction", "O", model_.observation, model_.observations);
    } else if (root_.FirstChildElement("ObsFunction") != nullptr) {
      refuse(*root_.FirstChildElement("ObsFunction"), "ObsFunction, but no ObsVar");
    }
    readRewards();
    return std::move(model_);
  }

 private:
  void checkSections() const {
    static const std::set<std::string> KNOWN = {
        "Description", "Discount",      "Variable", "InitialStateBelief", "StateTransitionFunction",
        "ObsFunction", "RewardFunction"};
    if (std::string(root_.Name()) != "pomdpx") {
      refuse(root_, std::string("<") + root_.Name() + "> instead of <pomdpx>");
    }
    for (const auto* e = root_.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (KNOWN.count(e->Name()) == 0) refuse(*e, std::string("unknown <") + e->Name() + ">");
    }
  }

  void readDiscount() {
    const auto& element = child(root_, "Discount");
    const auto word = onlyWord(element);
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, model_.discount);
    if (error != std::errc() || stop != end) {
      refuse(element, "Discount: '" + word + "' is not a number");
    }
  }

  void readVariables() {
    const auto& section = child(root_, "Variable");
    for (const auto* e = section.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string kind = e->Name();
      if (kind == "StateVar") {
        model_.states.push_back(readStateVariable(*e));
      } else if (kind == "ObsVar") {
        model_.observations.push_back(readVariable(*e, "vname", "o"));
      } else if (kind == "ActionVar") {
        model_.actions.push_back(readVariable(*e, "vname", "a"));
      } else if (kind == "RewardVar") {
        model_.rewards.push_back(freshName(*e, attribute(*e, "vname")));
      } else {
        refuse(*e, "unknown <" + kind + "> in <Variable>");
      }
    }
    if (model_.states.empty()) refuse(section, "Variable: no StateVar");
    if (model_.actions.empty()) refuse(section, "Variable: no ActionVar");
  }

  Variable readStateVariable(const XMLElement& element) {
    Variable variable = readVariable(element, "vnameCurr", "s");
    variable.previous = freshName(element, attribute(element, "vnamePrev"));
    if (element.Attribute("fullyObs") != nullptr &&
        element.QueryBoolAttribute("fullyObs", &variable.fully_observed) != tinyxml2::XML_SUCCESS) {
      refuse(element, "fullyObs=\"" + std::string(element.Attribute("fullyObs")) +
                          "\" is neither true nor false");
    }
    return variable;
  }

  Variable readVariable(const XMLElement& element, const char* key, const char* prefix) {
    Variable variable;
    variable.name = freshName(element, attribute(element, key));
    if (element.FirstChildElement("NumValues") != nullptr) {
      const auto& counted = child(element, "NumValues");
      const auto word = onlyWord(counted);
      int n = 0;
      const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), n);
      if (error != std::errc() || stop != word.data() + word.size() || n < 1 || n > 1000000) {
        refuse(counted, variable.name + ": NumValues '" + word + "' is not a count");
      }
      for (int i = 0; i < n; ++i) variable.values.push_back(prefix + std::to_string(i));
    } else {
      variable.values = words(child(element, "ValueEnum"));
    }
    checkValues(element, variable);
    return variable;
  }

  static void checkValues(const XMLElement& element, const Variable& variable) {
    if (variable.values.empty()) refuse(element, variable.name + ": no values");
    std::set<std::string> seen;
    for (const auto& value : variable.values) {
      if (value == "*" || value == "-") {
        refuse(element, variable.name + ": '" + value + "' cannot name a value");
      }
      if (!seen.insert(value).second) {
        refuse(element, variable.name + ": '" + value + "' is named twice");
      }
    }
  }

  std::string freshName(const XMLElement& element, const std::string& name) {
    if (!names_.insert(name).second) refuse(element, "variable '" + name + "' is named twice");
    return name;
  }

  /// Reads every CondProb of a section: exactly one for each of the variables.
  void readConditionals(const char* section_name, const std::string& letter,
                        std::vector<Factor>& factors, const std::vector<Variable>& variables) {
    const auto& section = child(root_, section_name);
    std::set<std::string> done;
    for (const auto* e = section.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (std::string(e->Name()) != "CondProb") {
        refuse(*e, std::string("unknown <") + e->Name() + "> in <" + section_name + ">");
      }
      const auto var = onlyWord(child(*e, "Var"));
      if (!done.insert(var).second) refuse(*e, "a second CondProb for '" + var + "'");
      factors.push_back(readFactor(*e, letter, var, "ProbTable"));
      try {
        factors.back().checkRows(normalise_);
      } catch (const ModelError& error) {
        refuse(*e, std::string(section_name) + ": " + error.what());
      }
    }
    for (const auto& variable : variables) {
      const auto& name = letter == "b" ? variable.previous : variable.name;
      if (done.count(name) == 0) {
        refuse(section, std::string(section_name) + ": no CondProb for '" + name + "'");
      }
    }
  }

  void readRewards() {
    const auto& section = child(root_, "RewardFunction");
    for (const auto* e = section.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (std::string(e->Name()) != "Func") {
        refuse(*e, std::string("unknown <") + e->Name() + "> in <RewardFunction>");
      }
      const auto var = onlyWord(child(*e, "Var"));
      if (std::find(model_.rewards.begin(), model_.rewards.end(), var) == model_.rewards.end()) {
        refuse(*e, "RewardFunction: unknown reward variable '" + var + "'");
      }
      model_.reward.push_back(readFactor(*e, "R", "", "ValueTable"));
    }
    if (model_.reward.empty()) refuse(section, "RewardFunction: no Func");
  }

  /// child_name: the variable the rows run over, empty for rewards.
  Factor readFactor(const XMLElement& element, const std::string& letter,
                    const std::string& child_name, const char* table_name) {
    std::vector<Axis> axes;
    for (const auto& parent : words(child(element, "Parent"))) {
      if (parent != "null") axes.push_back(axis(element, letter, parent, false));
    }
    if (!child_name.empty()) axes.push_back(axis(element, letter, child_name, true));
    const auto& parameter = child(element, "Parameter");
    const char* type = parameter.Attribute("type");
    if (type != nullptr && std::string(type) != "TBL") {
      refuse(parameter, std::string("Parameter type '") + type + "' is not supported, only TBL");
    }
    Factor factor(letter, axes);
    for (const auto* e = parameter.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (std::string(e->Name()) != "Entry") {
        refuse(*e, std::string("unknown <") + e->Name() + "> in <Parameter>");
      }
      const auto instance = words(child(*e, "Instance"));
      const auto table = words(child(*e, table_name));
      try {
        factor.addEntry(instance, table);
      } catch (const ModelError& error) {
        refuse(*e, std::string(element.Parent()->Value()) + ": " + error.what());
      }
    }
    return factor;
  }

  /// Finds a variable by name and checks that the section may speak of it.
  [[nodiscard]] Axis axis(const XMLElement& at, const std::string& letter, const std::string& name,
                          bool is_child) const {
    const auto found = find(name);
    const bool child_ok = (letter == "b" && found.role == Role::PREVIOUS) ||
                          (letter == "T" && found.role == Role::CURRENT) ||
                          (letter == "O" && found.role == Role::OBSERVATION);
    const bool parent_ok = letter == "R" || child_ok ||
                           (letter != "b" && found.role == Role::ACTION) ||
                           (letter == "T" && found.role == Role::PREVIOUS) ||
                           (letter == "O" && found.role == Role::CURRENT);
    if (found.variable < 0) {
      refuse(at, std::string(at.Parent()->Value()) + ": unknown variable '" + name + "'");
    }
    if (is_child ? !child_ok : !parent_ok) {
      refuse(at, std::string(at.Parent()->Value()) + ": variable '" + name +
                     (is_child ? "' cannot be its Var" : "' cannot be a Parent here"));
    }
    return found;
  }

  [[nodiscard]] Axis find(const std::string& name) const {
    const auto search = [&](const std::vector<Variable>& group, Role role, bool previous) {
      for (size_t i = 0; i < group.size(); ++i) {
        if ((previous ? group[i].previous : group[i].name) == name) {
          return Axis{role, static_cast<int>(i), name, group[i].values};
        }
      }
      return Axis{role, -1, name, {}};
    };
    Axis found = search(model_.actions, Role::ACTION, false);
    if (found.variable < 0) found = search(model_.states, Role::PREVIOUS, true);
    if (found.variable < 0) found = search(model_.states, Role::CURRENT, false);
    if (found.variable < 0) found = search(model_.observations, Role::OBSERVATION, false);
    return found;
  }

  const XMLElement& root_;
  bool normalise_;
  FactoredModel model_;
  std::set<std::string> names_;
};

/// tinyxml2 lets some things pass that XML forbids: `--` in a comment (mostly an entry meant to be
/// commented out, so that what the file says is in doubt) and a second root.
void checkWellFormed(const tinyxml2::XMLNode& node) {
  const auto* comment = node.ToComment();
  const std::string body = comment == nullptr ? "" : comment->Value();
  const auto dashes = body.find("--");
  if (dashes != std::string::npos || (!body.empty() && body.back() == '-')) {
    const auto lines =
        std::count(body.begin(),
                   body.begin() + static_cast<std::ptrdiff_t>(std::min(dashes, body.size())), '\n');
    throw ModelError("line " + std::to_string(node.GetLineNum() + lines) +
                     ": not well-formed XML ('--' inside a comment)");
  }
  for (const auto* e = node.FirstChild(); e != nullptr; e = e->NextSibling()) checkWellFormed(*e);
}

FactoredModel readDocument(const std::string& path, bool normalise) {
  if (!std::filesystem::is_regular_file(path)) throw ModelError("no such file");
  tinyxml2::XMLDocument document;
  if (document.LoadFile(path.c_str()) != tinyxml2::XML_SUCCESS) {
    const std::string kind = tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID());
    throw ModelError("line " + std::to_string(document.ErrorLineNum()) + ": not well-formed XML (" +
                     kind + ")");
  }
  checkWellFormed(document);
  const auto* root = document.RootElement();
  if (root == nullptr) throw ModelError("no <pomdpx> element");
  if (const auto* second = root->NextSiblingElement()) refuse(*second, "a second root element");
  FactoredModel model = Reader(*root, normalise).run();
  model.name = std::filesystem::path(path).stem().string();
  return model;
}

}  // namespace

Pomdp loadPomdpx(const std::string& path, bool normalise) {
  try {
    return Pomdp(flatten(readDocument(path, normalise)));
  } catch (const ModelError& error) {
    throw ModelError(path + ": " + error.what());
  }
}

}  // namespace fabric::planner
