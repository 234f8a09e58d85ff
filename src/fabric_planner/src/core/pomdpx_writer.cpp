// SPDX-License-Identifier: BSD-3-Clause
#include <tinyxml2.h>

#include <algorithm>

#include "fabric_planner/pomdpx.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

using tinyxml2::XMLPrinter;

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

/// A row is listed whole when that is shorter than one entry for each number.
bool isDense(Eigen::Index numbers, Eigen::Index columns) {
  return columns <= 24 || 8 * numbers > columns;
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

bool anySparse(const SparseRows& table) {
  for (Eigen::Index s = 0; s < table.rows(); ++s) {
    if (!isDense(table.row(s).nonZeros(), table.cols())) return true;
  }
  return false;
}

void writeRows(XMLPrinter& xml, const Pomdp& model, const std::string& action,
               const SparseRows& table, const std::vector<std::string>& columns) {
  if (anySparse(table)) entry(xml, action + " * *", "ProbTable", "0");
  for (Eigen::Index s = 0; s < table.rows(); ++s) {
    const std::string row = action + " " + model.states()[static_cast<size_t>(s)] + " ";
    if (isDense(table.row(s).nonZeros(), table.cols())) {
      entry(xml, row + "-", "ProbTable", numbers(Eigen::RowVectorXd(table.row(s))));
      continue;
    }
    for (SparseRows::InnerIterator it(table, s); it; ++it) {
      entry(xml, row + columns[static_cast<size_t>(it.col())], "ProbTable", digits(it.value()));
    }
  }
}

void writeTables(XMLPrinter& xml, const Pomdp& model, bool observed) {
  beginTable(xml, "InitialStateBelief", "CondProb", "state_0", "null");
  entry(xml, "-", "ProbTable", numbers(model.initialBelief()));
  endTable(xml);
  beginTable(xml, "StateTransitionFunction", "CondProb", "state_1", "action state_0");
  for (int a = 0; a < model.numActions(); ++a) {
    writeRows(xml, model, model.actions()[static_cast<size_t>(a)], model.T(a), model.states());
  }
  endTable(xml);
  if (!observed) {
    beginTable(xml, "ObsFunction", "CondProb", "observation", "action state_1");
    for (int a = 0; a < model.numActions(); ++a) {
      writeRows(xml, model, model.actions()[static_cast<size_t>(a)], SparseRows(model.O(a)),
                model.observations());
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

/// Names the reader would take for something else.
void checkNames(const std::string& kind, const std::vector<std::string>& names) {
  for (const auto& name : names) {
    const bool control = std::any_of(name.begin(), name.end(), [](char c) {
      return static_cast<unsigned char>(c) < 32 || c == 127;
    });
    if (name == "*" || name == "-" || control) {
      throw ModelError(kind + " '" + name + "': POMDPX has no place for such a name");
    }
  }
}

void checkExpressible(const Pomdp& model) {
  if (model.allowed().size() > 0 && !model.allowed().all()) {
    throw ModelError("POMDPX has no place for actions that are allowed in some states only");
  }
  checkNames("state", model.states());
  checkNames("action", model.actions());
  checkNames("observation", model.observations());
}

void writeDocument(const Pomdp& model, std::FILE* file) {
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

}  // namespace

void savePomdpx(const Pomdp& model, const std::string& path) {
  try {
    checkExpressible(model);
  } catch (const ModelError& error) {
    throw ModelError(path + ": " + error.what());
  }
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw ModelError(path + ": cannot be written");
  writeDocument(model, file);
  const bool failed = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || failed) throw ModelError(path + ": cannot be written");
}

}  // namespace fabric::planner
