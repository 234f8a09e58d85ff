// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>

#include "targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fabric::planner::Pomdp model = fabric::planner::fuzzing::policyModel();
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  fabric::planner::fuzzing::readPolicy(bytes, model);
  return 0;
}
