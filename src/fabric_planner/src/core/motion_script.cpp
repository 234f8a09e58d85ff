// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/motion_script.hpp"

#include <algorithm>
#include <iterator>

namespace fabric::planner {
namespace {

using Steps = std::vector<GestureStep>;
using At = Steps::const_iterator;

/// Where the places are that only this play of a gesture knows.
struct Places {
  ToolPose tray;
  ToolPose back;
};

Step act(StepKind kind, Phase phase) {
  Step step;
  step.kind = kind;
  step.phase = phase;
  return step;
}

At firstSwitch(const Steps& steps, bool on) {
  return std::find_if(steps.begin(), steps.end(),
                      [on](const GestureStep& step) { return step.suction == on; });
}

/// The end of what belongs to a switch of the suction: stand there, and rise.
At afterSwitch(const Steps& steps, bool on) { return std::next(firstSwitch(steps, on), 3); }

/// The first of the way-points home that end a gesture.
At wayHome(const Steps& steps) {
  auto step = steps.end();
  while (step != steps.begin() && !std::prev(step)->suction &&
         std::prev(step)->way_point.place == "home") {
    --step;
  }
  return step;
}

/// Lays the steps of a gesture as the steps of a script.
class Layer {
 public:
  Layer(const MotionConfig& config, const Places& places, Phase phase)
      : config_(config), places_(places), phase_(phase) {}

  /// Before `home`, what moves is on its way; from there on it withdraws.
  Script lay(At begin, At end, At home) {
    for (auto step = begin; step != end; ++step) {
      if (step == home) phase_ = Phase::RETREAT;
      if (step->suction) {
        switchTo(*step->suction);
      } else {
        go(step->way_point);
      }
    }
    return script_;
  }

  [[nodiscard]] ToolPose target(const WayPoint& point) const {
    const ToolPose place = placeOf(point.place);
    return point.above ? place.at(heightOver(point.place)) : place + point.offset;
  }

 private:
  void switchTo(bool on) {
    script_.push_back(act(on ? StepKind::SUCTION_ON : StepKind::SUCTION_OFF, Phase::CONTACT));
    phase_ = on ? Phase::CARRY : Phase::RETREAT;
    switched_ = true;
  }

  void go(const WayPoint& point) {
    Step step;
    step.phase = switched_ ? Phase::CONTACT : phase_;
    step.target = target(point);
    step.speed = point.speed;
    step.settle = point.hold;
    if (point.isDown() || leaves_down_) step.low = step.target.at(heightOver(point.place));
    step.far = point.place == TRAY || leaves_tray_;
    script_.push_back(step);
    leaves_down_ = point.isDown();
    leaves_tray_ = point.place == TRAY;
    switched_ = false;
  }

  [[nodiscard]] ToolPose placeOf(const std::string& name) const {
    if (name == TRAY) return places_.tray;
    return name == BACK ? places_.back : config_.poses.at(name);
  }

  [[nodiscard]] double heightOver(const std::string& place) const {
    return place == TRAY ? config_.above_tray : config_.above_pick;
  }

  const MotionConfig& config_;
  Places places_;
  Phase phase_;
  Script script_;
  bool switched_ = false;     // right before
  bool leaves_down_ = false;  // the step before was down among obstacles
  bool leaves_tray_ = false;
};

}  // namespace

Script operator+(Script head, const Script& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

Step ScriptWriter::move(Phase phase, const ToolPose& target, double speed) const {
  Step step;
  step.phase = phase;
  step.target = target;
  step.speed = speed;
  return step;
}

Script ScriptWriter::free(const Entanglement& from) const {
  Script script;
  if (from.low) {
    Step rise = move(Phase::RETREAT, *from.low, config_.verticalSpeed());
    rise.low = from.low;
    rise.far = from.far;
    script.push_back(rise);
  }
  if (from.far) {
    script.push_back(move(Phase::RETREAT, config_.side(), config_.travelSpeed()));
    script.back().far = true;
  }
  return script;
}

Script ScriptWriter::putBack(const Gesture& cancel, const Entanglement& from) const {
  const Steps& steps = cancel.steps;
  const Places places{{}, from.at_pick ? config_.pick() : config_.dropBack()};
  auto begin = steps.begin();
  Script script;
  if (from.at_pick) {
    begin = std::find_if(steps.begin(), steps.end(), [](const GestureStep& step) {
      return !step.suction && step.way_point.isAt(BACK);
    });
  } else {
    script = free(from);
    for (Step& step : script) step.phase = Phase::CARRY;
  }
  Layer layer(config_, places, Phase::CARRY);
  return script + layer.lay(begin, afterSwitch(steps, false), steps.end());
}

Script ScriptWriter::withdraw(const Gesture& cancel) const {
  const Steps& steps = cancel.steps;
  Layer layer(config_, {}, Phase::RETREAT);
  return layer.lay(afterSwitch(steps, false), steps.end(), steps.end());
}

Script ScriptWriter::show(const Gesture& gesture) const {
  const Steps& steps = gesture.steps;
  return Layer(config_, {}, Phase::APPROACH).lay(steps.begin(), steps.end(), wayHome(steps));
}

Script ScriptWriter::plan(const Gesture& gesture) const {
  Script script = show(gesture);
  script.back().planned = true;
  return script;
}

Script ScriptWriter::pick(const Gesture& grasp) const {
  const Steps& steps = grasp.steps;
  Layer layer(config_, {}, Phase::APPROACH);
  const Script moves = layer.lay(steps.begin(), afterSwitch(steps, true), steps.end());
  Script script;
  bool checked = false;
  for (const Step& step : moves) {
    if (!checked && step.low) {
      script.push_back(act(StepKind::CHECK_CUBE, Phase::APPROACH));
      checked = true;
    }
    const bool lifts = &step == &moves.back();
    if (lifts) script.push_back(act(StepKind::CHECK_GRIP, Phase::CONTACT));
    script.push_back(step);
    if (lifts) script.push_back(act(StepKind::CHECK_LIFT, Phase::CARRY));
  }
  return script;
}

Script ScriptWriter::place(const Gesture& grasp, const ToolPose& slot) const {
  const Steps& steps = grasp.steps;
  const Places places{slot, {}};
  Layer layer(config_, places, Phase::CARRY);
  return layer.lay(afterSwitch(steps, true), steps.end(), wayHome(steps));
}

ToolPose ScriptWriter::endOf(const Gesture& gesture) const {
  return Layer(config_, {}, Phase::REST).target(gesture.steps.back().way_point);
}

}  // namespace fabric::planner
