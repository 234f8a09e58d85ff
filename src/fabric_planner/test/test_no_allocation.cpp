// SPDX-License-Identifier: BSD-3-Clause
// Counts what is taken from the heap: a program of its own, since it puts its own allocation
// functions in the place of the library's.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/online_planner.hpp"
#include "sample_models.hpp"

namespace {

std::atomic<long> taken{0};

}  // namespace

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Eigen calls malloc itself.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) {
  ++taken;
  return __libc_malloc(size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++taken;
  return __libc_memalign(alignment, size);
}
}
#else
// Not inlined, lest g++ takes new and free for a mismatch.
__attribute__((noinline)) void* operator new(std::size_t size) {
  ++taken;
  void* memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
__attribute__((noinline)) void operator delete(void* memory) noexcept { std::free(memory); }
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif

namespace fabric::planner {
namespace {

constexpr double AMPLE = 1e6;  // s: a deadline that never ends a search

/// Allocations of a run of decisions, updates and advances after one that warms everything up.
long takenByARun(OnlinePlanner& planner, BeliefFilter& filter) {
  long before = 0;
  for (int t = 0; t < 60; ++t) {
    if (t == 1) before = taken;
    const int action = planner.decide(filter.belief()).action;
    const int observation = t % planner.model().numObservations();
    filter.update(action, observation);
    planner.advance(action, observation);
  }
  return taken - before;
}

TEST(NoAllocation, CountsAtAll) {
  const long before = taken;
  ::operator delete(::operator new(3));
  EXPECT_GT(taken, before);
}

TEST(NoAllocation, AWarmDecisionAndUpdateTakeNothingFromTheHeap) {
  std::mt19937 random(51);
  for (const int states : {8, 80}) {
    const auto m = testing::randomPomdp(random, states, 3, 4, 0.95);
    const AlphaVectors lower = blindBound(*m);
    for (const int nodes : {0, 1, 50}) {
      OnlinePlanner planner(m, {AMPLE, 1e-3, nodes}, lower, PointUpperBound(qmdp(*m)));
      BeliefFilter filter(m);
      EXPECT_EQ(takenByARun(planner, filter), 0) << states << " states, " << nodes << " nodes";
    }
  }
}

TEST(NoAllocation, NorWithTheOfflineBoundsOfTheDefaults) {
  std::mt19937 random(52);
  const auto m = testing::randomPomdp(random, 6, 3, 4, 0.95);
  OnlinePlanner planner(m, {AMPLE, 1e-3, 50});
  BeliefFilter filter(m);
  EXPECT_EQ(takenByARun(planner, filter), 0);
}

}  // namespace
}  // namespace fabric::planner
