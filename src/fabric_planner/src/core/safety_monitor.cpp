// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/safety_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "fabric_planner/pomdp.hpp"
#include "file.hpp"
#include "yaml_section.hpp"

namespace fabric::planner {
namespace {

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f m", value);
  return text;
}

std::string seconds(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f s", value);
  return text;
}

void requireFinite(const Point3& point, double stamp, const std::string& what) {
  if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z) &&
      std::isfinite(stamp)) {
    return;
  }
  throw std::invalid_argument(what + ": (" + std::to_string(point.x) + ", " +
                              std::to_string(point.y) + ", " + std::to_string(point.z) + ") at " +
                              std::to_string(stamp) + " s is not finite");
}

double toSegment(const Point3& p, const Point3& a, const Point3& b) {
  const Point3 d{b.x - a.x, b.y - a.y, b.z - a.z};
  const double length2 = d.x * d.x + d.y * d.y + d.z * d.z;
  const double along = (p.x - a.x) * d.x + (p.y - a.y) * d.y + (p.z - a.z) * d.z;
  const double t = length2 > 0.0 ? std::clamp(along / length2, 0.0, 1.0) : 0.0;
  return std::hypot(p.x - a.x - t * d.x, p.y - a.y - t * d.y, p.z - a.z - t * d.z);
}

}  // namespace

ArmPlace ArmPlace::load(const std::string& path) {
  const YAML::Node root = yaml::load(readFile(path), path);
  const auto frames = yaml::Section::named(root["frames"], path + ": frames");
  const ToolPose pose = frames.pose("arm_base_link");
  return {{pose.x, pose.y, pose.z}, pose.yaw};
}

Point3 ArmPlace::fromCell(const Point3& point) const {
  const double x = point.x - origin.x;
  const double y = point.y - origin.y;
  const double c = std::cos(yaw);
  const double s = std::sin(yaw);
  return {c * x + s * y, c * y - s * x, point.z - origin.z};
}

ArmLinks ArmLinks::load(const std::string& path) {
  const YAML::Node root = yaml::load(readFile(path), path);
  const auto links = yaml::Section::named(root["links"], path + ": links");
  return {links.positive("rear_arm"), links.positive("forearm"), links.atLeastZero("tool_x")};
}

SafetyParameters SafetyParameters::load(const std::string& path) {
  return parse(readFile(path), path);
}

SafetyParameters SafetyParameters::parse(const std::string& text, const std::string& name) {
  const yaml::Section file(
      yaml::load(text, name), name,
      {"slow_distance", "stop_distance", "hysteresis", "slow_factor", "stale_after", "gone_after"});
  SafetyParameters p;
  p.slow_distance = file.positive("slow_distance");
  p.stop_distance = file.positive("stop_distance");
  p.hysteresis = file.atLeastZero("hysteresis");
  p.slow_factor = file.positive("slow_factor");
  p.stale_after = file.positive("stale_after");
  p.gone_after = file.atLeastZero("gone_after");
  if (p.slow_distance <= p.stop_distance) {
    throw ModelError(file.placeOf("slow_distance") + ": " + std::to_string(p.slow_distance) +
                     " is not more than stop_distance, " + std::to_string(p.stop_distance));
  }
  if (p.slow_factor > 1.0) {
    throw ModelError(file.placeOf("slow_factor") + ": " + std::to_string(p.slow_factor) +
                     " is more than 1");
  }
  return p;
}

void SafetyMonitor::onTool(double stamp, const Point3& tool) {
  requireFinite(tool, stamp, "arm/tcp");
  tool_ = tool;
  tool_stamp_ = stamp;
}

void SafetyMonitor::onHand(const SeenHand& hand) {
  if (std::isnan(hand.age) || hand.age < 0.0) {
    throw std::invalid_argument("human/hand: age " + std::to_string(hand.age));
  }
  requireFinite(std::isinf(hand.age) ? Point3() : hand.position, hand.stamp, "human/hand");
  hand_ = hand;
}

const SeparationState& SafetyMonitor::assess(double now) {
  const std::string distrusted = distrust(now);
  if (distrusted.empty()) {
    state_ = judge();
  } else {
    const bool stopped = state_.level == Separation::STOP;
    state_.level = stopped ? Separation::STOP : Separation::SLOW;
    state_.cause = distrusted;
  }
  return state_;
}

double SafetyMonitor::newest() const {
  return std::max(tool_stamp_.value_or(0.0), hand_ ? hand_->stamp : 0.0);
}

/// Why what is known cannot be trusted; empty when it can.
std::string SafetyMonitor::distrust(double now) const {
  if (!tool_stamp_) return "arm/tcp has not come yet";
  if (!hand_) return "human/hand has not come yet";
  const auto old = [&](const std::string& topic, double stamp) -> std::string {
    if (std::abs(now - stamp) <= parameters_.stale_after) return "";
    return topic + (stamp < now ? " is " + seconds(now - stamp) + " old"
                                : " is " + seconds(stamp - now) + " ahead of time");
  };
  const std::string tool = old("arm/tcp", *tool_stamp_);
  return tool.empty() ? old("human/hand", hand_->stamp) : tool;
}

/// A hand out of view is where it was seen last; when it is gone for long it may be anywhere near
/// there, which is slow but no stop.
SeparationState SafetyMonitor::judge() {
  const SafetyParameters& p = parameters_;
  if (std::isinf(hand_->age)) {
    zone_ = Separation::RUN;
    return {Separation::RUN, std::numeric_limits<double>::infinity(), ""};
  }
  const double d = distance(hand_->position, tool_);
  const auto within = [&](double limit, Separation level) {
    return d < limit + (zone_ >= level ? p.hysteresis : 0.0);
  };
  const bool stop = within(p.stop_distance, Separation::STOP);
  const bool slow = within(p.slow_distance, Separation::SLOW);
  const bool gone = !hand_->visible && hand_->age > p.gone_after;
  zone_ = stop && !gone ? Separation::STOP : slow ? Separation::SLOW : Separation::RUN;
  if (zone_ == Separation::RUN) return {zone_, d, ""};
  const std::string near = "the hand is " + metres(d) + " from the arm";
  if (zone_ == Separation::STOP) {
    return {zone_, d, near + "; goes on beyond " + metres(p.stop_distance + p.hysteresis)};
  }
  return {zone_, d, gone ? "the hand was lost from view " + metres(d) + " from the arm" : near};
}

/// Elbow up, in the plane through the base's axis and the tool; out of reach, as stretched as can
/// be.
std::array<Point3, 4> SafetyMonitor::links(const Point3& tool) const {
  const double L1 = links_.rear_arm;
  const double L2 = links_.forearm;
  const double out = std::hypot(tool.x, tool.y);
  const double c = out > 0.0 ? tool.x / out : 1.0;
  const double s = out > 0.0 ? tool.y / out : 0.0;
  const double h = out - links_.tool_x;
  const double d = std::max(std::hypot(h, tool.z), 1e-9);
  const double cosine = std::clamp((L1 * L1 + d * d - L2 * L2) / (2.0 * L1 * d), -1.0, 1.0);
  const double rise = std::atan2(tool.z, h) + std::acos(cosine);
  const double elbow = L1 * std::cos(rise);
  return {{{}, {c * elbow, s * elbow, L1 * std::sin(rise)}, {c * h, s * h, tool.z}, tool}};
}

double SafetyMonitor::distance(const Point3& point, const Point3& tool) const {
  const std::array<Point3, 4> joints = links(tool);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < joints.size(); ++i) {
    least = std::min(least, toSegment(point, joints[i - 1], joints[i]));
  }
  return least;
}

}  // namespace fabric::planner
