// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>

namespace fabric::planner {

/// A deadline on the steady clock that leaves room for the longest stretch of work seen so far.
class Stopwatch {
 public:
  explicit Stopwatch(double deadline) : deadline_(deadline), begin_(Clock::now()) {}

  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double>(Clock::now() - begin_).count();
  }
  /// True when another stretch as long as the longest might not end in time.
  bool timeIsUp() {
    const double now = elapsed();
    longest_ = std::max(longest_, now - last_check_);
    last_check_ = now;
    return now + std::min(longest_, 0.1 * deadline_) >= deadline_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  double deadline_;
  Clock::time_point begin_;
  double last_check_ = 0.0;
  double longest_ = 0.0;
};

}  // namespace fabric::planner
