// SPDX-License-Identifier: BSD-3-Clause
#include "decision_diagram.hpp"

#include <map>
#include <set>

#include "text.hpp"

namespace fabric::planner {
namespace {

using xml::XMLElement;

class DiagramReader {
 public:
  DiagramReader(Factor& factor, const std::function<std::string(const std::string&)>& previous)
      : factor_(factor), previous_(previous), path_(factor.axes().size(), ALL) {}

  void read(const XMLElement& parameter) {
    for (const auto* e : xml::children(parameter)) {
      const std::string kind = e->Name();
      if (kind == "SubDAGTemplate") {
        const auto id = xml::attribute(*e, "id");
        if (!templates_.emplace(id, e).second) xml::refuse(*e, "a second template '" + id + "'");
      } else if (kind != "DAG") {
        xml::refuseUnknown(*e);
      }
    }
    readInside(xml::child(parameter, "DAG"));
  }

 private:
  /// A DAG, a template or an edge: exactly one thing is inside.
  void readInside(const XMLElement& holder) {
    const auto inside = xml::children(holder);
    if (inside.size() != 1) {
      xml::refuse(holder, std::string("<") + holder.Name() +
                              "> needs exactly one <Node>, <SubDAG> or <Terminal>");
    }
    const std::string kind = inside[0]->Name();
    if (kind == "Node") {
      readNode(*inside[0]);
    } else if (kind == "SubDAG") {
      readSubDiagram(*inside[0]);
    } else if (kind == "Terminal") {
      const auto place = [&] { return "line " + std::to_string(inside[0]->GetLineNum()); };
      set(*inside[0], number(xml::onlyWord(*inside[0]), place));
    } else {
      xml::refuseUnknown(*inside[0]);
    }
  }

  void readNode(const XMLElement& node) {
    const size_t axis = axisOf(node, xml::attribute(node, "var"));
    std::set<int> met;
    for (const auto* edge : xml::children(node)) {
      if (std::string(edge->Name()) != "Edge") xml::refuseUnknown(*edge);
      const auto word = xml::attribute(*edge, "val");
      const int value = valueOf(*edge, axis, word);
      if (!met.insert(value).second) xml::refuse(*edge, "a second edge for '" + word + "'");
      const int before = path_[axis];
      if (before >= 0 && before != value) continue;  // asked before: only that answer goes on
      path_[axis] = value;
      readInside(*edge);
      path_[axis] = before;
    }
  }

  void readSubDiagram(const XMLElement& element) {
    const auto type = xml::attribute(element, "type");
    if (type == "template") return readTemplate(element);
    const size_t axis = axisOf(element, xml::attribute(element, "var"));
    if (type == "deterministic") {
      set(element, 0.0);
      setAt(element, axis, valueOf(element, axis, xml::attribute(element, "val")));
    } else if (type == "persistent") {
      setPersistent(element, axis);
    } else if (type == "uniform") {
      set(element, 1.0 / factor_.axes()[axis].domain->size());
    } else {
      xml::refuse(element, "SubDAG type '" + type +
                               "' is none of deterministic, persistent, uniform, template");
    }
  }

  void readTemplate(const XMLElement& element) {
    const auto id = xml::attribute(element, "idref");
    const auto found = templates_.find(id);
    if (found == templates_.end()) xml::refuse(element, "no SubDAGTemplate '" + id + "'");
    if (!open_.insert(id).second) xml::refuse(element, "template '" + id + "' is inside itself");
    readInside(*found->second);
    open_.erase(id);
  }

  void setPersistent(const XMLElement& element, size_t axis) {
    const auto& name = factor_.axes()[axis].name;
    const auto before = previous_(name);
    if (before.empty()) {
      xml::refuse(element, "persistent: '" + name + "' is no state variable after the step");
    }
    const size_t source = axisOf(element, before);
    set(element, 0.0);
    const int fixed = path_[source];
    for (int i = 0; i < factor_.axes()[axis].domain->size(); ++i) {
      if (fixed >= 0 && fixed != i) continue;
      path_[source] = i;
      setAt(element, axis, i);
    }
    path_[source] = fixed;
  }

  /// 1 for one value of the axis, wherever the path agrees with it.
  void setAt(const XMLElement& element, size_t axis, int value) {
    const int before = path_[axis];
    if (before >= 0 && before != value) return;
    path_[axis] = value;
    set(element, 1.0);
    path_[axis] = before;
  }

  void set(const XMLElement& element, double value) {
    try {
      factor_.assign(path_, value);
    } catch (const ModelError& error) {
      xml::refuse(element, error.what());
    }
  }

  [[nodiscard]] size_t axisOf(const XMLElement& element, const std::string& name) const {
    const auto& axes = factor_.axes();
    for (size_t i = 0; i < axes.size(); ++i) {
      if (axes[i].name == name && axes[i].variable >= 0) return i;
    }
    xml::refuse(element, std::string("<") + element.Name() + ">: '" + name +
                             "' is neither Var nor Parent here");
  }

  [[nodiscard]] int valueOf(const XMLElement& element, size_t axis, const std::string& word) const {
    const auto& domain = *factor_.axes()[axis].domain;
    const int value = domain.find(word);
    if (value >= 0) return value;
    xml::refuse(element, std::string("<") + element.Name() + ">: '" + word + "' is no value of " +
                             factor_.axes()[axis].name + " (" + join(domain.names(), ", ") + ")");
  }

  Factor& factor_;
  const std::function<std::string(const std::string&)>& previous_;
  std::map<std::string, const XMLElement*> templates_;
  std::set<std::string> open_;  // templates being read
  Picks path_;                  // the values on the edges so far
};

}  // namespace

void readDiagram(const XMLElement& parameter, Factor& factor,
                 const std::function<std::string(const std::string&)>& previous) {
  DiagramReader(factor, previous).read(parameter);
}

}  // namespace fabric::planner
