// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/policy_file.hpp"

#include <limits>

#include "file.hpp"
#include "observed_split.hpp"
#include "text.hpp"
#include "xml.hpp"

namespace fabric::planner {
namespace {

using xml::refuse;
using xml::XMLElement;

constexpr int ANY = std::numeric_limits<int>::max();

/// Reads one PolicyX document.
class PolicyReader {
 public:
  PolicyReader(const XMLElement& root, const Pomdp& model, const FileLimits& limits)
      : model_(model), set_(vectorSet(root)), limits_(limits) {}

  AlphaVectors run() {
    readSplit();
    const auto elements = xml::children(set_);
    checkCount(elements.size());
    AlphaVectors policy;
    policy.vectors.setConstant(static_cast<Eigen::Index>(elements.size()), model_.numStates(),
                               FORBIDDEN);
    for (size_t i = 0; i < elements.size(); ++i) {
      const auto& e = *elements[i];
      const std::string kind = e.Name();
      if (kind != "Vector" && kind != "SparseVector") xml::refuseUnknown(e);
      policy.actions.push_back(xml::count(e, "action", model_.numActions() - 1));
      const auto values = kind == "Vector" ? readVector(e, i) : readSparse(e, i);
      spread(policy.vectors.row(static_cast<Eigen::Index>(i)), observedValue(e), values);
    }
    for (size_t x = 0; x < met_.size(); ++x) {
      if (!met_[x]) refuse(set_, "no vector has obsValue " + std::to_string(x));
    }
    return policy;
  }

 private:
  static const XMLElement& vectorSet(const XMLElement& root) {
    const char* type = root.Attribute("type");
    if (type != nullptr && std::string(type) != "value") {
      refuse(root, std::string("Policy type '") + type + "' is not supported, only value");
    }
    for (const auto* e : xml::children(root)) {
      if (std::string(e->Name()) != "AlphaVector") xml::refuseUnknown(*e);
    }
    return xml::child(root, "AlphaVector");
  }

  void readSplit() {
    length_ = xml::count(set_, "vectorLength", ANY);
    const int observed =
        set_.Attribute("numObsValue") == nullptr ? 1 : xml::count(set_, "numObsValue", ANY);
    try {
      split_ = splitObserved(model_, observed, length_);
    } catch (const ModelError& error) {
      refuse(set_, error.what());
    }
    met_.assign(static_cast<size_t>(observed), false);
    states_.assign(met_.size(), std::vector<int>(static_cast<size_t>(length_)));
    for (int s = 0; s < model_.numStates(); ++s) {
      const auto i = static_cast<size_t>(s);
      states_[static_cast<size_t>(split_.observed[i])][static_cast<size_t>(split_.hidden[i])] = s;
    }
  }

  void checkCount(size_t count) const {
    if (count == 0) refuse(set_, "<AlphaVector> has no vector");
    if (set_.Attribute("numVectors") != nullptr &&
        static_cast<size_t>(xml::count(set_, "numVectors", ANY)) != count) {
      refuse(set_, "numVectors='" + xml::attribute(set_, "numVectors") + "', but there are " +
                       std::to_string(count));
    }
    const double entries = static_cast<double>(count) * model_.numStates();
    if (entries > static_cast<double>(limits_.entries)) {
      refuse(set_, std::to_string(count) + " vectors are too many");
    }
  }

  int observedValue(const XMLElement& e) {
    const bool given = e.Attribute("obsValue") != nullptr || met_.size() > 1;
    const int x = given ? xml::count(e, "obsValue", static_cast<int>(met_.size()) - 1) : 0;
    met_[static_cast<size_t>(x)] = true;
    return x;
  }

  /// "line 7: vector 3 state dry/left"
  [[nodiscard]] std::string place(const XMLElement& e, size_t vector, size_t column) const {
    std::string where =
        "line " + std::to_string(e.GetLineNum()) + ": vector " + std::to_string(vector);
    if (states_.size() > 1) return where + " column " + std::to_string(column);
    return where + " state " + model_.states()[static_cast<size_t>(states_[0][column])];
  }

  [[nodiscard]] std::vector<double> readVector(const XMLElement& e, size_t vector) const {
    const auto content = xml::content(e);
    Words words(content);
    std::vector<double> values;
    size_t count = 0;
    for (auto word = words.next(); !word.empty(); word = words.next(), ++count) {
      if (count >= static_cast<size_t>(length_)) continue;
      values.push_back(number(word, [&] { return place(e, vector, count); }));
    }
    if (count != static_cast<size_t>(length_)) {
      refuse(e, "vector " + std::to_string(vector) + " has " + std::to_string(count) +
                    " numbers, expected " + std::to_string(length_));
    }
    return values;
  }

