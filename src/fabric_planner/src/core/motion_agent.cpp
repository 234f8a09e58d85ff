// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/motion_agent.hpp"

#include <algorithm>
#include <tuple>

#include "fabric_planner/arbiter.hpp"

namespace fabric::planner {
namespace {

auto fields(const RobotState& state) {
  return std::tie(state.current, state.queued, state.pre_empted, state.phase, state.holding,
                  state.lost, state.planned, state.decision_sequence);
}

}  // namespace

MotionAgent::MotionAgent(MotionConfig config) : config_(std::move(config)), writer_(config_) {}

/// Runs one input: the event, whatever can follow from it, and the count of changes.
template <class Event>
MotionCommands MotionAgent::handle(Event event) {
  const RobotState before = state_;
  commands_.clear();
  event();
  advance();
  state_.queued = queued_ ? std::optional(queued_->action) : std::nullopt;
  if (fields(before) != fields(state_)) ++state_.sequence;
  return std::move(commands_);
}

MotionCommands MotionAgent::onDecision(Action action, std::uint32_t sequence,
                                       std::uint32_t task_id) {
  return handle([&] {
    const Request request{action, ++ticket_, ""};
    if (task_id != 0 && task_.task_id != 0 && task_id != task_.task_id) {
      return end(request, ActionOutcome::REFUSED, "it was decided for another task");
    }
    state_.decision_sequence = sequence;
    decide(request);
  });
}

MotionCommands MotionAgent::onGesture(const std::string& name, std::uint32_t sequence) {
  const Action action = config_.gesture(Action::IDLE, name).action;
  return handle([&] {
    state_.decision_sequence = sequence;
    decide({action, ++ticket_, name});
  });
}

MotionCommands MotionAgent::onArmResult(std::uint32_t number, ArmOutcome outcome,
                                        const std::string& reason) {
  return handle([&] {
    if (!outstanding_ || outstanding_->number != number) return;
    const Outstanding move = *outstanding_;
    outstanding_.reset();
    if (outcome == ArmOutcome::REACHED) return reached(move);
    const bool asked_for = outcome == ArmOutcome::PRE_EMPTED && move.cancelled;
    if (!asked_for && move.script == script_number_) fail(reason);
  });
}

MotionCommands MotionAgent::onSuctionFailure(const std::string& reason) {
  return handle([&] { fail(reason); });
}

MotionCommands MotionAgent::onConveyor(bool cube_at_pick_point) {
  return handle([&] {
    cube_at_pick_point_ = cube_at_pick_point;
    if (cube_at_pick_point) return;
    pick_ = {};
    state_.planned = false;
    if (approaching()) abandon(ActionOutcome::NOTHING_TO_GRASP, "the cube was taken away");
  });
}

MotionCommands MotionAgent::onCubes(const std::vector<SeenCube>& cubes) {
  return handle([&] {
    cube_at_robot_ = std::any_of(cubes.begin(), cubes.end(), [](const SeenCube& cube) {
      return cube.where == SeenCube::WHERE_ROBOT;
    });
    double best = -1.0;
    for (const SeenCube& cube : cubes) {
      if (cube.where != SeenCube::WHERE_PICK_POINT || !(cube.confidence > best)) continue;
      best = cube.confidence;
      pick_ = cube;
    }
    if (state_.holding) watchCup();
  });
}

MotionCommands MotionAgent::onTask(const TaskView& task) {
  return handle([&] {
    const bool is_new = task.task_id != task_.task_id;
    const bool ends = task.over() && !task_.over();
    task_ = task;
    if (is_new) startTask();
    if (!ends) return;
    dropQueued(ActionOutcome::PRE_EMPTED, "the task is over");
    const bool gesturing = state_.current == Action::PLANNING || state_.current == Action::POINT;
    if (!stopped_ && (gesturing || approaching())) goHome("the task is over");
  });
}

MotionCommands MotionAgent::onWarning() {
  return handle([&] {
    held_ = true;
    cancelMove();
  });
}

/// A move that is too fast now is broken off; what remains of it follows in time.
MotionCommands MotionAgent::onSeparation(Separation separation, double slow_factor) {
  return handle([&] {
    separation_ = separation;
    slow_factor_ = slow_factor;
    if (!outstanding_ || atGoal() || separation == Separation::RUN) return;
    const bool too_fast = outstanding_->speed > speedOf(outstanding_->step);
    if (separation == Separation::STOP || too_fast) cancelMove();
  });
}

MotionCommands MotionAgent::onStop(const std::string& cause) {
  return handle([&] {
    stopped_ = true;
    held_ = false;
    cause_ = cause;
    halt(ActionOutcome::STOPPED, cause);
  });
}

MotionCommands MotionAgent::onRelease() {
  return handle([&] {
    stopped_ = false;
    cause_.clear();
  });
}

std::optional<std::uint32_t> MotionAgent::outstanding() const {
  return outstanding_ ? std::optional(outstanding_->number) : std::nullopt;
}

std::vector<ActionEnd> MotionAgent::takeEnds() { return std::exchange(ends_, {}); }

void MotionAgent::decide(const Request& request) {
  if (stopped_) return end(request, ActionOutcome::REFUSED, "stopped: " + cause_);
  held_ = false;
  const bool withdraws = request.action == Action::IDLE || request.action == Action::CANCEL;
  if (task_.over() && !withdraws) {
    return end(request, ActionOutcome::REFUSED, "the task is over");
  }
  Verdict verdict = arbitrate(running(), request.action);
  if (verdict == Verdict::CONTINUE && !shows(request)) verdict = Verdict::QUEUE;
  dropQueued(ActionOutcome::PRE_EMPTED, "a newer decision came");
  switch (verdict) {
    case Verdict::START:
      state_.pre_empted.reset();
      return begin(request);
    case Verdict::CONTINUE:
      return requests_.push_back(request);
    case Verdict::PRE_EMPT:
      state_.pre_empted = state_.current;
      endCurrent(ActionOutcome::PRE_EMPTED, "displaced by " + actionName(request.action));
      return begin(request);
    case Verdict::QUEUE:
      queued_ = request;
  }
}

void MotionAgent::begin(const Request& request) {
  cancelMove();
  requests_ = {request};
  gesture_ = request.gesture;
  result_ = {ActionOutcome::DONE, ""};
  withdrawing_ = false;
  placing_.reset();
  state_.lost = false;
  state_.current = request.action;
  setScript(write(request.action));
  if (request.action == Action::CANCEL) state_.planned = false;
  if (request.action == Action::GRASP && !suction_) checkCube();
}

/// Whether a request for the running action gets what it wants from it.
bool MotionAgent::shows(const Request& request) const {
  return request.gesture.empty() || request.gesture == gesture_ ||
         (gesture_.empty() && request.gesture == config_.chosen.at(request.action));
}

/// Ends the current action early: home, and this outcome.
void MotionAgent::abandon(ActionOutcome outcome, const std::string& reason) {
  cancelMove();
  result_ = {outcome, reason};
  withdrawing_ = true;
  setScript(write(Action::IDLE));
}

void MotionAgent::fail(const std::string& reason) { halt(ActionOutcome::ARM_FAILED, reason); }

/// Leaves everything as it stands; whatever comes next starts from there.
void MotionAgent::halt(ActionOutcome outcome, const std::string& reason) {
  dropQueued(outcome, reason);
  endCurrent(outcome, reason);
  cancelMove();
  placing_.reset();
  withdrawing_ = false;
  setScript({});
  state_.current.reset();
  state_.pre_empted.reset();
}

void MotionAgent::finish() {
  endCurrent(ActionOutcome::DONE, "");
  withdrawing_ = false;
  state_.phase = Phase::REST;
  if (state_.current != Action::PLANNING) state_.current = Action::IDLE;
  if (!queued_) return;
  const Request next = *queued_;
  queued_.reset();
  state_.pre_empted.reset();
  begin(next);
}

/// An action whose job is over keeps its own result, whatever ends its way home; requests for idle
/// that joined it there do not share it.
void MotionAgent::endCurrent(ActionOutcome outcome, const std::string& reason) {
  const bool decided =
      outcome == ActionOutcome::DONE || (outcome == ActionOutcome::PRE_EMPTED && withdrawing_);
  for (const Request& request : requests_) {
    if (decided && request.action == state_.current) {
      end(request, result_.first, result_.second);
    } else {
      end(request, outcome, reason);
    }
  }
  requests_.clear();
}

void MotionAgent::end(const Request& request, ActionOutcome outcome, const std::string& reason) {
  ends_.push_back({request.ticket, request.action, outcome, reason});
}

void MotionAgent::dropQueued(ActionOutcome outcome, const std::string& reason) {
  if (queued_) end(*queued_, outcome, reason);
  queued_.reset();
}

void MotionAgent::goHome(const std::string& reason) {
  endCurrent(ActionOutcome::PRE_EMPTED, reason);
  state_.pre_empted.reset();
  begin({Action::IDLE, ++ticket_, ""});
}

void MotionAgent::startTask() {
  dropQueued(ActionOutcome::PRE_EMPTED, "a new task begins");
  placed_.clear();
  state_.planned = false;
  cube_at_pick_point_ = false;
  cube_at_robot_ = false;
  pick_ = {};
  if (stopped_) return;
  held_ = false;
  goHome("a new task begins");
}

void MotionAgent::cancelMove() {
  if (!outstanding_ || outstanding_->cancelled) return;
  outstanding_->cancelled = true;
  command(MotionCommand::Kind::CANCEL, outstanding_->number);
}

void MotionAgent::command(MotionCommand::Kind kind, std::uint32_t number) {
  commands_.push_back({kind, number, {}, 0.0, 0.0});
}

void MotionAgent::setScript(Script script) {
  script_ = std::move(script);
  ++script_number_;
  state_.phase = script_.empty() ? Phase::REST : script_.front().phase;
}

/// For the arbiter: an action that only drives home yet is as good as idle.
std::optional<Action> MotionAgent::running() const {
  if (requests_.empty()) return std::nullopt;
  return withdrawing_ ? Action::IDLE : state_.current;
}

bool MotionAgent::approaching() const { return running() == Action::GRASP && !suction_; }

}  // namespace fabric::planner
