// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace fabric::planner {

/// A number as it is printed in messages: up to ten digits.
std::string text(double value);

std::string join(const std::vector<std::string>& words, const std::string& separator);

/// Words separated by blanks of any kind.
std::vector<std::string> split(const std::string& line);

}  // namespace fabric::planner
