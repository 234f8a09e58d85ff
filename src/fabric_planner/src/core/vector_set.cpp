// SPDX-License-Identifier: BSD-3-Clause
#include "vector_set.hpp"

#include <algorithm>

#include "solver_kernels.hpp"

namespace fabric::planner {

VectorSet::VectorSet(int states) : states_(states), width_(inBlocks(states)) { reserve(BLOCK); }

void VectorSet::reserve(int count) {
  if (count <= stride_) return;
  const int stride = inBlocks(std::max(count, stride_ + stride_ / 2));
  std::vector<double> columns(static_cast<size_t>(states_) * static_cast<size_t>(stride), 0.0);
  for (int s = 0; s < states_; ++s) {
    std::copy_n(columns_.data() + static_cast<std::ptrdiff_t>(s) * stride_, size(),
                columns.data() + static_cast<std::ptrdiff_t>(s) * stride);
  }
  columns_.swap(columns);
  stride_ = stride;
  scores_.resize(static_cast<size_t>(stride));
}

void VectorSet::add(const double* vector, int action) {
  reserve(size() + 1);
  actions_.push_back(action);
  rows_.resize(rows_.size() + static_cast<size_t>(width_), 0.0);
  set(size() - 1, vector);
}

void VectorSet::set(int k, const double* vector) {
  std::copy_n(vector, states_, rows_.data() + static_cast<std::ptrdiff_t>(k) * width_);
  for (int s = 0; s < states_; ++s) {
    columns_[static_cast<size_t>(s) * static_cast<size_t>(stride_) + static_cast<size_t>(k)] =
        vector[s];
  }
}

void VectorSet::keep(const std::vector<int>& kept) {
  VectorSet smaller(states_);
  smaller.reserve(static_cast<int>(kept.size()));
  for (const int k : kept) smaller.add(row(k), action(k));
  *this = std::move(smaller);
}

VectorSet::Best VectorSet::best(const int* index, const double* value, int n) const {
  combineRows(columns_.data(), stride_, index, value, n, nullptr, inBlocks(size()), scores_.data());
  const int k = positionOfLargest(scores_.data(), size());
  return {k, scores_[static_cast<size_t>(k)]};
}

Eigen::MatrixXd VectorSet::matrix() const {
  Eigen::MatrixXd all(size(), states_);
  for (int k = 0; k < size(); ++k) {
    all.row(k) = Eigen::Map<const Eigen::RowVectorXd>(row(k), states_);
  }
  return all;
}

}  // namespace fabric::planner
