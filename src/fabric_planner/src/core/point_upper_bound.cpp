// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>
#include <numeric>

#include "fabric_planner/solve.hpp"
#include "fabric_planner/upper_bound.hpp"
#include "interpolator.hpp"
#include "point_table.hpp"
#include "solver_kernels.hpp"

namespace fabric::planner {
namespace {

// HUGE_INVERSE times the smallest entry is above 1, so that a point's empty states never bind.
constexpr double HUGE_INVERSE = 1e305;
constexpr double SMALLEST_ENTRY = 1e-300;

/// What value() computes in, one for each thread.
struct Scratch {
  Eigen::VectorXd base;
  Eigen::VectorXd rest;
  std::vector<double> entries;
  std::vector<double> share;
  std::vector<double> gain;
};

Scratch& scratch() {
  thread_local Scratch own;
  return own;
}

}  // namespace

PointUpperBound::PointUpperBound(AlphaVectors base)
    : base_(std::move(base)), corners_(base_.vectors.colwise().maxCoeff().transpose()) {}

PointUpperBound::PointUpperBound(AlphaVectors base, const Eigen::VectorXd& corners,
                                 const Eigen::MatrixXd& points, const Eigen::VectorXd& values,
                                 int query_points)
    : PointUpperBound(std::move(base)) {
  corners_ = corners_.cwiseMin(corners);
  auto table = std::make_shared<PointTable>(static_cast<int>(points.rows()));
  for (Eigen::Index s = 0; s < corners_.size(); ++s) {
    table->setCorner(static_cast<int>(s), corners_(s));
  }
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    table->add(SparseBelief(points.col(k)), values(k));
  }
  table_ = std::move(table);
  prepareQueries(std::min(query_points, table_->size()));
}

void PointUpperBound::prepareQueries(int query_points) {
  const auto S = static_cast<int>(corners_.size());
  stride_ = inBlocks(query_points);
  gain_.resize(query_points);
  base_at_points_.resize(base_.vectors.rows(), query_points);
  inverse_.assign(static_cast<size_t>(S) * static_cast<size_t>(stride_), HUGE_INVERSE);
  all_states_.resize(static_cast<size_t>(S));
  std::iota(all_states_.begin(), all_states_.end(), 0);
  for (int k = 0; k < query_points; ++k) {
    const SparseBelief& belief = table_->belief(k);
    const Eigen::VectorXd point = belief.dense(S);
    gain_(k) = table_->value(k) - corners_.dot(point);
    base_at_points_.col(k) = base_.vectors * point;
    for (const int s : belief.index) {
      inverse_[static_cast<size_t>(s) * static_cast<size_t>(stride_) + static_cast<size_t>(k)] =
          std::min(HUGE_INVERSE, 1.0 / point(s));
    }
  }
}

double PointUpperBound::value(const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  Scratch& own = scratch();
  own.base.resize(base_.vectors.rows());
  own.base.noalias() = base_.vectors * belief;
  const double between_corners = corners_.dot(belief);
  const double plain = std::min(own.base.maxCoeff(), between_corners);
  if (gain_.size() == 0) return plain;
  own.entries.resize(static_cast<size_t>(belief.size()));
  own.share.resize(static_cast<size_t>(stride_));
  own.gain.resize(static_cast<size_t>(stride_));
  for (Eigen::Index s = 0; s < belief.size(); ++s) {
    own.entries[static_cast<size_t>(s)] = std::max(belief(s), SMALLEST_ENTRY);
  }
  smallestProducts(inverse_.data(), stride_, all_states_.data(), own.entries.data(),
                   static_cast<int>(belief.size()), stride_, own.share.data());
  const auto points = static_cast<int>(gain_.size());
  for (int k = 0; k < points; ++k) {
    own.gain[static_cast<size_t>(k)] = own.share[static_cast<size_t>(k)] * gain_(k);
  }
  const int point = positionOfSmallest(own.gain.data(), points);
  const double share = own.share[static_cast<size_t>(point)];
  own.rest.resize(own.base.size());
  own.rest.noalias() = own.base - share * base_at_points_.col(point);
  return std::min({plain, between_corners + own.gain[static_cast<size_t>(point)],
                   share * table_->value(point) + own.rest.maxCoeff()});
}

double PointUpperBound::exactValue(const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  const double cheap = value(belief);
  if (!table_ || table_->size() == 0) return cheap;
  thread_local Interpolator interpolator;
  const SparseBelief sparse(belief);
  std::vector<int> basis(sparse.index.size(), -1);
  return std::min(cheap, interpolator.solve(*table_, sparse.index.data(), sparse.value.data(),
                                            sparse.size(), basis.data()));
}

Eigen::MatrixXd PointUpperBound::points() const {
  const int count = table_ ? table_->size() : 0;
  Eigen::MatrixXd all(corners_.size(), count);
  for (int k = 0; k < count; ++k) {
    all.col(k) = table_->belief(k).dense(static_cast<int>(corners_.size()));
  }
  return all;
}

Eigen::VectorXd PointUpperBound::values() const {
  const int count = table_ ? table_->size() : 0;
  return Eigen::Map<const Eigen::VectorXd>(count > 0 ? table_->values() : nullptr, count);
}

PointUpperBound pointBasedUpperBound(const Pomdp& model, const UpperBoundOptions& options) {
  SolveOptions limits;
  limits.time = std::numeric_limits<double>::infinity();
  limits.work = options.work;
  limits.gap = options.gap;
  limits.points = options.points;
  limits.query_points = options.query_points;
  limits.lower_share = 0.1;
  return solve(model, limits).upper;
}

}  // namespace fabric::planner
