// SPDX-License-Identifier: BSD-3-Clause
#include "padded_model.hpp"

#include <algorithm>

namespace fabric::planner {

PaddedModel::PaddedModel(const Pomdp& model)
    : states_(model.numStates()),
      symbols_(model.numObservations()),
      state_width_(padded(states_)),
      symbol_width_(padded(symbols_)) {
  const auto actions = static_cast<size_t>(model.numActions());
  const auto states = static_cast<size_t>(states_);
  const auto state_width = static_cast<size_t>(state_width_);
  const auto symbol_width = static_cast<size_t>(symbol_width_);
  transitions_.assign(actions * states * state_width, 0.0);
  emissions_.assign(actions * states * symbol_width + LANES, 0.0);
  likelihoods_.assign(actions * static_cast<size_t>(symbols_) * state_width, 0.0);
  for (size_t a = 0; a < actions; ++a) {
    const auto& T = model.T(static_cast<int>(a));
    for (Eigen::Index s = 0; s < states_; ++s) {
      for (SparseRows::InnerIterator it(T, s); it; ++it) {
        transitions_[(a * states + static_cast<size_t>(s)) * state_width +
                     static_cast<size_t>(it.col())] = it.value();
      }
    }
    const auto& O = model.O(static_cast<int>(a));
    for (Eigen::Index o = 0; o < symbols_; ++o) {
      for (SparseColumns::InnerIterator it(O, o); it; ++it) {
        const auto s = static_cast<size_t>(it.row());
        const auto symbol = static_cast<size_t>(o);
        emissions_[(a * states + s) * symbol_width + symbol] = it.value();
        likelihoods_[(a * static_cast<size_t>(symbols_) + symbol) * state_width + s] = it.value();
      }
    }
  }
}

const double* PaddedModel::T(int action) const {
  return transitions_.data() + static_cast<std::ptrdiff_t>(action) * states_ * state_width_;
}

const double* PaddedModel::likelihood(int action, int observation) const {
  return likelihoods_.data() +
         (static_cast<std::ptrdiff_t>(action) * symbols_ + observation) * state_width_;
}

void predictSparse(const Pomdp& model, const double* belief, int action, double* predicted) {
  std::fill(predicted, predicted + model.numStates(), 0.0);
  const SparseRows& T = model.T(action);
  for (Eigen::Index s = 0; s < model.numStates(); ++s) {
    if (belief[s] == 0.0) continue;
    for (SparseRows::InnerIterator it(T, s); it; ++it) {
      predicted[it.col()] += belief[s] * it.value();
    }
  }
}

}  // namespace fabric::planner
