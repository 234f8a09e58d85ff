// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fabric::planner {

enum class EndedBy {
  GAP,      ///< the bounds met
  NODES,    ///< max_nodes beliefs were expanded
  DEADLINE  ///< time was up
};

struct Decision {
  int action = 0;
  double value = 0.0;          ///< of the action, at its lower bound
  double lower_bound = 0.0;    ///< of the optimal value at the belief
  double upper_bound = 0.0;    ///< of the optimal value at the belief
  int runner_up = -1;          ///< second best action, -1 when there is only one
  double runner_up_gap = 0.0;  ///< value lost by taking it, by lower bounds; >= 0
  int nodes = 0;               ///< expanded beliefs of the tree, those kept included
  double planning_time = 0.0;  ///< s
  bool deadline_missed = false;
  bool fallback_used = false;  ///< nothing was searched; the offline policy answered
  EndedBy ended_by = EndedBy::GAP;
  int kept_nodes = 0;  ///< expanded beliefs that were kept from the step before
  int trials = 0;      ///< paths followed from the root down (POMCP: simulations)
};

}  // namespace fabric::planner
