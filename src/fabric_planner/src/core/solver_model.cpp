// SPDX-License-Identifier: BSD-3-Clause
#include "solver_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver_kernels.hpp"

namespace fabric::planner {
namespace {

constexpr int FEW_STATES = 64;
constexpr double MAX_WRITTEN_OUT = 4e6;  // numbers
constexpr double NEGLIGIBLE = 1e-300;    // smaller entries count as zero

}  // namespace

SparseBelief::SparseBelief(const Eigen::Ref<const Eigen::VectorXd>& dense) {
  for (Eigen::Index s = 0; s < dense.size(); ++s) {
    if (dense(s) <= NEGLIGIBLE) continue;
    index.push_back(static_cast<int>(s));
    value.push_back(dense(s));
  }
}

double SparseBelief::sum() const { return std::accumulate(value.begin(), value.end(), 0.0); }

Eigen::VectorXd SparseBelief::dense(int states) const {
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(states);
  for (size_t i = 0; i < index.size(); ++i) vector(index[i]) = value[i];
  return vector;
}

double distance(const SparseBelief& left, const SparseBelief& right) {
  double sum = 0.0;
  size_t i = 0;
  size_t j = 0;
  while (i < left.index.size() || j < right.index.size()) {
    const bool only_left =
        j == right.index.size() || (i < left.index.size() && left.index[i] < right.index[j]);
    const bool only_right =
        i == left.index.size() || (j < right.index.size() && right.index[j] < left.index[i]);
    const double x = only_right ? 0.0 : left.value[i];
    const double y = only_left ? 0.0 : right.value[j];
    sum += std::abs(x - y);
    i += only_right ? 0 : 1;
    j += only_left ? 0 : 1;
  }
  return sum;
}

double Outcomes::probability(int o) const {
  return std::accumulate(value(o), value(o) + size(o), 0.0);
}

SparseBelief Outcomes::normalised(int o) const {
  SparseBelief belief;
  belief.index.assign(index(o), index(o) + size(o));
  belief.value.assign(value(o), value(o) + size(o));
  const double sum = probability(o);
  for (double& entry : belief.value) entry /= sum;
  return belief;
}

SolverModel::SolverModel(const Pomdp& model)
    : m_(model),
      states_(model.numStates()),
      actions_(model.numActions()),
      observations_(model.numObservations()),
      width_(inBlocks(model.numStates())) {
  for (int a = 0; a < actions_; ++a) {
    O_.emplace_back(m_.O(a));
    projection_work_ += static_cast<double>(m_.T(a).nonZeros() + m_.O(a).nonZeros()) / actions_;
  }
  const double numbers = static_cast<double>(actions_) * (states_ + observations_) * width_;
  if (states_ <= FEW_STATES && numbers <= MAX_WRITTEN_OUT) writeOut();
}

void SolverModel::writeOut() {
  written_out_ = true;
  const auto width = static_cast<size_t>(width_);
  const auto A = static_cast<size_t>(actions_);
  T_dense_.assign(A * static_cast<size_t>(states_) * width, 0.0);
  O_dense_.assign(A * static_cast<size_t>(observations_) * width, 0.0);
  for (int a = 0; a < actions_; ++a) {
    double* T = T_dense_.data() + static_cast<size_t>(a * states_) * width;
    double* O = O_dense_.data() + static_cast<size_t>(a * observations_) * width;
    for (int s = 0; s < states_; ++s) {
      for (SparseRows::InnerIterator it(m_.T(a), s); it; ++it) {
        T[it.col() * width_ + s] = m_.discount() * it.value();
      }
      for (Rows::InnerIterator it(O_[static_cast<size_t>(a)], s); it; ++it) {
        O[it.col() * width_ + s] = it.value();
      }
    }
  }
}

double SolverModel::reward(const SparseBelief& belief, int action) const {
  double sum = 0.0;
  for (size_t i = 0; i < belief.index.size(); ++i) {
    sum += belief.value[i] * m_.R()(action, belief.index[i]);
  }
  return sum;
}

bool SolverModel::isAllowed(const SparseBelief& belief, int action) const {
  if (m_.allowed().size() == 0) return true;
  return std::all_of(belief.index.begin(), belief.index.end(),
                     [&](int s) { return m_.allowed()(action, s); });
}

void SolverModel::successors(const SparseBelief& belief, int action, Outcomes& out) const {
  out.dense_.resize(static_cast<size_t>(states_), 0.0);
  out.touched_.clear();
  for (size_t i = 0; i < belief.index.size(); ++i) {
    for (SparseRows::InnerIterator it(m_.T(action), belief.index[i]); it; ++it) {
      double& entry = out.dense_[static_cast<size_t>(it.col())];
      if (entry == 0.0) out.touched_.push_back(static_cast<int>(it.col()));
      entry += belief.value[i] * it.value();
    }
  }
  std::sort(out.touched_.begin(), out.touched_.end());
  out.touched_.erase(std::unique(out.touched_.begin(), out.touched_.end()), out.touched_.end());
  out.predicted_.index.clear();
  out.predicted_.value.clear();
  out.capacity_ = out.touched_.size();
  out.counts_.assign(static_cast<size_t>(observations_), 0);
  out.index_.resize(out.capacity_ * static_cast<size_t>(observations_));
  out.value_.resize(out.index_.size());
  for (const int s : out.touched_) {
    const double chance = out.dense_[static_cast<size_t>(s)];
    out.dense_[static_cast<size_t>(s)] = 0.0;
    out.predicted_.index.push_back(s);
    out.predicted_.value.push_back(chance);
    for (Rows::InnerIterator it(O_[static_cast<size_t>(action)], s); it; ++it) {
      const double joint = chance * it.value();
      if (joint <= NEGLIGIBLE) continue;
      int& count = out.counts_[static_cast<size_t>(it.col())];
      const size_t place = out.begin(static_cast<int>(it.col())) + static_cast<size_t>(count++);
      out.index_[place] = s;
      out.value_[place] = joint;
    }
  }
}

double SolverModel::successorWork(int possible_states) const {
  return projection_work_ * possible_states / states_;
}

void SolverModel::backProject(int action, const double* const* next, double* scratch,
                              double* out) const {
  if (written_out_) {
    const double* O = O_dense_.data() + static_cast<size_t>(action * observations_ * width_);
    sumOfProducts(O, width_, next, observations_, width_, scratch);
    const double* T = T_dense_.data() + static_cast<size_t>(action * states_ * width_);
    combineConsecutive(T, width_, scratch, states_, width_, out);
    return;
  }
  const auto& O = O_[static_cast<size_t>(action)];
  for (int s = 0; s < states_; ++s) {
    double sum = 0.0;
    for (Rows::InnerIterator it(O, s); it; ++it) sum += it.value() * next[it.col()][s];
    scratch[s] = sum;
  }
  for (int s = 0; s < states_; ++s) {
    double sum = 0.0;
    for (SparseRows::InnerIterator it(m_.T(action), s); it; ++it) {
      sum += it.value() * scratch[it.col()];
    }
    out[s] = m_.discount() * sum;
  }
  std::fill(out + states_, out + width_, 0.0);
}

}  // namespace fabric::planner
