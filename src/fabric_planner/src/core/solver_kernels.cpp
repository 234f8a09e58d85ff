// SPDX-License-Identifier: BSD-3-Clause
#include "solver_kernels.hpp"

#include <algorithm>

namespace fabric::planner {
namespace {

// Written with vectors because compilers otherwise take the short loop over the terms for the one
// that pays, and gather.
using Lane = double __attribute__((vector_size(LANES * sizeof(double))));
using LaneAt = double __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));

[[gnu::always_inline]] inline const LaneAt& at(const double* numbers) {
  return *reinterpret_cast<const LaneAt*>(numbers);
}

[[gnu::always_inline]] inline LaneAt& at(double* numbers) {
  return *reinterpret_cast<LaneAt*>(numbers);
}

/// COUNT accumulators that stay in registers.
template <int COUNT>
[[gnu::always_inline]] inline void combineLanes(const double* table, std::ptrdiff_t stride,
                                                const int* index, const double* value, int terms,
                                                const double* start, double* out) {
  Lane sum[COUNT];
#pragma GCC unroll 8
  for (int j = 0; j < COUNT; ++j) sum[j] = start == nullptr ? Lane{} : at(start + LANES * j);
  for (int i = 0; i < terms; ++i) {
    const double* row = table + index[i] * stride;
    const double factor = value[i];
#pragma GCC unroll 8
    for (int j = 0; j < COUNT; ++j) sum[j] += factor * at(row + LANES * j);
  }
#pragma GCC unroll 8
  for (int j = 0; j < COUNT; ++j) at(out + LANES * j) = sum[j];
}

constexpr int WIDE = 4 * BLOCK;

}  // namespace

FABRIC_CLONES
void combineRows(const double* table, std::ptrdiff_t stride, const int* index, const double* value,
                 int terms, const double* start, int count, double* out) {
  int k = 0;
  for (; k + WIDE <= count; k += WIDE) {
    combineLanes<WIDE / LANES>(table + k, stride, index, value, terms,
                               start == nullptr ? nullptr : start + k, out + k);
  }
  for (; k < count; k += BLOCK) {
    combineLanes<BLOCK / LANES>(table + k, stride, index, value, terms,
                                start == nullptr ? nullptr : start + k, out + k);
  }
}

FABRIC_CLONES
void smallestProducts(const double* table, std::ptrdiff_t stride, const int* index,
                      const double* value, int terms, int count, double* out) {
  for (int k = 0; k < count; k += LANES) {
    Lane least = value[0] * at(table + index[0] * stride + k);
    for (int i = 1; i < terms; ++i) {
      const Lane product = value[i] * at(table + index[i] * stride + k);
      least = product < least ? product : least;
    }
    at(out + k) = least;
  }
}

FABRIC_CLONES
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

FABRIC_CLONES
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

FABRIC_CLONES
void combineConsecutive(const double* table, std::ptrdiff_t stride, const double* value, int terms,
                        int count, double* out) {
  for (int k = 0; k < count; k += LANES) {
    Lane sum{};
    for (int i = 0; i < terms; ++i) sum += value[i] * at(table + i * stride + k);
    at(out + k) = sum;
  }
}

FABRIC_CLONES
void sumOfProducts(const double* table, std::ptrdiff_t stride, const double* const* rows, int terms,
                   int count, double* out) {
  for (int k = 0; k < count; k += LANES) {
    Lane sum{};
    for (int i = 0; i < terms; ++i) sum += at(table + i * stride + k) * at(rows[i] + k);
    at(out + k) = sum;
  }
}

FABRIC_CLONES
void pivotRows(double* table, std::ptrdiff_t stride, const double* column, int rows, int row,
               int count) {
  double* own = table + row * stride;
  const double inverse = 1.0 / column[row];
  for (int k = 0; k < count; k += LANES) at(own + k) = inverse * at(own + k);
  for (int r = 0; r < rows; ++r) {
    if (r == row) continue;
    double* other = table + r * stride;
    for (int k = 0; k < count; k += LANES) at(other + k) -= column[r] * at(own + k);
  }
}

FABRIC_CLONES
void rowDots(const double* table, std::ptrdiff_t stride, const double* x, int rows, int count,
             double* out) {
  for (int r = 0; r < rows; ++r) {
    Lane sum{};
    for (int k = 0; k < count; k += LANES) sum += at(table + r * stride + k) * at(x + k);
    out[r] = ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
  }
}

FABRIC_CLONES
void blockMinima(const double* numbers, int count, double* minima) {
  for (int block = 0; block * BLOCK < count; ++block) {
    const Lane left = at(numbers + block * BLOCK);
    const Lane right = at(numbers + block * BLOCK + LANES);
    const Lane least = left < right ? left : right;
    double smallest = least[0];
    for (int j = 1; j < LANES; ++j) smallest = least[j] < smallest ? least[j] : smallest;
    minima[block] = smallest;
  }
}

}  // namespace fabric::planner
