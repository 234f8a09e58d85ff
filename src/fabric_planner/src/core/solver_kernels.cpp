// SPDX-License-Identifier: BSD-3-Clause
#include "solver_kernels.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace fabric::planner {
namespace {

constexpr int WIDE = 2 * BLOCK;

/// A block of accumulators that the compiler keeps in registers.
template <int WIDTH>
[[gnu::always_inline]] inline void combineBlock(const double* table, std::ptrdiff_t stride,
                                                const int* index, const double* value, int terms,
                                                const double* start, double* out) {
  double sum[WIDTH];
  for (int k = 0; k < WIDTH; ++k) sum[k] = start == nullptr ? 0.0 : start[k];
  for (int i = 0; i < terms; ++i) {
    const double* row = table + index[i] * stride;
    const double factor = value[i];
    for (int k = 0; k < WIDTH; ++k) sum[k] += factor * row[k];
  }
  std::memcpy(out, sum, sizeof(sum));
}

[[gnu::always_inline]] inline void smallestBlock(const double* table, std::ptrdiff_t stride,
                                                 const int* index, const double* value, int terms,
                                                 double* out) {
  double least[BLOCK];
  for (double& number : least) number = std::numeric_limits<double>::max();
  for (int i = 0; i < terms; ++i) {
    const double* row = table + index[i] * stride;
    const double factor = value[i];
    for (int k = 0; k < BLOCK; ++k) {
      const double product = factor * row[k];
      least[k] = product < least[k] ? product : least[k];
    }
  }
  std::memcpy(out, least, sizeof(least));
}

}  // namespace

FABRIC_SOLVER_CLONES
void combineRows(const double* table, std::ptrdiff_t stride, const int* index, const double* value,
                 int terms, const double* start, int count, double* out) {
  int k = 0;
  for (; k + WIDE <= count; k += WIDE) {
    combineBlock<WIDE>(table + k, stride, index, value, terms,
                       start == nullptr ? nullptr : start + k, out + k);
  }
  for (; k < count; k += BLOCK) {
    combineBlock<BLOCK>(table + k, stride, index, value, terms,
                        start == nullptr ? nullptr : start + k, out + k);
  }
}

FABRIC_SOLVER_CLONES
void smallestProducts(const double* table, std::ptrdiff_t stride, const int* index,
                      const double* value, int terms, int count, double* out) {
  for (int k = 0; k < count; k += BLOCK) {
    smallestBlock(table + k, stride, index, value, terms, out + k);
  }
}

FABRIC_SOLVER_CLONES
int positionOfLargest(const double* numbers, int count) {
  double lanes[BLOCK];
  for (double& lane : lanes) lane = numbers[0];
  int k = 0;
  for (; k + BLOCK <= count; k += BLOCK) {
    for (int i = 0; i < BLOCK; ++i)
      lanes[i] = numbers[k + i] > lanes[i] ? numbers[k + i] : lanes[i];
  }
  double best = *std::max_element(lanes, lanes + BLOCK);
  for (; k < count; ++k) best = std::max(best, numbers[k]);
  return static_cast<int>(std::find(numbers, numbers + count - 1, best) - numbers);
}

FABRIC_SOLVER_CLONES
int positionOfSmallest(const double* numbers, int count) {
  double lanes[BLOCK];
  for (double& lane : lanes) lane = numbers[0];
  int k = 0;
  for (; k + BLOCK <= count; k += BLOCK) {
    for (int i = 0; i < BLOCK; ++i)
      lanes[i] = numbers[k + i] < lanes[i] ? numbers[k + i] : lanes[i];
  }
  double best = *std::min_element(lanes, lanes + BLOCK);
  for (; k < count; ++k) best = std::min(best, numbers[k]);
  return static_cast<int>(std::find(numbers, numbers + count - 1, best) - numbers);
}

FABRIC_SOLVER_CLONES
void combineConsecutive(const double* table, std::ptrdiff_t stride, const double* value, int terms,
                        int count, double* out) {
  for (int first = 0; first < count; first += BLOCK) {
    double sum[BLOCK] = {};
    for (int i = 0; i < terms; ++i) {
      const double* row = table + i * stride + first;
      for (int k = 0; k < BLOCK; ++k) sum[k] += value[i] * row[k];
    }
    std::memcpy(out + first, sum, sizeof(sum));
  }
}

FABRIC_SOLVER_CLONES
void sumOfProducts(const double* table, std::ptrdiff_t stride, const double* const* rows, int terms,
                   int count, double* out) {
  for (int first = 0; first < count; first += BLOCK) {
    double sum[BLOCK] = {};
    for (int i = 0; i < terms; ++i) {
      const double* left = table + i * stride + first;
      const double* right = rows[i] + first;
      for (int k = 0; k < BLOCK; ++k) sum[k] += left[k] * right[k];
    }
    std::memcpy(out + first, sum, sizeof(sum));
  }
}

}  // namespace fabric::planner
