// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <memory>

#include "bindings.hpp"
#include "fabric_planner/pomdp.hpp"

namespace py = pybind11;

namespace fabric::planner {
namespace {

using Tensor = py::array_t<double, py::array::c_style | py::array::forcecast>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<Eigen::MatrixXd> toMatrices(const Tensor& tensor, const std::string& element) {
  if (tensor.ndim() != 3) throw ModelError(element + " needs three dimensions");
  std::vector<Eigen::MatrixXd> matrices;
  for (py::ssize_t i = 0; i < tensor.shape(0); ++i) {
    matrices.emplace_back(
        Eigen::Map<const RowMajor>(tensor.data(i, 0, 0), tensor.shape(1), tensor.shape(2)));
  }
  return matrices;
}

}  // namespace

void bindPomdp(py::module_& module) {
  (void)module;
  (void)toMatrices;
}

}  // namespace fabric::planner
