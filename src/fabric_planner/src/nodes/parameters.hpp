// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace fabric::planner {

/// A parameter is missing or bad; the message names it fully.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The private parameter of that name. @throw ParameterError when it is missing or of another type.
template <class T>
T require(const ros::NodeHandle& node, const std::string& name) {
  T value;
  if (node.getParam(name, value)) return value;
  const std::string full = node.resolveName(name);
  throw ParameterError(node.hasParam(name) ? full + " has the wrong type" : full + " is missing");
}

/// A finite number of at least `least`. @throw ParameterError
inline double requireNumber(const ros::NodeHandle& node, const std::string& name, double least) {
  const double value = require<double>(node, name);
  if (std::isfinite(value) && value >= least) return value;
  throw ParameterError(node.resolveName(name) + " is " + std::to_string(value) +
                       "; it must be a finite number of at least " + std::to_string(least));
}

}  // namespace fabric::planner
