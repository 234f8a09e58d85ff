// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// A number as it is printed in messages: up to ten digits.
std::string text(double value);

/// The shortest digits that read back as the same number.
std::string digits(double value);

std::string join(const std::vector<std::string>& words, const std::string& separator);

/// Words separated by blanks of any kind.
std::vector<std::string> split(const std::string& line);

/// Hands out the words of a text one by one, without copying them.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}
  /// The next word, empty when there is none left.
  std::string_view next();

 private:
  std::string_view rest_;
};

/// A finite number. place: called for the words that begin a message.
/// @throw ModelError when the token is none; NaN and infinity are refused by name.
template <typename Place>
double number(std::string_view token, const Place& place) {
  const auto refuse = [&](const char* what) {
    throw ModelError(place() + ": '" + std::string(token) + "' is " + what);
  };
  const bool plus = token.size() > 1 && token[0] == '+' && token[1] != '-';
  double value = 0.0;
  const char* end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data() + (plus ? 1 : 0), end, value);
  if (error == std::errc::result_out_of_range) refuse("out of the range of numbers");
  if (error != std::errc() || stop != end) refuse("not a number");
  if (std::isnan(value)) refuse("NaN");
  if (std::isinf(value)) refuse("infinite");
  return value;
}

}  // namespace fabric::planner
