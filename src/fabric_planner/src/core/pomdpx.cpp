// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/pomdpx.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <unordered_set>

#include "decision_diagram.hpp"
#include "factored_model.hpp"
#include "file.hpp"
#include "text.hpp"
#include "xml.hpp"

namespace fabric::planner {
namespace {

using xml::attribute;
using xml::child;
using xml::onlyWord;
using xml::refuse;
using xml::words;
using xml::XMLElement;
using Names = std::vector<std::string>;

/// Reads one POMDPX document into a FactoredModel.
class Reader {
 public:
  Reader(const XMLElement& root, bool normalise, const FileLimits& limits)
      : root_(root), normalise_(normalise), limits_(limits) {}

  FactoredModel run() {
    checkSections();
    readDiscount();
    readHorizon();
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
        "Description", "Discount",           "Horizon",
        "Variable",    "InitialStateBelief", "StateTransitionFunction",
        "ObsFunction", "RewardFunction"};
    for (const auto* e : xml::children(root_)) {
      if (KNOWN.count(e->Name()) == 0) xml::refuseUnknown(*e);
    }
  }

  void readDiscount() {
    const auto& element = child(root_, "Discount");
    const auto place = [&] {
      return "line " + std::to_string(element.GetLineNum()) + ": Discount";
    };
    model_.discount = number(onlyWord(element), place);
  }

  void readHorizon() const {
    static const std::set<std::string> ENDLESS = {"inf", "infinite", "infinity", "-1"};
    if (root_.FirstChildElement("Horizon") == nullptr) return;
    const auto& element = child(root_, "Horizon");
    const auto word = onlyWord(element);
    if (ENDLESS.count(word) == 0) {
      refuse(element,
             "Horizon '" + word + "': only models that go on for ever (infinite) are read");
    }
  }

  void readVariables() {
    const auto& section = child(root_, "Variable");
    for (const auto* e : xml::children(section)) {
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
        xml::refuseUnknown(*e);
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
    std::vector<std::string> values;
    if (element.FirstChildElement("NumValues") != nullptr) {
      for (int i = 0; i < readCount(variable.name, child(element, "NumValues")); ++i) {
        values.push_back(prefix + std::to_string(i));
      }
    } else {
      values = words(child(element, "ValueEnum"));
    }
    checkValues(element, variable.name, values);
    variable.domain = std::make_shared<const Domain>(std::move(values));
    return variable;
  }

  [[nodiscard]] int readCount(const std::string& name, const XMLElement& element) const {
    const auto word = onlyWord(element);
    size_t n = 0;
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, n);
    if (error != std::errc() || stop != end || n < 1 || n > limits_.values) {
      refuse(element, name + ": NumValues '" + word + "' is not a count in 1.." +
                          std::to_string(limits_.values));
    }
    return static_cast<int>(n);
  }

  static void checkValues(const XMLElement& element, const std::string& name,
                          const std::vector<std::string>& values) {
    if (values.empty()) refuse(element, name + ": no values");
    std::unordered_set<std::string> seen;
    for (const auto& value : values) {
      if (value == "*" || value == "-") {
        refuse(element, name + ": '" + value + "' cannot name a value");
      }
      if (!seen.insert(value).second) refuse(element, name + ": '" + value + "' is named twice");
    }
  }

  std::string freshName(const XMLElement& element, const std::string& name) {
    if (!names_.insert(name).second) refuse(element, "variable '" + name + "' is named twice");
    return name;
  }

  /// All elements of all sections of that name; each must be of one kind.
  std::vector<const XMLElement*> inSections(const char* name, const char* kind) const {
    std::vector<const XMLElement*> all;
    const auto* section = root_.FirstChildElement(name);
    if (section == nullptr) refuse(root_, std::string("<pomdpx> has no <") + name + ">");
    for (; section != nullptr; section = section->NextSiblingElement(name)) {
      for (const auto* e : xml::children(*section)) {
        if (std::string(e->Name()) != kind) xml::refuseUnknown(*e);
        all.push_back(e);
      }
    }
    return all;
  }

  /// Reads every CondProb of a section: each of the variables is Var of exactly one.
  void readConditionals(const char* section, const std::string& letter,
                        std::vector<Factor>& factors, const std::vector<Variable>& variables) {
    std::set<std::string> done;
    for (const auto* e : inSections(section, "CondProb")) {
      factors.push_back(readFactor(*e, letter, words(child(*e, "Var"))));
      const auto& axes = factors.back().axes();
      for (size_t i = factors.back().numParents(); i < axes.size(); ++i) {
        if (!done.insert(axes[i].name).second) {
          refuse(*e, "a second CondProb for '" + axes[i].name + "'");
        }
      }
      try {
        factors.back().checkRows(normalise_);
      } catch (const ModelError& error) {
        refuse(*e, std::string(section) + ": " + error.what());
      }
    }
    for (const auto& variable : variables) {
      const auto& name = letter == "b" ? variable.previous : variable.name;
      if (done.count(name) == 0) {
        refuse(*root_.FirstChildElement(section),
               std::string(section) + ": no CondProb for '" + name + "'");
      }
    }
  }

  void readRewards() {
    for (const auto* e : inSections("RewardFunction", "Func")) {
      const auto var = onlyWord(child(*e, "Var"));
      if (std::find(model_.rewards.begin(), model_.rewards.end(), var) == model_.rewards.end()) {
        refuse(*e, "RewardFunction: unknown reward variable '" + var + "'");
      }
      model_.reward.push_back(readFactor(*e, "R", {}));
    }
    if (model_.reward.empty()) {
      refuse(*root_.FirstChildElement("RewardFunction"), "RewardFunction: no Func");
    }
  }

