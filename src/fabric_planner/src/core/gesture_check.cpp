// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/pomdp.hpp"
#include "gesture_file.hpp"

namespace fabric::planner {
namespace {

/// The steps of a gesture by their numbers in the file, with what an error begins with.
class Checked {
 public:
  Checked(const Gesture& gesture, const std::string& place) : gesture_(gesture), place_(place) {
    for (std::size_t i = 0; i < gesture.steps.size(); ++i) {
      (gesture.steps[i].suction ? switches_ : ways_).push_back(i);
    }
    if (ways_.empty()) throw ModelError(place + ": no way-point");
  }

  void check() const {
    for (std::size_t k = 0; k < ways_.size(); ++k) {
      checkPlace(ways_[k]);
      if (k > 0) checkLeg(ways_[k - 1], ways_[k]);
    }
    if (way(ways_.front()).isDown()) refuse(ways_.front(), "begins down there; begin above");
    if (way(ways_.back()).isDown()) refuse(ways_.back(), "ends down there; end above");
    if (way(ways_.front()).place == TRAY) refuse(ways_.front(), "begins there; begin at side");
    if (gesture_.action != Action::PLANNING && !isHome(way(ways_.back()))) {
      refuse(ways_.back(), "ends there; '" + actionName(gesture_.action) + "' has to end at home");
    }
    checkSuction();
  }

 private:
  [[noreturn]] void refuse(std::size_t step, const std::string& what) const {
    const std::string name = gesture_.steps[step].suction ? "suction" : "'" + way(step).place + "'";
    throw ModelError(place_ + ": step " + std::to_string(step + 1) + ": " + name + ": " + what);
  }

  [[nodiscard]] const WayPoint& way(std::size_t step) const {
    return gesture_.steps[step].way_point;
  }

  static bool isHome(const WayPoint& point) {
    return point.place == "home" && point.offset == ToolPose();
  }
  static bool isSide(const WayPoint& point) {
    return point.place == "side" && point.offset == ToolPose();
  }

  void checkPlace(std::size_t step) const {
    const std::string& place = way(step).place;
    if (place == TRAY && gesture_.action != Action::GRASP) refuse(step, "only in a grasp");
    if (place == BACK && gesture_.action != Action::CANCEL) refuse(step, "only in a cancel");
  }

  /// Straight down, straight up, and to the trays and back by way of `side`.
  void checkLeg(std::size_t from, std::size_t to) const {
    const WayPoint& a = way(from);
    const WayPoint& b = way(to);
    if (a.place != b.place && b.isDown()) refuse(to, "straight down from '" + a.place + "'");
    if (a.place != b.place && a.isDown()) refuse(to, "straight from down at '" + a.place + "'");
    if (b.place == TRAY && a.place != TRAY && !isSide(a)) refuse(to, "not by way of side");
    if (a.place == TRAY && b.place != TRAY && !isSide(b)) refuse(to, "not back by way of side");
  }

  void checkSuction() const {
    switch (gesture_.action) {
      case Action::GRASP:
        expectSwitches({{true, "pick"}, {false, TRAY}});
        return;
      case Action::CANCEL:
        expectSwitches({{false, BACK}});
        return;
      default:
        if (!switches_.empty()) refuse(switches_.front(), "only in a grasp or a cancel");
    }
  }

  /// Each switch happens down at its place; the tool then stands there, and rises.
  void expectSwitches(const std::vector<std::pair<bool, std::string>>& expected) const {
    if (switches_.size() != expected.size()) {
      throw ModelError(place_ + ": switches the suction " + std::to_string(switches_.size()) +
                       " times; '" + actionName(gesture_.action) + "' does it " +
                       std::to_string(expected.size()) + " times");
    }
    for (std::size_t k = 0; k < expected.size(); ++k) {
      const auto& [on, place] = expected[k];
      const std::size_t step = switches_[k];
      if (gesture_.steps[step].suction != on) refuse(step, on ? "expected on" : "expected off");
      if (!standsAround(step, place)) {
        refuse(step, "expected '" + place + "' right before it and after it, then above it");
      }
    }
  }

  [[nodiscard]] bool standsAround(std::size_t step, const std::string& place) const {
    const auto at = [&](std::size_t i) {
      return i < gesture_.steps.size() && way(i).isAt(place) && way(i).offset == ToolPose();
    };
    return step > 0 && at(step - 1) && at(step + 1) && step + 2 < gesture_.steps.size() &&
           way(step + 2).isAbove(place);
  }

  const Gesture& gesture_;
  const std::string& place_;
  std::vector<std::size_t> ways_;
  std::vector<std::size_t> switches_;
};

}  // namespace

void checkGesture(const Gesture& gesture, const std::string& place) {
  Checked(gesture, place).check();
}

}  // namespace fabric::planner
