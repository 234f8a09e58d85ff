// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fabric::planner {

/// What one observation says (thesis Fig. 6.6 and what the robot knows beside it), field by field
/// as in fabric_msgs/Observation.
struct Features {
  bool task_success = false;     ///< O1
  bool task_failure = false;     ///< O2
  bool detected = false;         ///< O3
  bool looking_around = false;   ///< O4
  bool grasp_attempt = false;    ///< O5
  bool warning = false;          ///< O6
  bool idle = false;             ///< O7
  bool subtask_success = false;  ///< O8
  bool subtask_failure = false;  ///< O9
  bool robot_success = false;
  bool robot_failure = false;
  double subtask_elapsed = 0.0;  ///< s
  double waiting_time = 0.0;     ///< s
  double failed_attempts = 0.0;  ///< count
};

}  // namespace fabric::planner
