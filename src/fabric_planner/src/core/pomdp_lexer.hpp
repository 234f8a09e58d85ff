// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string_view>

namespace fabric::planner {

/// The words of a .pomdp file: what stands between blanks; a colon is a word of its own, and `#`
/// hides the rest of its line.
class PomdpLexer {
 public:
  struct Token {
    std::string_view text;  ///< empty at the end of the file
    int line = 0;
  };

  explicit PomdpLexer(std::string_view bytes);

  /// The token `ahead` of the next one, 0 .. 2.
  [[nodiscard]] const Token& peek(int ahead = 0) const {
    return next_[static_cast<std::size_t>(ahead)];
  }
  Token take();
  /// Takes the next token if it is that one.
  bool takeIf(std::string_view text);
  [[nodiscard]] bool atEnd() const { return next_[0].text.empty(); }
  /// Does a new part of the file begin here: a keyword and a colon?
  [[nodiscard]] bool atHeader() const;

 private:
  Token scan();

  std::string_view rest_;
  int line_ = 1;
  std::array<Token, 3> next_;
};

}  // namespace fabric::planner
