// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/motion_script.hpp"

namespace fabric::planner {
namespace {

Step act(StepKind kind, Phase phase) {
  Step step;
  step.kind = kind;
  step.phase = phase;
  return step;
}

Step lowStep(Step step, const ToolPose& above) {
  step.low = above;
  return step;
}

Step farStep(Step step) {
  step.far = true;
  return step;
}

}  // namespace

Script operator+(Script head, const Script& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

Step ScriptWriter::move(Phase phase, const ToolPose& target, double speed, double settle) const {
  Step step;
  step.phase = phase;
  step.target = target;
  step.speed = speed;
  step.settle = settle;
  return step;
}

Script ScriptWriter::free(const Entanglement& from) const {
  Script script;
  if (from.low) {
    const Step rise = move(Phase::RETREAT, *from.low, config_.vertical_speed);
    script.push_back(lowStep(from.far ? farStep(rise) : rise, *from.low));
  }
  if (from.far) {
    script.push_back(farStep(move(Phase::RETREAT, config_.side, config_.travel_speed)));
  }
  return script;
}

Script ScriptWriter::putBack(const Entanglement& from) const {
  const ToolPose& place = from.at_pick ? config_.pick : config_.drop_back;
  const ToolPose above = place.at(config_.above_pick);
  Script script;
  if (!from.at_pick) {
    script = free(from);
    for (Step& step : script) step.phase = Phase::CARRY;
    script.push_back(move(Phase::CARRY, above, config_.travel_speed));
  }
  script.push_back(lowStep(move(Phase::CARRY, place, config_.vertical_speed), above));
  script.push_back(act(StepKind::SUCTION_OFF, Phase::CONTACT));
  script.push_back(
      lowStep(move(Phase::CONTACT, place, config_.vertical_speed, config_.release_time), above));
  script.push_back(lowStep(move(Phase::RETREAT, above, config_.vertical_speed), above));
  return script;
}

Script ScriptWriter::home() const {
  return {move(Phase::RETREAT, config_.home, config_.withdraw_speed)};
}

Script ScriptWriter::plan() const {
  Step step = move(Phase::APPROACH, config_.planning, config_.travel_speed, config_.plan_time);
  step.planned = true;
  return {step};
}

Script ScriptWriter::point() const {
  const double speed = config_.gesture_speed;
  Script script = {move(Phase::APPROACH, config_.attention, speed)};
  for (int nod = 0; nod < config_.nods; ++nod) {
    script.push_back(move(Phase::APPROACH, config_.point, speed));
    script.push_back(
        move(Phase::APPROACH, config_.point.at(config_.point.z - config_.nod_depth), speed));
  }
  return script + Script{move(Phase::RETREAT, config_.home, speed)};
}

Script ScriptWriter::pick() const {
  const ToolPose above = config_.pick.at(config_.above_pick);
  const double down = config_.vertical_speed;
  return {
      move(Phase::APPROACH, above, config_.travel_speed),
      act(StepKind::CHECK_CUBE, Phase::APPROACH),
      lowStep(move(Phase::APPROACH, config_.pick, down), above),
      act(StepKind::SUCTION_ON, Phase::CONTACT),
      lowStep(move(Phase::CONTACT, config_.pick, down, config_.grip_time), above),
      act(StepKind::CHECK_GRIP, Phase::CONTACT),
      lowStep(move(Phase::CARRY, above, down), above),
      act(StepKind::CHECK_LIFT, Phase::CARRY),
  };
}

Script ScriptWriter::place(const ToolPose& slot) const {
  const ToolPose above = slot.at(config_.above_tray);
  const double down = config_.vertical_speed;
  return {
      move(Phase::CARRY, config_.side, config_.travel_speed),
      farStep(move(Phase::CARRY, above, config_.travel_speed)),
      farStep(lowStep(move(Phase::CARRY, slot, down), above)),
      act(StepKind::SUCTION_OFF, Phase::CONTACT),
      farStep(lowStep(move(Phase::CONTACT, slot, down, config_.release_time), above)),
      farStep(lowStep(move(Phase::RETREAT, above, down), above)),
      farStep(move(Phase::RETREAT, config_.side, config_.travel_speed)),
      move(Phase::RETREAT, config_.home, config_.withdraw_speed),
  };
}

}  // namespace fabric::planner
