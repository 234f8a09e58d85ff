// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace fabric::planner {

/// The bytes of a file. @throw ModelError when it cannot be read.
std::string readFile(const std::string& path);

/// SHA-256 in lower-case hexadecimal digits, as `sha256sum` prints it.
std::string sha256(const std::string& bytes);

}  // namespace fabric::planner
