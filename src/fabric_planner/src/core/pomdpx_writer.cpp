// SPDX-License-Identifier: BSD-3-Clause
#include <tinyxml2.h>

#include <charconv>

#include "fabric_planner/pomdpx.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

using tinyxml2::XMLPrinter;

/// The shortest digits that read back as the same number.
std::string digits(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return std::string(buffer, end);
}

void leaf(XMLPrinter& xml, const char* name, const std::string& content) {
  xml.OpenElement(name);
  xml.PushText(content.c_str());
  xml.CloseElement();
}

template <typename Row>
std::string numbers(const Row& row) {
  std::vector<std::string> tokens;
  for (Eigen::Index i = 0; i < row.size(); ++i) tokens.push_back(digits(row(i)));
  return join(tokens, " ");
}

void entry(XMLPrinter& xml, const std::string& instance, const char* table,
           const std::string& content) {
  xml.OpenElement("Entry");
  leaf(xml, "Instance", instance);
  leaf(xml, table, content);
  xml.CloseElement();
}

void beginTable(XMLPrinter& xml, const char* section, const char* kind, const char* var,
                const char* parents) {
  xml.OpenElement(section);
  xml.OpenElement(kind);
  leaf(xml, "Var", var);
  leaf(xml, "Parent", parents);
  xml.OpenElement("Parameter");
  xml.PushAttribute("type", "TBL");
}

void endTable(XMLPrinter& xml) {
  for (int i = 0; i < 3; ++i) xml.CloseElement();
}

/// True when the observation is the state reached, under its own name.
bool observedAsItIs(const Pomdp& model) {
  if (model.observations() != model.states()) return false;
  for (int a = 0; a < model.numActions(); ++a) {
    if (model.O(a).nonZeros() != model.numStates()) return false;
    for (int s = 0; s < model.numStates(); ++s) {
      if (model.O(a).coeff(s, s) != 1.0) return false;
    }
  }
  return true;
}

void writeVariables(XMLPrinter& xml, const Pomdp& model, bool observed) {
  xml.OpenElement("Variable");
  xml.OpenElement("StateVar");
  xml.PushAttribute("vnamePrev", "state_0");
  xml.PushAttribute("vnameCurr", "state_1");
  xml.PushAttribute("fullyObs", observed ? "true" : "false");
  leaf(xml, "ValueEnum", join(model.states(), " "));
  xml.CloseElement();
  if (!observed) {
    xml.OpenElement("ObsVar");
    xml.PushAttribute("vname", "observation");
    leaf(xml, "ValueEnum", join(model.observations(), " "));
    xml.CloseElement();
  }
  xml.OpenElement("ActionVar");
  xml.PushAttribute("vname", "action");
  leaf(xml, "ValueEnum", join(model.actions(), " "));
  xml.CloseElement();
  xml.OpenElement("RewardVar");
  xml.PushAttribute("vname", "reward");
  xml.CloseElement();
  xml.CloseElement();
}

void writeRows(XMLPrinter& xml, const Pomdp& model, const std::string& action,
               const SparseRows& table) {
  for (Eigen::Index s = 0; s < table.rows(); ++s) {
    entry(xml, action + " " + model.states()[static_cast<size_t>(s)] + " -", "ProbTable",
          numbers(Eigen::RowVectorXd(table.row(s))));
  }
}

void writeTables(XMLPrinter& xml, const Pomdp& model, bool observed) {
  beginTable(xml, "InitialStateBelief", "CondProb", "state_0", "null");
  entry(xml, "-", "ProbTable", numbers(model.initialBelief()));
  endTable(xml);
  beginTable(xml, "StateTransitionFunction", "CondProb", "state_1", "action state_0");
  for (int a = 0; a < model.numActions(); ++a) {
    writeRows(xml, model, model.actions()[static_cast<size_t>(a)], model.T(a));
  }
  endTable(xml);
  if (!observed) {
    beginTable(xml, "ObsFunction", "CondProb", "observation", "action state_1");
    for (int a = 0; a < model.numActions(); ++a) {
      writeRows(xml, model, model.actions()[static_cast<size_t>(a)], SparseRows(model.O(a)));
    }
    endTable(xml);
  }
  beginTable(xml, "RewardFunction", "Func", "reward", "action state_0");
  for (int a = 0; a < model.numActions(); ++a) {
    entry(xml, model.actions()[static_cast<size_t>(a)] + " -", "ValueTable",
          numbers(model.R().row(a)));
  }
  endTable(xml);
}

}  // namespace

void savePomdpx(const Pomdp& model, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw ModelError(path + ": cannot be written");
  {
    XMLPrinter xml(file);
    xml.PushHeader(false, true);
    xml.OpenElement("pomdpx");
    xml.PushAttribute("version", "1.0");
    xml.PushAttribute("id", model.name().c_str());
    leaf(xml, "Discount", digits(model.discount()));
    const bool observed = observedAsItIs(model);
    writeVariables(xml, model, observed);
    writeTables(xml, model, observed);
    xml.CloseElement();
  }
  const bool failed = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || failed) throw ModelError(path + ": cannot be written");
}

}  // namespace fabric::planner
