// SPDX-License-Identifier: BSD-3-Clause
#include "point_table.hpp"

#include <algorithm>

#include "solver_kernels.hpp"

namespace fabric::planner {

std::uint64_t maskOf(const int* index, int n) {
  std::uint64_t mask = 0;
  for (int i = 0; i < n; ++i) mask |= std::uint64_t{1} << (static_cast<unsigned>(index[i]) % 64U);
  return mask;
}

void PointTable::reserve(int count) {
  if (count <= stride_) return;
  const int stride = inBlocks(std::max({count, 4 * BLOCK, stride_ + stride_ / 2}));
  std::vector<double> rows(static_cast<size_t>(states_) * static_cast<size_t>(stride), 0.0);
  for (int s = 0; s < states_; ++s) {
    std::copy_n(rows_.data() + static_cast<std::ptrdiff_t>(s) * stride_, size(),
                rows.data() + static_cast<std::ptrdiff_t>(s) * stride);
  }
  rows_.swap(rows);
  stride_ = stride;
  values_.resize(static_cast<size_t>(stride), 0.0);
  masks_.resize(static_cast<size_t>(stride), ~std::uint64_t{0});
}

void PointTable::add(SparseBelief belief, double v) {
  reserve(size() + 1);
  const auto k = static_cast<size_t>(size());
  for (int i = 0; i < belief.size(); ++i) {
    const auto s = static_cast<size_t>(belief.index[static_cast<size_t>(i)]);
    rows_[s * static_cast<size_t>(stride_) + k] = belief.value[static_cast<size_t>(i)];
  }
  values_[k] = v;
  masks_[k] = maskOf(belief.index.data(), belief.size());
  beliefs_.push_back(std::move(belief));
}

}  // namespace fabric::planner
