// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// The bytes of a file. @throw ModelError when it cannot be read.
std::string readFile(const std::string& path);

/// The same without the path in the message; an empty file is fine.
std::string readBytes(const std::string& path);

/// parse(bytes, name) of a file; name: the file's without folder and ending.
/// @throw ModelError when it cannot be read, and what parse throws with the path before it.
template <typename Parse>
auto loadWith(const std::string& path, const Parse& parse) {
  try {
    if (!std::filesystem::is_regular_file(path)) throw ModelError("no such file");
    return parse(readBytes(path), std::filesystem::path(path).stem().string());
  } catch (const ModelError& error) {
    throw ModelError(path + ": " + error.what());
  }
}

/// SHA-256 in lower-case hexadecimal digits, as `sha256sum` prints it.
std::string sha256(const std::string& bytes);

}  // namespace fabric::planner