  /// vars: the variables the rows run over, none for rewards.
  Factor readFactor(const XMLElement& element, const std::string& letter, const Names& vars) {
    const auto& parameter = child(element, "Parameter");
    const char* given = parameter.Attribute("type");
    const std::string type = given == nullptr ? "TBL" : given;
    if (type != "TBL" && type != "DD") {
      refuse(parameter, "Parameter type '" + type + "' is not supported, only TBL and DD");
    }
    std::vector<Axis> axes;
    for (const auto& parent : words(child(element, "Parent"))) {
      if (parent != "null") addAxis(axes, element, letter, parent, false);
    }
    const size_t parents = axes.size();
    if (vars.empty() && letter != "R") refuse(element, "<Var> names no variable");
    for (const auto& var : vars) addAxis(axes, element, letter, var, true);
    if (type == "DD" && letter != "R") addHiddenChildren(parameter, letter, axes);
    Factor factor(letter, axes, axes.size() - parents, limits_.entries);
    if (type == "DD") {
      readDiagram(parameter, factor, [this](const std::string& name) { return previousOf(name); });
    } else {
      readTable(parameter, letter == "R" ? "ValueTable" : "ProbTable", factor);
    }
    return factor;
  }

  static void readTable(const XMLElement& parameter, const char* table_name, Factor& factor) {
    for (const auto* e : xml::children(parameter)) {
      if (std::string(e->Name()) != "Entry") xml::refuseUnknown(*e);
      const auto instance = words(child(*e, "Instance"));
      const auto table = xml::content(child(*e, table_name));
      try {
        factor.addEntry(instance, table);
      } catch (const ModelError& error) {
        refuse(*e, std::string(parameter.Parent()->Parent()->Value()) + ": " + error.what());
      }
    }
  }

  /// The format's own example gives a joint distribution as a diagram whose nodes ask for more
  /// variables than <Var> names: those are children too.
  void addHiddenChildren(const XMLElement& inside, const std::string& letter,
                         std::vector<Axis>& axes) const {
    for (const auto* e : xml::children(inside)) {
      const char* name = e->Attribute("var");
      const auto known = [&](const Axis& axis) { return axis.name == name; };
      if (name != nullptr && std::none_of(axes.begin(), axes.end(), known) &&
          isChild(letter, find(name))) {
        axes.push_back(find(name));
      }
      addHiddenChildren(*e, letter, axes);
    }
  }

  [[nodiscard]] std::string previousOf(const std::string& name) const {
    for (const auto& state : model_.states) {
      if (state.name == name) return state.previous;
    }
    return "";
  }

  static bool isChild(const std::string& letter, const Axis& axis) {
    return axis.variable >= 0 && ((letter == "b" && axis.role == Role::PREVIOUS) ||
                                  (letter == "T" && axis.role == Role::CURRENT) ||
                                  (letter == "O" && axis.role == Role::OBSERVATION));
  }

  /// Finds a variable by name and checks that the section may speak of it.
  void addAxis(std::vector<Axis>& axes, const XMLElement& at, const std::string& letter,
               const std::string& name, bool is_child) const {
    const auto found = find(name);
    const std::string section = at.Parent()->Value();
    const bool child_ok = isChild(letter, found);
    const bool parent_ok = letter == "R" || child_ok ||
                           (letter != "b" && found.role == Role::ACTION) ||
                           (letter == "T" && found.role == Role::PREVIOUS) ||
                           (letter == "O" && found.role == Role::CURRENT);
    if (found.variable < 0) refuse(at, section + ": unknown variable '" + name + "'");
    if (is_child ? !child_ok : !parent_ok) {
      refuse(at, section + ": variable '" + name +
                     (is_child ? "' cannot be its Var" : "' cannot be a Parent here"));
    }
    for (const auto& axis : axes) {
      if (axis.name == name) refuse(at, section + ": variable '" + name + "' is named twice");
    }
    axes.push_back(found);
  }

  [[nodiscard]] Axis find(const std::string& name) const {
    const auto search = [&](const std::vector<Variable>& group, Role role, bool previous) {
      for (size_t i = 0; i < group.size(); ++i) {
        if ((previous ? group[i].previous : group[i].name) == name) {
          return Axis{role, static_cast<int>(i), name, group[i].domain};
        }
      }
      return Axis{role, -1, name, nullptr};
    };
    Axis found = search(model_.actions, Role::ACTION, false);
    if (found.variable < 0) found = search(model_.states, Role::PREVIOUS, true);
    if (found.variable < 0) found = search(model_.states, Role::CURRENT, false);
    if (found.variable < 0) found = search(model_.observations, Role::OBSERVATION, false);
    return found;
  }

  const XMLElement& root_;
  bool normalise_;
  const FileLimits& limits_;
  FactoredModel model_;
  std::set<std::string> names_;
};

}  // namespace

Pomdp parsePomdpx(std::string_view bytes, const std::string& name, bool normalise,
                  const FileLimits& limits) {
  FactoredModel model;
  {
    tinyxml2::XMLDocument document;
    model = Reader(xml::parse(document, bytes, "pomdpx"), normalise, limits).run();
  }
  model.name = name;
  return Pomdp(flatten(model, limits));
}

Pomdp loadPomdpx(const std::string& path, bool normalise) {
  return loadWith(path, [&](const std::string& bytes, const std::string& name) {
    return parsePomdpx(bytes, name, normalise);
  });
}

}  // namespace fabric::planner
