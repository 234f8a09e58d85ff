// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace fabric::planner {

/// Tells an anytime search when to stop, reading the clock seldom: work is counted in between.
///
/// The search says what it spends in units of its own (one simulated step, say). The rate of the
/// last stretch of work tells how much fits before the next look at the clock, which is due after
/// 20 us, sooner when the deadline is near.
class SearchClock {
 public:
  /// @param deadline s from now. @param cpu_time count the CPU time of this thread instead of
  /// steady time: for measurements on a shared machine.
  SearchClock(double deadline, bool cpu_time);

  /// False when time is up; then the work should be left undone.
  bool spend(int work) {
    left_ -= work;
    return left_ > 0 || look();
  }
  [[nodiscard]] bool expired() const { return expired_; }
  /// s since the start; reads the clock.
  [[nodiscard]] double elapsed() const { return now() - start_; }
  [[nodiscard]] double deadline() const { return deadline_; }

 private:
  [[nodiscard]] double now() const;
  bool look();

  bool cpu_time_;
  bool expired_ = false;
  double deadline_;
  double start_;
  double last_;
  std::int64_t given_ = 16;  // work granted at the last look
  std::int64_t left_ = 16;   // of it
};

}  // namespace fabric::planner
