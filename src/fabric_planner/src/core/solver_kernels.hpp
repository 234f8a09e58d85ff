// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "simd.hpp"

namespace fabric::planner {

/// Numbers are handled in blocks of so many; tables are padded to a multiple of it.
constexpr int BLOCK = 16;
constexpr int inBlocks(int count) { return (count + BLOCK - 1) / BLOCK * BLOCK; }

/// out[k] = start[k] + sum_i value[i] * table[index[i] * stride + k] for k < count, a multiple of
/// BLOCK. start: may be null (zeros), may be out.
void combineRows(const double* table, std::ptrdiff_t stride, const int* index, const double* value,
                 int terms, const double* start, int count, double* out);

/// out[k] = min over i of value[i] * table[index[i] * stride + k]; terms > 0.
void smallestProducts(const double* table, std::ptrdiff_t stride, const int* index,
                      const double* value, int terms, int count, double* out);

/// Position of the largest (smallest) of count > 0 numbers, the first among equals.
int positionOfLargest(const double* numbers, int count);
int positionOfSmallest(const double* numbers, int count);

/// out[k] = sum_i value[i] * table[i * stride + k], k < count, a multiple of BLOCK.
void combineConsecutive(const double* table, std::ptrdiff_t stride, const double* value, int terms,
                        int count, double* out);

/// out[k] = sum_i table[i * stride + k] * rows[i][k], k < count, a multiple of BLOCK.
void sumOfProducts(const double* table, std::ptrdiff_t stride, const double* const* rows, int terms,
                   int count, double* out);

/// Divides a row of the table by its entry in `column` and takes column[r] times that from every
/// other row r: one step of Gauss and Jordan. count, a multiple of BLOCK: columns of the table.
void pivotRows(double* table, std::ptrdiff_t stride, const double* column, int rows, int row,
               int count);

/// out[r] = sum_k table[r * stride + k] * x[k], k < count, a multiple of BLOCK.
void rowDots(const double* table, std::ptrdiff_t stride, const double* x, int rows, int count,
             double* out);

/// The smallest of each BLOCK of numbers; count: a multiple of BLOCK.
void blockMinima(const double* numbers, int count, double* minima);

}  // namespace fabric::planner
