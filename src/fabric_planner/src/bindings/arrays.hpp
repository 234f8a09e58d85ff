// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Copies an array (A, rows, columns) into one matrix an action.
inline std::vector<Eigen::MatrixXd> toMatrices(const Array& array, const std::string& element) {
  if (array.ndim() != 3) {
    throw ModelError(element + " has " + std::to_string(array.ndim()) + " dimensions, expected 3");
  }
  std::vector<Eigen::MatrixXd> matrices;
  const auto slice = array.shape(1) * array.shape(2);
  for (pybind11::ssize_t i = 0; i < array.shape(0); ++i) {
    matrices.emplace_back(
        Eigen::Map<const RowMajor>(array.data() + i * slice, array.shape(1), array.shape(2)));
  }
  return matrices;
}

/// Copies matrices of one size into an array (A, rows, columns).
inline Array toArray(const std::vector<Eigen::MatrixXd>& matrices) {
  const auto rows = matrices.empty() ? 0 : matrices[0].rows();
  const auto cols = matrices.empty() ? 0 : matrices[0].cols();
  Array array({static_cast<Eigen::Index>(matrices.size()), rows, cols});
  for (size_t i = 0; i < matrices.size(); ++i) {
    Eigen::Map<RowMajor>(array.mutable_data() + static_cast<Eigen::Index>(i) * rows * cols, rows,
                         cols) = matrices[i];
  }
  return array;
}

}  // namespace fabric::planner
