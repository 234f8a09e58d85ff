// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric_planner/actions.hpp"
#include "fabric_planner/motion_config.hpp"
#include "fabric_planner/motion_script.hpp"

namespace fabric::planner {

/// One command for the arm. Poses are of the tool in arm_base_link: m, rad.
struct MotionCommand {
  enum class Kind { MOVE, CANCEL, SUCTION_ON, SUCTION_OFF };
  Kind kind = Kind::MOVE;
  std::uint32_t number = 0;  ///< of the move; from 1, without gaps
  ToolPose pose;             ///< MOVE
  double speed = 0.0;        ///< m/s, MOVE
  double settle = 0.0;       ///< s to stand at the goal, MOVE
};
using MotionCommands = std::vector<MotionCommand>;

/// How a move ended, numbered as in fabric_msgs/MoveArm.
enum class ArmOutcome { REACHED = 0, PRE_EMPTED = 1, UNREACHABLE = 2, INVALID = 3, ARM_FAULT = 4 };

/// How an action ended, numbered as in fabric_msgs/ExecuteRobotAction.
enum class ActionOutcome {
  DONE = 0,
  PRE_EMPTED = 1,
  REFUSED = 2,
  NOTHING_TO_GRASP = 3,
  ARM_FAILED = 4,
  STOPPED = 5,
  CUBE_LOST = 6,
};

/// The end of one request for an action.
struct ActionEnd {
  std::uint64_t ticket = 0;  ///< as ticket() said after the request
  Action action = Action::IDLE;
  ActionOutcome outcome = ActionOutcome::DONE;
  std::string reason;
};

/// How close the person's hand is to the arm, numbered as in fabric_msgs/SafetyState.
enum class Separation { RUN = 0, SLOW = 1, STOP = 2 };

/// A cube as perceived; numbers as in fabric_msgs/Cube.
struct SeenCube {
  static constexpr int COLOUR_UNKNOWN = 0;
  static constexpr int WHERE_PICK_POINT = 1;
  static constexpr int WHERE_ROBOT = 3;
  int colour = COLOUR_UNKNOWN;
  int where = 0;
  double confidence = 0.0;
  std::uint32_t id = 0;  ///< from 1 within a task
};

/// What motion needs to know of the task; numbers as in fabric_msgs/TaskState.
struct TaskView {
  static constexpr int SUCCEEDED = 3;
  std::uint32_t task_id = 0;
  int status = 0;
  std::string scenario;
  std::vector<std::pair<int, std::string>> rules;  ///< colour or unknown, label of the container
  std::vector<std::uint8_t> cube_rules = {};       ///< index into rules by cube, from id 1

  [[nodiscard]] bool over() const { return status >= SUCCEEDED; }
};

/// The fields of fabric_msgs/RobotActionState.
struct RobotState {
  std::uint32_t sequence = 0;
  std::optional<Action> current;
  std::optional<Action> queued;
  std::optional<Action> pre_empted;
  Phase phase = Phase::REST;
  bool holding = false;
  bool lost = false;
  bool planned = false;
  std::uint32_t decision_sequence = 0;
};

/// Turns decisions into arm moves: arbitrates as in Table 6.5 and runs one script at a time.
///
/// Event-driven and without a clock: every input returns the commands it causes, in order. At most
/// one move is outstanding (sent, and neither reached nor given up by the arm); a script goes on
/// when its move's result is in. After a warning nothing moves until the next decision; after a
/// stop nothing moves until the release and a decision after it; while the person's hand is too
/// close nothing moves, and the script goes on by itself when it has gone.
class MotionAgent {
 public:
  explicit MotionAgent(MotionConfig config);

  /// @param sequence number of the decision, 0 when none stands behind the request
  /// @param task_id  task it was made for; 0 is never stale
  MotionCommands onDecision(Action action, std::uint32_t sequence, std::uint32_t task_id = 0);
  /// Plays a gesture, arbitrated as the action it stands for. @throw ModelError for another name
  MotionCommands onGesture(const std::string& name, std::uint32_t sequence = 0);
  /// Numbers that are not outstanding are ignored.
  MotionCommands onArmResult(std::uint32_t number, ArmOutcome outcome,
                             const std::string& reason = "");
  /// The suction did not obey.
  MotionCommands onSuctionFailure(const std::string& reason);
  /// What the sensor at the pick point says.
  MotionCommands onConveyor(bool cube_at_pick_point);
  MotionCommands onCubes(const std::vector<SeenCube>& cubes);
  MotionCommands onTask(const TaskView& task);
  MotionCommands onWarning();
  /// Where the tool is; causes nothing by itself.
  void onTool(const ToolPose& tool) { tool_ = tool; }
  /// @param slow_factor of all speeds while SLOW, in (0, 1]
  MotionCommands onSeparation(Separation separation, double slow_factor);
  MotionCommands onStop(const std::string& cause);
  MotionCommands onRelease();

