// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace fabric::planner::kernels {

/// out[j] = sum_i x[i] table[i][j]: table (rows, width), width a multiple of LANES.
void rowTimesTable(const double* x, const double* table, int rows, int width, double* out);

/// out = x .* y, all of `width` numbers, a multiple of LANES. @return the sum of out.
double multiply(const double* x, const double* y, int width, double* out);

/// Which columns of P(s', o | b, a) are made: (a, o) is column a * symbols + o.
struct JointColumns {
  int first;  ///< column
  int count;
  int states;
  int state_width;   ///< of `predicted`
  int symbols;       ///< observations
  int symbol_width;  ///< of `emissions`
};

/// points[r][c] = predicted[a][s] emissions[a][s][o] with s = components[r] for each column.
///
/// predicted: (A, state_width). emissions: (A, states, symbol_width), and LANES numbers behind it.
/// points: (rows, width), and LANES numbers behind it; width >= count.
void jointColumns(const JointColumns& columns, const double* predicted, const double* emissions,
                  const int* components, int rows, int width, double* points);

/// sums[c] = sum_r points[r][c]. points: (rows, width), width a multiple of LANES.
void columnSums(const double* points, int rows, int width, double* sums);

/// Linear functions at many points at once.
//////
/// functions: (count, stride), count a multiple of 4. points: (rows, width), one column a point,
/// width a multiple of LANES; its row r holds component components[r] of every point.
/// @param best (width,): for each point the largest function value.
void largestOf(const double* functions, int count, int stride, const double* points,
               const int* components, int rows, int width, double* best);

/// The largest of linear functions at one sparse point.
///
/// functions: (components, count), count a multiple of LANES; the point's entry i has the value
/// values[i] and stands at component indices[i].
double largestAt(const double* functions, int count, const int* indices, const double* values,
                 int entries);

}  // namespace fabric::planner::kernels
