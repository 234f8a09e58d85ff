// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/model_file.hpp"

#include "fabric_planner/pomdp_file.hpp"
#include "fabric_planner/pomdpx.hpp"
#include "file.hpp"

namespace fabric::planner {
namespace {

/// Does the text begin with a tag, after blanks and a byte order mark?
bool isXml(const std::string& bytes) {
  const auto start = bytes.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return start != std::string::npos && bytes[start] == '<';
}

}  // namespace

Pomdp loadModel(const std::string& path, bool normalise) {
  return loadWith(path, [&](const std::string& bytes, const std::string& name) {
    return isXml(bytes) ? parsePomdpx(bytes, name, normalise)
                        : parsePomdpFile(bytes, name, normalise);
  });
}

}  // namespace fabric::planner