  [[nodiscard]] const RobotState& state() const { return state_; }
  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] bool heldByWarning() const { return held_; }
  [[nodiscard]] Separation separation() const { return separation_; }
  [[nodiscard]] const std::string& cause() const { return cause_; }
  /// Number of the outstanding move.
  [[nodiscard]] std::optional<std::uint32_t> outstanding() const;
  /// Of the newest call of onDecision or onGesture.
  [[nodiscard]] std::uint64_t ticket() const { return ticket_; }
  /// The ends of actions since the last call.
  std::vector<ActionEnd> takeEnds();

 private:
  struct Outstanding {
    std::uint32_t number;
    std::uint64_t script;
    Step step;
    double speed;
    bool cancelled;
  };
  struct Request {
    Action action;
    std::uint64_t ticket;
    std::string gesture;  ///< wanted by its name; empty when any of the action will do
  };

  template <class Event>
  MotionCommands handle(Event event);
  void decide(const Request& request);
  void begin(const Request& request);
  void advance();
  void send(const Step& step);
  void perform(const Step& step);
  void checkCube();
  void checkGrip();
  void checkLift();
  void release();
  void watchCup();
  void loseCube();
  void reached(const Outstanding& move);
  void abandon(ActionOutcome outcome, const std::string& reason);
  void fail(const std::string& reason);
  void halt(ActionOutcome outcome, const std::string& reason);
  void finish();
  void endCurrent(ActionOutcome outcome, const std::string& reason);
  void end(const Request& request, ActionOutcome outcome, const std::string& reason);
  void dropQueued(ActionOutcome outcome, const std::string& reason);
  void goHome(const std::string& reason);
  void startTask();
  void cancelMove();
  void command(MotionCommand::Kind kind, std::uint32_t number);
  void setScript(Script script);
  [[nodiscard]] Script write(Action action) const;
  [[nodiscard]] Script wayOut(const Gesture& cancel) const;
  [[nodiscard]] bool shows(const Request& request) const;
  [[nodiscard]] const Gesture& gestureOf(Action action) const;
  [[nodiscard]] double speedOf(const Step& step) const;
  [[nodiscard]] bool atGoal() const;
  [[nodiscard]] std::optional<Action> running() const;
  [[nodiscard]] bool approaching() const;
  [[nodiscard]] bool standsAt(const ToolPose& pose) const;
  [[nodiscard]] std::optional<std::string> trayFor(const SeenCube& cube) const;
  [[nodiscard]] std::optional<std::string> labelFor(const SeenCube& cube) const;

  MotionConfig config_;
  ScriptWriter writer_;
  RobotState state_;
  MotionCommands commands_;
  std::vector<ActionEnd> ends_;

  Script script_;
  std::uint64_t script_number_ = 0;
  std::vector<Request> requests_;  ///< for the current action; empty when none is at work
  std::string gesture_;            ///< the current action's by name; empty: the chosen one
  std::optional<Request> queued_;
  std::pair<ActionOutcome, std::string> result_;  ///< of the current action, when its script ends
  bool withdrawing_ = false;                      ///< the current action only drives home yet
  std::optional<std::string> placing_;            ///< label of the tray the cube is on the way to

  std::optional<Outstanding> outstanding_;
  std::uint32_t last_number_ = 0;
  std::uint64_t ticket_ = 0;
  std::optional<ToolPose> location_;  ///< the goal the arm stands at
  std::optional<ToolPose> tool_;      ///< as the arm last said
  Entanglement entanglement_;
  bool suction_ = false;
  bool seen_at_cup_ = false;  ///< the cube that the suction took
  int views_without_ = 0;     ///< of the cell, in a row, since it was seen there

  TaskView task_;
  std::map<std::string, unsigned> placed_;  ///< cubes by tray in this task
  bool cube_at_pick_point_ = false;
  bool cube_at_robot_ = false;
  SeenCube pick_;  ///< at the pick point; without colour and id when nothing was seen there
  SeenCube grip_;  ///< that the suction took

  bool held_ = false;
  bool stopped_ = false;
  Separation separation_ = Separation::RUN;
  double slow_factor_ = 1.0;
  std::string cause_;
};

}  // namespace fabric::planner
