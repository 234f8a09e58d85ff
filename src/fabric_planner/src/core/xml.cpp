// SPDX-License-Identifier: BSD-3-Clause
#include "xml.hpp"

#include <algorithm>

#include "text.hpp"

namespace fabric::planner::xml {
namespace {

[[noreturn]] void refuseLine(std::ptrdiff_t line, const std::string& what) {
  throw ModelError("line " + std::to_string(line) + ": " + what);
}

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
    refuseLine(node.GetLineNum() + lines, "not well-formed XML ('--' inside a comment)");
  }
  for (const auto* e = node.FirstChild(); e != nullptr; e = e->NextSibling()) checkWellFormed(*e);
}

}  // namespace

const XMLElement& parse(tinyxml2::XMLDocument& document, std::string_view bytes,
                        const std::string& root_name) {
  const auto nul = std::find(bytes.begin(), bytes.end(), '\0');
  if (nul != bytes.end()) {
    refuseLine(1 + std::count(bytes.begin(), nul, '\n'), "not well-formed XML (a byte that is 0)");
  }
  if (document.Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS) {
    refuseLine(document.ErrorLineNum(),
               std::string("not well-formed XML (") +
                   tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID()) + ")");
  }
  checkWellFormed(document);
  const auto* root = document.RootElement();
  if (root == nullptr) throw ModelError("no <" + root_name + "> element");
  if (const auto* second = root->NextSiblingElement()) refuse(*second, "a second root element");
  if (root->Name() != root_name) {
    refuse(*root, std::string("<") + root->Name() + "> instead of <" + root_name + ">");
  }
  return *root;
}

void refuse(const XMLElement& at, const std::string& what) { refuseLine(at.GetLineNum(), what); }

void refuseUnknown(const XMLElement& element) {
  const auto* parent = element.Parent()->ToElement();
  refuse(element, std::string("unknown <") + element.Name() + "> in <" +
                      (parent == nullptr ? "" : parent->Name()) + ">");
}

std::string content(const XMLElement& element) {
  std::string all;
  for (const auto* node = element.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (const auto* chars = node->ToText()) all.append(all.empty() ? "" : " ") += chars->Value();
    if (const auto* inner = node->ToElement()) {
      refuse(*inner, std::string("unexpected <") + inner->Name() + "> in <" + element.Name() + ">");
    }
  }
  return all;
}

std::vector<std::string> words(const XMLElement& element) { return split(content(element)); }

std::string onlyWord(const XMLElement& element) {
  const auto found = words(element);
  if (found.size() != 1) {
    refuse(element, std::string("<") + element.Name() + "> needs exactly one word");
  }
  return found[0];
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

std::vector<const XMLElement*> children(const XMLElement& parent) {
  std::vector<const XMLElement*> all;
  for (const auto* e = parent.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    all.push_back(e);
  }
  return all;
}

std::string attribute(const XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  const auto tokens = split(value == nullptr ? "" : value);
  if (tokens.size() != 1) {
    refuse(element, std::string("<") + element.Name() + "> needs " + name + "=\"one name\"");
  }
  return tokens[0];
}

int count(const XMLElement& element, const char* name, int limit) {
  const auto word = attribute(element, name);
  int value = -1;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (error == std::errc() && stop == end && value >= 0 && value <= limit) return value;
  refuse(element, std::string("<") + element.Name() + ">: " + name + "='" + word +
                      "' is not in 0.." + std::to_string(limit));
}

}  // namespace fabric::planner::xml
