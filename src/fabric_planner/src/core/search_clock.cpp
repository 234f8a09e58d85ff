// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/search_clock.hpp"

#include <time.h>

#include <algorithm>

namespace fabric::planner {
namespace {

constexpr double INTERVAL = 20e-6;  // s between two looks at the clock
constexpr double RESERVE = 10e-6;   // s kept for choosing the answer
constexpr std::int64_t GROWTH = 8;  // at most, of the work granted; rates vary along a search

}  // namespace

SearchClock::SearchClock(double deadline, bool cpu_time)
    : cpu_time_(cpu_time), deadline_(deadline), start_(0.0) {
  start_ = now();
  last_ = start_;
}

double SearchClock::now() const {
  timespec time{};
  clock_gettime(cpu_time_ ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool SearchClock::look() {
  if (expired_) return false;
  const double time = now();
  const double remaining = deadline_ - RESERVE - (time - start_);
  if (remaining <= 0.0) {
    expired_ = true;
    return false;
  }
  const double per_unit =
      std::max(time - last_, 1e-9) / static_cast<double>(std::max<std::int64_t>(given_ - left_, 1));
  const double fits = std::min(INTERVAL, 0.5 * remaining) / per_unit;
  given_ = std::max<std::int64_t>(1, std::min(static_cast<std::int64_t>(fits), GROWTH * given_));
  left_ = given_;
  last_ = time;
  return true;
}

}  // namespace fabric::planner
