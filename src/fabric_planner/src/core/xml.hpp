// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tinyxml2.h>

#include <string>
#include <string_view>
#include <vector>

namespace fabric::planner::xml {

using tinyxml2::XMLElement;

/// Parses a whole document and returns its root, which lives as long as the document.
/// @throw ModelError naming the line where it is not well-formed, or the root when it is another.
const XMLElement& parse(tinyxml2::XMLDocument& document, std::string_view bytes,
                        const std::string& root_name);

/// @throw ModelError always: the line, then what is wrong there.
[[noreturn]] void refuse(const XMLElement& at, const std::string& what);
/// Refuses an element that should not be where it is.
[[noreturn]] void refuseUnknown(const XMLElement& element);

/// What stands between the tags; comments do not count.
std::string content(const XMLElement& element);
std::vector<std::string> words(const XMLElement& element);
std::string onlyWord(const XMLElement& element);

/// The only child of that name.
const XMLElement& child(const XMLElement& parent, const char* name);
/// All elements inside, in order.
std::vector<const XMLElement*> children(const XMLElement& parent);
/// An attribute that is one word.
std::string attribute(const XMLElement& element, const char* name);
/// An attribute that is a number in 0 .. limit.
int count(const XMLElement& element, const char* name, int limit);

}  // namespace fabric::planner::xml
