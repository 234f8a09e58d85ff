// SPDX-License-Identifier: BSD-3-Clause
#include "kernels.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "simd.hpp"

namespace fabric::planner::kernels {
namespace {

constexpr double LOWEST = -std::numeric_limits<double>::infinity();

const Lanes& at(const double* p) { return *reinterpret_cast<const Lanes*>(p); }
Lanes& at(double* p) { return *reinterpret_cast<Lanes*>(p); }

double largest(const double* lanes) {
  double best = lanes[0];
  for (int i = 1; i < LANES; ++i) best = std::max(best, lanes[i]);
  return best;
}

}  // namespace

FABRIC_CLONES
void rowTimesTable(const double* x, const double* table, int rows, int width, double* out) {
  int j = 0;
  for (; j + 2 * LANES <= width; j += 2 * LANES) {
    Lanes first = {};
    Lanes second = {};
    const double* row = table + j;
    for (int i = 0; i < rows; ++i, row += width) {
      first += x[i] * at(row);
      second += x[i] * at(row + LANES);
    }
    at(out + j) = first;
    at(out + j + LANES) = second;
  }
  for (; j < width; j += LANES) {
    Lanes sum = {};
    const double* row = table + j;
    for (int i = 0; i < rows; ++i, row += width) sum += x[i] * at(row);
    at(out + j) = sum;
  }
}

FABRIC_CLONES
double multiply(const double* x, const double* y, int width, double* out) {
  Lanes sum = {};
  for (int j = 0; j < width; j += LANES) {
    const Lanes product = at(x + j) * at(y + j);
    at(out + j) = product;
    sum += product;
  }
  return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

FABRIC_CLONES
void jointColumns(const JointColumns& columns, const double* predicted, const double* emissions,
                  const int* components, int rows, int width, double* points) {
  const int last = columns.first + columns.count;
  const std::ptrdiff_t table = static_cast<std::ptrdiff_t>(columns.states) * columns.symbol_width;
  for (int r = 0; r < rows; ++r, points += width) {
    int action = columns.first / columns.symbols;
    int symbol = columns.first % columns.symbols;
    const int s = components[r];
    for (int c = columns.first; c < last; ++action, symbol = 0) {
      const int count = std::min(columns.symbols - symbol, last - c);
      const double weight = predicted[action * columns.state_width + s];
      const double* row = emissions + action * table +
                          static_cast<std::ptrdiff_t>(s) * columns.symbol_width + symbol;
      double* out = points + (c - columns.first);
      // What is written too much belongs to later columns, which are written later.
      for (int j = 0; j < count; j += LANES) at(out + j) = weight * at(row + j);
      c += count;
    }
  }
}

FABRIC_CLONES
void columnSums(const double* points, int rows, int width, double* sums) {
  for (int j = 0; j < width; j += LANES) {
    Lanes sum = {};
    const double* row = points + j;
    for (int r = 0; r < rows; ++r, row += width) sum += at(row);
    at(sums + j) = sum;
  }
}

FABRIC_CLONES
void largestOf(const double* functions, int count, int stride, const double* points,
               const int* components, int rows, int width, double* best) {
  for (int j = 0; j < width; j += LANES) {
    Lanes found = LOWEST - Lanes{};
    for (int k = 0; k < count; k += 4) {
      const double* f0 = functions + static_cast<std::ptrdiff_t>(k) * stride;
      const double* f1 = f0 + stride;
      const double* f2 = f1 + stride;
      const double* f3 = f2 + stride;
      Lanes v0 = {};
      Lanes v1 = {};
      Lanes v2 = {};
      Lanes v3 = {};
      const double* row = points + j;
      for (int r = 0; r < rows; ++r, row += width) {
        const Lanes point = at(row);
        const int i = components[r];
        v0 += f0[i] * point;
        v1 += f1[i] * point;
        v2 += f2[i] * point;
        v3 += f3[i] * point;
      }
      v0 = v0 > v1 ? v0 : v1;
      v2 = v2 > v3 ? v2 : v3;
      v0 = v0 > v2 ? v0 : v2;
      found = found > v0 ? found : v0;
    }
    at(best + j) = found;
  }
}

FABRIC_CLONES
double largestAt(const double* functions, int count, const int* indices, const double* values,
                 int entries) {
  Lanes found = LOWEST - Lanes{};
  int k = 0;
  for (; k + 4 * LANES <= count; k += 4 * LANES) {
    Lanes v0 = {};
    Lanes v1 = {};
    Lanes v2 = {};
    Lanes v3 = {};
    for (int i = 0; i < entries; ++i) {
      const double* f = functions + static_cast<std::ptrdiff_t>(indices[i]) * count + k;
      v0 += values[i] * at(f);
      v1 += values[i] * at(f + LANES);
      v2 += values[i] * at(f + 2 * LANES);
      v3 += values[i] * at(f + 3 * LANES);
    }
    v0 = v0 > v1 ? v0 : v1;
    v2 = v2 > v3 ? v2 : v3;
    v0 = v0 > v2 ? v0 : v2;
    found = found > v0 ? found : v0;
  }
  for (; k < count; k += LANES) {
    Lanes sum = {};
    for (int i = 0; i < entries; ++i) {
      sum += values[i] * at(functions + static_cast<std::ptrdiff_t>(indices[i]) * count + k);
    }
    found = found > sum ? found : sum;
  }
  return largest(reinterpret_cast<const double*>(&found));
}

}  // namespace fabric::planner::kernels
