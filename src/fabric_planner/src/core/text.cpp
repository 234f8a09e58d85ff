// SPDX-License-Identifier: BSD-3-Clause
#include "text.hpp"

#include <sstream>

namespace fabric::planner {
namespace {

constexpr const char* BLANKS = " \t\r\n\v\f";

}  // namespace

std::string text(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

std::string digits(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return std::string(buffer, end);
}

std::string join(const std::vector<std::string>& words, const std::string& separator) {
  std::string joined;
  for (size_t i = 0; i < words.size(); ++i) joined += (i == 0 ? "" : separator) + words[i];
  return joined;
}

std::vector<std::string> split(const std::string& line) {
  Words words(line);
  std::vector<std::string> all;
  for (auto word = words.next(); !word.empty(); word = words.next()) all.emplace_back(word);
  return all;
}

std::string_view Words::next() {
  const auto start = rest_.find_first_not_of(BLANKS);
  if (start == std::string_view::npos) return rest_ = {};
  rest_.remove_prefix(start);
  const auto word = rest_.substr(0, rest_.find_first_of(BLANKS));
  rest_.remove_prefix(word.size());
  return word;
}

}  // namespace fabric::planner
