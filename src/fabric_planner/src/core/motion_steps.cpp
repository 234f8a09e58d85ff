// SPDX-License-Identifier: BSD-3-Clause
// The part of the motion agent that carries out a script step by step.
#include <cmath>

#include "fabric_planner/motion_agent.hpp"

namespace fabric::planner {
namespace {

constexpr double AT_GOAL = 0.001;  // m, from the goal: the arm only waits there yet

}  // namespace

Script MotionAgent::write(Action action) const {
  const bool named = !gesture_.empty() && state_.current == action;
  const bool rests = !named && !suction_ && !outstanding_;
  const Gesture& gesture = gestureOf(action);
  const Gesture& cancel = gestureOf(Action::CANCEL);
  switch (action) {
    case Action::PLANNING:
      if (rests && state_.planned && standsAt(writer_.endOf(gesture))) return {};
      return wayOut(cancel) + writer_.plan(gesture);
    case Action::POINT:
      return wayOut(cancel) + writer_.show(gesture);
    case Action::GRASP:
      return wayOut(cancel) +
             (state_.planned ? Script() : writer_.plan(gestureOf(Action::PLANNING))) +
             writer_.pick(gesture);
    case Action::CANCEL:
      if (rests && standsAt(config_.home())) return {};
      return wayOut(cancel) + writer_.withdraw(cancel);
    default:
      if (rests && standsAt(config_.home())) return {};
      return wayOut(cancel) + writer_.show(gesture);
  }
}

/// From wherever the arm is, with whatever hangs at its cup, to where anything may follow.
Script MotionAgent::wayOut(const Gesture& cancel) const {
  return suction_ ? writer_.putBack(cancel, entanglement_) : writer_.free(entanglement_);
}

/// The current action's gesture if it is one of this action, else the chosen one.
const Gesture& MotionAgent::gestureOf(Action action) const {
  if (!gesture_.empty() && state_.current == action) return config_.gesture(action, gesture_);
  return config_.gesture(action);
}

/// Goes through the script until a move is outstanding or nothing is left to do.
void MotionAgent::advance() {
  while (!stopped_ && !held_ && !outstanding_) {
    if (script_.empty()) {
      if (requests_.empty()) return;
      finish();
      continue;
    }
    const Step step = script_.front();
    state_.phase = step.phase;
    if (step.kind == StepKind::MOVE) {
      if (separation_ == Separation::STOP) return;
      return send(step);
    }
    script_.pop_front();
    perform(step);
  }
}

void MotionAgent::send(const Step& step) {
  const double speed = speedOf(step);
  outstanding_ = Outstanding{++last_number_, script_number_, step, speed, false};
  location_.reset();
  const bool at_pick =
      step.low && step.target.x == config_.pick().x && step.target.y == config_.pick().y;
  entanglement_ = {step.low, step.far, at_pick};
  commands_.push_back({MotionCommand::Kind::MOVE, last_number_, step.target, speed, step.settle});
}

void MotionAgent::reached(const Outstanding& move) {
  location_ = move.step.target;
  if (entanglement_.low && standsAt(*entanglement_.low)) {
    entanglement_.low.reset();
    entanglement_.at_pick = false;
  }
  if (standsAt(config_.side())) entanglement_.far = false;
  if (move.script != script_number_) return;
  if (move.step.planned) state_.planned = cube_at_pick_point_;
  script_.pop_front();
}

void MotionAgent::perform(const Step& step) {
  switch (step.kind) {
    case StepKind::MOVE:
      return;
    case StepKind::CHECK_CUBE:
      return checkCube();
    case StepKind::SUCTION_ON:
      suction_ = true;
      grip_ = pick_;
      seen_at_cup_ = false;
      views_without_ = 0;
      return command(MotionCommand::Kind::SUCTION_ON, 0);
    case StepKind::CHECK_GRIP:
      return checkGrip();
    case StepKind::CHECK_LIFT:
      return checkLift();
    case StepKind::SUCTION_OFF:
      return release();
  }
}

void MotionAgent::checkCube() {
  if (!cube_at_pick_point_) {
    abandon(ActionOutcome::NOTHING_TO_GRASP, "no cube stands at the pick point");
  } else if (!trayFor(pick_)) {
    abandon(ActionOutcome::REFUSED, "no rule names a tray for cube " + std::to_string(pick_.id) +
                                        " of colour " + std::to_string(pick_.colour));
  }
}

/// Before the lift the cube still stands in the sensor's beam, or is seen at the cup.
void MotionAgent::checkGrip() {
  state_.holding = cube_at_pick_point_ || cube_at_robot_;
  if (state_.holding) return;
  release();
  abandon(ActionOutcome::NOTHING_TO_GRASP, "the cube was taken away before the suction held it");
}

/// After the lift a cube in the beam is one that stayed behind, unless one is seen at the cup.
void MotionAgent::checkLift() {
  placing_ = trayFor(grip_);
  if (placing_ && (!cube_at_pick_point_ || cube_at_robot_)) {
    const ToolPose slot = config_.slot(*placing_, placed_[*placing_]);
    return setScript(writer_.place(gestureOf(Action::GRASP), slot));
  }
  placing_.reset();
  release();
  abandon(ActionOutcome::NOTHING_TO_GRASP, "the cube did not come along");
}

void MotionAgent::release() {
  suction_ = false;
  state_.holding = false;
  state_.planned = false;
  command(MotionCommand::Kind::SUCTION_OFF, 0);
  if (!placing_) return;
  ++placed_[*placing_];
  placing_.reset();
  withdrawing_ = true;
}

/// A camera may miss a cube for a moment, so it is missed some times in a row before it is lost;
/// one that was never seen at the cup cannot be missed there.
void MotionAgent::watchCup() {
  if (cube_at_robot_) {
    seen_at_cup_ = true;
    views_without_ = 0;
  } else if (seen_at_cup_ && ++views_without_ >= config_.lost_after) {
    loseCube();
  }
}

/// A grasp ends with it; what else has a cube to put back has none any more. While stopped the
/// suction stays as it is, in case the camera is wrong.
void MotionAgent::loseCube() {
  state_.lost = true;
  state_.holding = false;
  if (stopped_) return;
  placing_.reset();
  release();
  if (running() == Action::GRASP) {
    return abandon(ActionOutcome::CUBE_LOST, "the cube at the cup was lost on the way");
  }
  if (requests_.empty()) return;
  cancelMove();
  setScript(write(*state_.current));
}

double MotionAgent::speedOf(const Step& step) const {
  return separation_ == Separation::SLOW ? slow_factor_ * step.speed : step.speed;
}

bool MotionAgent::atGoal() const {
  if (!outstanding_ || !tool_) return false;
  const ToolPose& goal = outstanding_->step.target;
  return std::hypot(tool_->x - goal.x, tool_->y - goal.y, tool_->z - goal.z) < AT_GOAL;
}

bool MotionAgent::standsAt(const ToolPose& pose) const { return location_ && *location_ == pose; }

std::optional<std::string> MotionAgent::trayFor(const SeenCube& cube) const {
  if (task_.scenario == "inspection") return config_.inspection_tray;
  const std::optional<std::string> label = labelFor(cube);
  return label && config_.trays.count(*label) > 0 ? label : std::nullopt;
}

/// A cube goes where its own rule says. One that is seen in another colour than that of its rule
/// goes where this colour belongs: the robot cannot know better.
std::optional<std::string> MotionAgent::labelFor(const SeenCube& cube) const {
  if (cube.id >= 1 && cube.id <= task_.cube_rules.size()) {
    const std::size_t index = task_.cube_rules[cube.id - 1];
    if (index < task_.rules.size()) {
      const auto& [ruled, label] = task_.rules[index];
      if (ruled == SeenCube::COLOUR_UNKNOWN || ruled == cube.colour) return label;
    }
  }
  if (cube.colour == SeenCube::COLOUR_UNKNOWN) return std::nullopt;
  for (const auto& [ruled, label] : task_.rules) {
    if (ruled == cube.colour) return label;
  }
  return std::nullopt;
}

}  // namespace fabric::planner
