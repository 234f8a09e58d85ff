// SPDX-License-Identifier: BSD-3-Clause
#include "successors.hpp"

#include <algorithm>
#include <limits>

#include "kernels.hpp"

namespace fabric::planner {
namespace {

constexpr double WORK_BETWEEN_LOOKS = 3e5;  // multiplications, some 0.05 ms
constexpr double IMPOSSIBLE = std::numeric_limits<double>::min();

int roundedUp(Eigen::Index count, int step) {
  return (static_cast<int>(count) + step - 1) / step * step;
}

/// Vector by vector: (count, S), the last repeated.
std::vector<double> byVector(const Eigen::MatrixXd& vectors, int count) {
  std::vector<double> table;
  for (int k = 0; k < count; ++k) {
    const auto row = vectors.row(std::min<Eigen::Index>(k, vectors.rows() - 1));
    for (Eigen::Index s = 0; s < row.size(); ++s) table.push_back(row(s));
  }
  return table;
}

/// State by state: (S, count), the last vector repeated.
std::vector<double> byState(const Eigen::MatrixXd& vectors, int count) {
  std::vector<double> table;
  for (Eigen::Index s = 0; s < vectors.cols(); ++s) {
    for (int k = 0; k < count; ++k) {
      table.push_back(vectors(std::min<Eigen::Index>(k, vectors.rows() - 1), s));
    }
  }
  return table;
}

}  // namespace

Successors::Successors(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper)
    : m_(model), vectors_(lower.vectors), upper_(upper), width_(padded(model.numStates())) {
  if (PaddedModel::fits(model)) padded_ = std::make_unique<PaddedModel>(model);
  const int step = padded_ ? 4 : LANES;
  const auto table = padded_ ? byVector : byState;
  const Eigen::MatrixXd& base = upper_.base().vectors;
  lower_count_ = roundedUp(lower.vectors.rows(), step);
  base_count_ = roundedUp(base.rows(), step);
  lower_ = table(lower.vectors, lower_count_);
  base_ = table(base, base_count_);
  work_per_entry_ = lower_count_ + base_count_;
  const int columns = m_.numActions() * m_.numObservations();
  const double fitting = WORK_BETWEEN_LOOKS / (work_per_entry_ * m_.numStates());
  columns_at_once_ = std::clamp(static_cast<int>(std::min<double>(fitting, columns)), 1, columns);
  const auto at_once = static_cast<size_t>(padded(columns_at_once_));
  const auto states = static_cast<size_t>(m_.numStates());
  predicted_ =
      AlignedArray<double>(static_cast<size_t>(m_.numActions()) * static_cast<size_t>(width_));
  points_ = AlignedArray<double>(padded_ ? states * at_once + LANES : 0);
  sums_ = AlignedArray<double>(at_once);
  lowers_ = AlignedArray<double>(at_once);
  uppers_ = AlignedArray<double>(at_once);
  components_.resize(states);
  values_.resize(states);
  joint_.assign(static_cast<size_t>(width_), 0.0);
  if (padded_) std::fill_n(points_.data(), states * at_once + LANES, 0.0);
}

bool Successors::bound(const double* belief, Stopwatch& watch, double* probability, double* lower,
                       double* upper) {
  const bool in_time = padded_ ? boundPadded(belief, watch, probability, lower, upper)
                               : boundSparse(belief, watch, probability, lower, upper);
  return in_time && (upper_.numPoints() == 0 || refine(belief, watch, probability, lower, upper));
}

bool Successors::boundPadded(const double* belief, Stopwatch& watch, double* probability,
                             double* lower, double* upper) {
  const int columns = m_.numActions() * m_.numObservations();
  for (int a = 0; a < m_.numActions(); ++a) {
    kernels::rowTimesTable(belief, padded_->T(a), m_.numStates(), width_, predicted(a));
  }
  for (int first = 0; first < columns; first += columns_at_once_) {
    if (first > 0 && watch.timeIsUp()) return false;
    const int count = std::min(columns_at_once_, columns - first);
    boundColumns(first, count, probability + first, lower + first, upper + first);
  }
  return true;
}

void Successors::boundColumns(int first, int count, double* probability, double* lower,
                              double* upper) {
  int rows = 0;
  for (int s = 0; s < m_.numStates(); ++s) {
    double chance = 0.0;
    for (int a = 0; a < m_.numActions(); ++a) chance += predicted(a)[s];
    components_[static_cast<size_t>(rows)] = s;
    rows += chance > 0.0 ? 1 : 0;
  }
  const int width = padded(count);
  const int* components = components_.data();
  const int states = m_.numStates();
  kernels::jointColumns(
      {first, count, states, width_, m_.numObservations(), padded_->symbolWidth()},
      predicted_.data(), padded_->O(), components, rows, width, points_.data());
  kernels::columnSums(points_.data(), rows, width, sums_.data());
  kernels::largestOf(lower_.data(), lower_count_, states, points_.data(), components, rows, width,
                     lowers_.data());
  kernels::largestOf(base_.data(), base_count_, states, points_.data(), components, rows, width,
                     uppers_.data());
  for (int c = 0; c < count; ++c) {
    const auto i = static_cast<size_t>(c);
    const bool possible = sums_[i] >= IMPOSSIBLE;
    const double scale = possible ? 1.0 / sums_[i] : 0.0;
    probability[c] = possible ? sums_[i] : 0.0;
    lower[c] = possible ? lowers_[i] * scale : 0.0;
    upper[c] = possible ? std::max(uppers_[i] * scale, lower[c]) : 0.0;
  }
}

bool Successors::boundSparse(const double* belief, Stopwatch& watch, double* probability,
                             double* lower, double* upper) {
  double work = 0.0;
  for (int a = 0; a < m_.numActions(); ++a) {
    predictSparse(m_, belief, a, predicted(a));
    work += static_cast<double>(m_.T(a).nonZeros());
    for (int o = 0; o < m_.numObservations(); ++o, ++probability, ++lower, ++upper) {
      const int entries = gather(a, o, *probability);
      const bool possible = *probability >= IMPOSSIBLE;
      const double scale = possible ? 1.0 / *probability : 0.0;
      if (!possible) *probability = 0.0;
      *lower = possible ? scale * largestAtEntries(lower_, lower_count_, entries) : 0.0;
      *upper = possible ? scale * largestAtEntries(base_, base_count_, entries) : 0.0;
      *upper = std::max(*lower, *upper);
      work += work_per_entry_ * entries;
      if (work < WORK_BETWEEN_LOOKS) continue;
      work = 0.0;
      if (watch.timeIsUp()) return false;
    }
  }
  return true;
}

/// Lowers the upper bounds by the points, for the actions that may be the best: for the others
/// nobody will ask.
bool Successors::refine(const double* belief, Stopwatch& watch, const double* probability,
                        const double* lower, double* upper) {
  const Eigen::Map<const Eigen::VectorXd> states(belief, m_.numStates());
  const int symbols = m_.numObservations();
  double best = -std::numeric_limits<double>::infinity();
  for (int a = 0; a < m_.numActions(); ++a) {
    if (!m_.isAllowed(a, states)) continue;
    best = std::max(best, reward(belief, a) + m_.discount() * mean(probability, lower, a));
  }
  const double work_a_column = static_cast<double>(upper_.numPoints()) * m_.numStates();
  double work = 0.0;
  for (int a = 0; a < m_.numActions(); ++a) {
    if (!m_.isAllowed(a, states)) continue;
    if (reward(belief, a) + m_.discount() * mean(probability, upper, a) < best) continue;
    for (int i = a * symbols; i < (a + 1) * symbols; ++i) {
      if (probability[i] <= 0.0 || upper[i] <= lower[i]) continue;
      const double value = upperAfter(a, i - a * symbols) / probability[i];
      upper[i] = std::max(lower[i], std::min(upper[i], value));
      work += work_a_column;
      if (work < WORK_BETWEEN_LOOKS) continue;
      work = 0.0;
      if (watch.timeIsUp()) return false;
    }
  }
  return true;
}

double Successors::mean(const double* probability, const double* value, int action) const {
  const int symbols = m_.numObservations();
  double sum = 0.0;
  for (int i = action * symbols; i < (action + 1) * symbols; ++i) sum += probability[i] * value[i];
  return sum;
}

/// The upper bound with its points at P(., o | b, a), b being what predicted() is of.
double Successors::upperAfter(int action, int observation) {
  const Eigen::Map<const Eigen::VectorXd> joint(joint_.data(), m_.numStates());
  if (padded_) {
    kernels::multiply(predicted(action), padded_->likelihood(action, observation), width_,
                      joint_.data());
    return upper_.value(joint);
  }
  double sum = 0.0;
  const int entries = gather(action, observation, sum);
  for (int i = 0; i < entries; ++i) {
    joint_[static_cast<size_t>(components_[static_cast<size_t>(i)])] =
        values_[static_cast<size_t>(i)];
  }
  const double value = upper_.value(joint);
  for (int i = 0; i < entries; ++i) {
    joint_[static_cast<size_t>(components_[static_cast<size_t>(i)])] = 0.0;
  }
  return value;
}

int Successors::gather(int action, int observation, double& sum) {
  int entries = 0;
  sum = 0.0;
  for (SparseColumns::InnerIterator it(m_.O(action), observation); it; ++it) {
    const double value = predicted(action)[it.row()] * it.value();
    components_[static_cast<size_t>(entries)] = static_cast<int>(it.row());
    values_[static_cast<size_t>(entries)] = value;
    entries += value > 0.0 ? 1 : 0;
    sum += value;
  }
  return entries;
}

double Successors::largestAtEntries(const std::vector<double>& functions, int count,
                                    int entries) const {
  return kernels::largestAt(functions.data(), count, components_.data(), values_.data(), entries);
}

double Successors::reward(const double* belief, int action) const {
  double sum = 0.0;
  for (int s = 0; s < m_.numStates(); ++s) sum += belief[s] * m_.R()(action, s);
  return sum;
}

bool Successors::follow(const double* belief, int action, int observation, double* next) {
  double sum = 0.0;
  if (padded_) {
    kernels::rowTimesTable(belief, padded_->T(action), m_.numStates(), width_, predicted(action));
    sum = kernels::multiply(predicted(action), padded_->likelihood(action, observation), width_,
                            next);
  } else {
    predictSparse(m_, belief, action, predicted(action));
    std::fill_n(next, width_, 0.0);
    const int entries = gather(action, observation, sum);
    for (int i = 0; i < entries; ++i) {
      next[components_[static_cast<size_t>(i)]] = values_[static_cast<size_t>(i)];
    }
  }
  if (sum < IMPOSSIBLE) return false;
  for (int s = 0; s < width_; ++s) next[s] /= sum;
  return true;
}

void Successors::boundsAt(const double* belief, double& lower, double& upper) {
  const Eigen::Map<const Eigen::VectorXd> b(belief, m_.numStates());
  lower = -std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < vectors_.rows(); ++k)
    lower = std::max(lower, vectors_.row(k).dot(b));
  upper = std::max(lower, upper_.value(b));
}

}  // namespace fabric::planner