  /// <Entry>index value</Entry>; what is left out is zero.
  [[nodiscard]] std::vector<double> readSparse(const XMLElement& e, size_t vector) const {
    std::vector<double> values(static_cast<size_t>(length_), 0.0);
    for (const auto* entry : xml::children(e)) {
      if (std::string(entry->Name()) != "Entry") xml::refuseUnknown(*entry);
      const auto words = xml::words(*entry);
      const int column = words.size() == 2 ? indexOf(words[0]) : -1;
      if (column < 0) {
        refuse(*entry, "vector " + std::to_string(vector) + ": <Entry> needs an index below " +
                           std::to_string(length_) + " and a number");
      }
      const auto i = static_cast<size_t>(column);
      values[i] = number(words[1], [&] { return place(*entry, vector, i); });
    }
    return values;
  }

  [[nodiscard]] int indexOf(const std::string& word) const {
    int index = -1;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), index);
    const bool whole = error == std::errc() && stop == word.data() + word.size();
    return whole && index < length_ ? index : -1;
  }

  void spread(Eigen::MatrixXd::RowXpr row, int x, const std::vector<double>& values) const {
    for (size_t y = 0; y < values.size(); ++y) {
      row(states_[static_cast<size_t>(x)][y]) = values[y];
    }
  }

  const Pomdp& model_;
  const XMLElement& set_;
  const FileLimits& limits_;
  int length_ = 0;
  ObservedSplit split_;
  std::vector<std::vector<int>> states_;  // [observed][hidden] -> state
  std::vector<bool> met_;                 // observed values that have a vector
};

void checkFits(const AlphaVectors& policy, const Pomdp& model) {
  const auto& vectors = policy.vectors;
  if (vectors.rows() == 0 || vectors.rows() != static_cast<Eigen::Index>(policy.actions.size())) {
    throw ModelError(std::to_string(vectors.rows()) + " vectors for " +
                     std::to_string(policy.actions.size()) + " actions");
  }
  if (vectors.cols() != model.numStates()) {
    throw ModelError("vectors of " + std::to_string(vectors.cols()) + " numbers for the " +
                     std::to_string(model.numStates()) + " states of " + model.name());
  }
  for (Eigen::Index k = 0; k < vectors.rows(); ++k) {
    const std::string vector = "vector " + std::to_string(k);
    const int action = policy.actions[static_cast<size_t>(k)];
    if (action < 0 || action >= model.numActions()) {
      throw ModelError(vector + ": action " + std::to_string(action) + " is not in 0.." +
                       std::to_string(model.numActions() - 1));
    }
    for (Eigen::Index s = 0; s < vectors.cols(); ++s) {
      if (std::isfinite(vectors(k, s))) continue;
      throw ModelError(vector + " state " + model.states()[static_cast<size_t>(s)] +
                       (std::isnan(vectors(k, s)) ? " is NaN" : " is infinite"));
    }
  }
}

void writeDocument(const AlphaVectors& policy, const Pomdp& model, std::FILE* file) {
  tinyxml2::XMLPrinter xml(file);
  xml.PushHeader(false, true);
  xml.OpenElement("Policy");
  xml.PushAttribute("version", "0.1");
  xml.PushAttribute("type", "value");
  xml.PushAttribute("model", model.name().c_str());
  xml.OpenElement("AlphaVector");
  xml.PushAttribute("vectorLength", model.numStates());
  xml.PushAttribute("numObsValue", 1);
  xml.PushAttribute("numVectors", static_cast<int>(policy.vectors.rows()));
  for (Eigen::Index k = 0; k < policy.vectors.rows(); ++k) {
    xml.OpenElement("Vector");
    xml.PushAttribute("action", policy.actions[static_cast<size_t>(k)]);
    xml.PushAttribute("obsValue", 0);
    std::string numbers;
    for (Eigen::Index s = 0; s < policy.vectors.cols(); ++s) {
      numbers += digits(policy.vectors(k, s)) + " ";
    }
    xml.PushText(numbers.c_str());
    xml.CloseElement();
  }
  xml.CloseElement();
  xml.CloseElement();
}

}  // namespace

AlphaVectors parsePolicy(std::string_view bytes, const Pomdp& model, const FileLimits& limits) {
  tinyxml2::XMLDocument document;
  return PolicyReader(xml::parse(document, bytes, "Policy"), model, limits).run();
}

AlphaVectors loadPolicy(const std::string& path, const Pomdp& model) {
  return loadWith(path, [&](const std::string& bytes, const std::string&) {
    return parsePolicy(bytes, model);
  });
}

void savePolicy(const AlphaVectors& policy, const Pomdp& model, const std::string& path) {
  try {
    checkFits(policy, model);
  } catch (const ModelError& error) {
    throw ModelError(path + ": " + error.what());
  }
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw ModelError(path + ": cannot be written");
  writeDocument(policy, model, file);
  const bool failed = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || failed) throw ModelError(path + ": cannot be written");
}

}  // namespace fabric::planner
