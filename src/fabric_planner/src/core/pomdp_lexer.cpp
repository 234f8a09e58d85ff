// SPDX-License-Identifier: BSD-3-Clause
#include "pomdp_lexer.hpp"

#include <algorithm>

namespace fabric::planner {
namespace {

constexpr std::string_view BLANKS = " \t\r\n\v\f";
constexpr std::string_view STOPS = " \t\r\n\v\f:#";

}  // namespace

PomdpLexer::PomdpLexer(std::string_view bytes) : rest_(bytes) {
  constexpr std::string_view BYTE_ORDER_MARK = "\xEF\xBB\xBF";
  if (rest_.substr(0, 3) == BYTE_ORDER_MARK) rest_.remove_prefix(3);
  for (auto& token : next_) token = scan();
}

PomdpLexer::Token PomdpLexer::take() {
  const Token taken = next_[0];
  next_ = {next_[1], next_[2], scan()};
  return taken;
}

bool PomdpLexer::takeIf(std::string_view text) {
  if (peek().text != text) return false;
  take();
  return true;
}

bool PomdpLexer::atHeader() const {
  constexpr std::array<std::string_view, 9> KEYWORDS = {
      "discount", "values", "states", "actions", "observations", "start", "T", "O", "R"};
  if (std::find(KEYWORDS.begin(), KEYWORDS.end(), peek().text) == KEYWORDS.end()) return false;
  const auto& after = peek(1).text;
  return after == ":" || (peek().text == "start" && (after == "include" || after == "exclude") &&
                          peek(2).text == ":");
}

PomdpLexer::Token PomdpLexer::scan() {
  while (!rest_.empty()) {
    const char c = rest_[0];
    if (c == '#') {
      rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
    } else if (BLANKS.find(c) != std::string_view::npos) {
      line_ += c == '\n' ? 1 : 0;
      rest_.remove_prefix(1);
    } else {
      const auto length = c == ':' ? 1 : std::min(rest_.find_first_of(STOPS), rest_.size());
      const Token token{rest_.substr(0, length), line_};
      rest_.remove_prefix(length);
      return token;
    }
  }
  return {{}, line_};
}

}  // namespace fabric::planner
