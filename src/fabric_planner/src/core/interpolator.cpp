// SPDX-License-Identifier: BSD-3-Clause
#include "interpolator.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "solver_kernels.hpp"

namespace fabric::planner {
namespace {

constexpr int WIDTH = Interpolator::MAX_ROWS;
constexpr int MAX_PIVOTS = 400;
constexpr int MAX_CANDIDATES = 64;
constexpr double PROMISING = 0.3;  // share of the most negative reduced cost
constexpr double DOES_NOT_FIT = 1e300;
constexpr double SMALLEST_PIVOT = 1e-9;
constexpr double RELATIVE = 1e-10;  // reduced cost that counts, relative to the values

}  // namespace

double Interpolator::solve(const PointTable& table, const int* index, const double* tau, int n,
                           int* basis) {
  begin(table, index, tau, n);
  if (n > MAX_ROWS) takeOnePoint(basis);
  if (n > 1 && n <= MAX_ROWS && table.size() > 0) {
    restore(basis);
    findPrices(basis);
    for (int i = 0; i < MAX_PIVOTS && improve(basis); ++i) {
    }
  }
  return certify(basis);
}

void Interpolator::begin(const PointTable& table, const int* index, const double* tau, int n) {
  table_ = &table;
  index_ = index;
  tau_ = tau;
  n_ = n;
  const auto size = static_cast<size_t>(n);
  inverse_.resize(static_cast<size_t>(WIDTH) * WIDTH);
  amounts_.resize(WIDTH);
  prices_.resize(WIDTH);
  column_.resize(WIDTH);
  rest_.resize(size);
  costs_.resize(static_cast<size_t>(table.stride()));
  minima_.resize(costs_.size() / BLOCK);
  entries_.resize(WIDTH);
  std::fill(entries_.begin(), entries_.end(), 0.0);
  reduced_.resize(std::max(costs_.size(), static_cast<size_t>(MAX_CANDIDATES)));
  candidates_.clear();
  columns_.resize(static_cast<size_t>(WIDTH) * MAX_CANDIDATES);
  candidate_costs_.resize(MAX_CANDIDATES);
  if (rows_.empty()) {
    rows_.resize(WIDTH);
    std::iota(rows_.begin(), rows_.end(), 0);
  }
  double largest = 0.0;
  for (int r = 0; r < n; ++r) largest = std::max(largest, std::abs(table.corner(index[r])));
  tolerance_ = RELATIVE * (1.0 + largest);
  const std::uint64_t impossible = ~maskOf(index, n);
  const std::uint64_t* masks = table.masks();
  const double* values = table.values();
  for (int k = 0; k < table.size(); ++k) {
    costs_[static_cast<size_t>(k)] = (masks[k] & impossible) != 0 ? DOES_NOT_FIT : values[k];
  }
  std::fill(costs_.begin() + table.size(), costs_.end(), DOES_NOT_FIT);
}

void Interpolator::clear(int* basis) {
  const int used = inBlocks(n_);
  for (int r = 0; r < n_; ++r) {
    std::fill_n(inverse_.data() + r * WIDTH, used, 0.0);
    inverse_[static_cast<size_t>(r * WIDTH + r)] = 1.0;
    amounts_[static_cast<size_t>(r)] = tau_[r];
    basis[r] = -1;
  }
}

/// Brings the points of an old basis back in, each in the row where that is most accurate. Rows of
/// corners stay as they are: the corners belong to the basis too.
void Interpolator::restore(int* basis) {
  int points[WIDTH];
  std::copy_n(basis, n_, points);
  clear(basis);
  for (int i = 0; i < n_; ++i) {
    if (points[i] < 0) continue;
    express(points[i]);
    int row = -1;
    for (int r = 0; r < n_; ++r) {
      if (basis[r] >= 0 || points[r] < 0) continue;
      if (row < 0 ||
          std::abs(column_[static_cast<size_t>(r)]) > std::abs(column_[static_cast<size_t>(row)])) {
        row = r;
      }
    }
    if (row < 0 || std::abs(column_[static_cast<size_t>(row)]) < SMALLEST_PIVOT) continue;
    pivot(row);
    basis[row] = points[i];
  }
  const double* least = std::min_element(amounts_.data(), amounts_.data() + n_);
  if (*least < -1e-9 * std::accumulate(tau_, tau_ + n_, 0.0)) clear(basis);
}

bool Interpolator::improve(int* basis) {
  const int column = entering(basis);
  if (column == -1) return false;
  express(column);
  const int row = leaving();
  if (row < 0) return false;
  const double cost = reducedCost(column);
  pivot(row);
  const double* own = inverse_.data() + row * WIDTH;
  for (int r = 0; r < n_; ++r) prices_[static_cast<size_t>(r)] -= cost * own[r];
  if (column >= 0) {
    basis[row] = column;
    return true;
  }
  // The corner enters where another basic variable leaves: rows trade places so that a corner
  // always sits in the row of its state.
  const int home = -2 - column;
  basis[row] = -1;
  if (row != home) {
    std::swap_ranges(inverse_.data() + row * WIDTH, inverse_.data() + row * WIDTH + inBlocks(n_),
                     inverse_.data() + home * WIDTH);
    std::swap(amounts_[static_cast<size_t>(row)], amounts_[static_cast<size_t>(home)]);
    std::swap(basis[row], basis[home]);
  }
  return true;
}

void Interpolator::findPrices(const int* basis) {
  double costs[WIDTH];
  for (int r = 0; r < n_; ++r) {
    costs[r] = basis[r] >= 0 ? -table_->value(basis[r]) : -table_->corner(index_[r]);
  }
  combineConsecutive(inverse_.data(), WIDTH, costs, n_, inBlocks(n_), prices_.data());
  work_ += static_cast<double>(n_) * n_;
}

double Interpolator::reducedCost(int column) const {
  if (column < 0) {
    const int home = -2 - column;
    return table_->corner(index_[home]) + prices_[static_cast<size_t>(home)];
  }
  return std::inner_product(entries_.begin(), entries_.begin() + n_, prices_.begin(),
                            table_->value(column));
}

int Interpolator::entering(const int* basis) {
  double least = -tolerance_;
  const int corner = enteringCorner(basis, least);
  const int candidate = enteringCandidate(least);
  if (candidate >= 0) return candidate;
  if (corner != -1) return corner;
  return enteringPoint(least);
}

int Interpolator::enteringCorner(const int* basis, double& least) const {
  int best = -1;
  for (int r = 0; r < n_; ++r) {
    const double cost = table_->corner(index_[r]) + prices_[static_cast<size_t>(r)];
    if (basis[r] == -1 || cost >= least) continue;
    least = cost;
    best = -2 - r;
  }
  return best;
}

int Interpolator::enteringCandidate(double& least) {
  const int count = static_cast<int>(candidates_.size());
  if (count == 0) return -1;
  combineRows(columns_.data(), MAX_CANDIDATES, rows_.data(), prices_.data(), n_,
              candidate_costs_.data(), inBlocks(count), reduced_.data());
  work_ += static_cast<double>(n_) * count;
  const int k = positionOfSmallest(reduced_.data(), count);
  if (reduced_[static_cast<size_t>(k)] >= least) return -1;
  least = reduced_[static_cast<size_t>(k)];
  return candidates_[static_cast<size_t>(k)];
}

int Interpolator::enteringPoint(double least) {
  const int count = inBlocks(table_->size());
  combineRows(table_->rows(), table_->stride(), index_, prices_.data(), n_, costs_.data(), count,
              reduced_.data());
  work_ += static_cast<double>(n_) * count;
  for (;;) {
    const int k = smallestReduced();
    if (reduced_[static_cast<size_t>(k)] >= least) return -1;
    if (fits(k)) {
      gatherCandidates(reduced_[static_cast<size_t>(k)]);
      return k;
    }
    costs_[static_cast<size_t>(k)] = reduced_[static_cast<size_t>(k)] = DOES_NOT_FIT;
  }
}

int Interpolator::smallestReduced() {
  const int count = inBlocks(table_->size());
  blockMinima(reduced_.data(), count, minima_.data());
  const int block = positionOfSmallest(minima_.data(), count / BLOCK);
  return block * BLOCK + positionOfSmallest(reduced_.data() + block * BLOCK, BLOCK);
}

void Interpolator::gatherCandidates(double least) {
  candidates_.clear();
  const double limit = PROMISING * least;
  for (int k = 0; k < table_->size() && candidates_.size() < MAX_CANDIDATES; ++k) {
    if (k % BLOCK == 0) {
      while (k < table_->size() && minima_[static_cast<size_t>(k / BLOCK)] >= limit) k += BLOCK;
      if (k >= table_->size()) break;
    }
    if (reduced_[static_cast<size_t>(k)] < limit) candidates_.push_back(k);
  }
  if (table_->states() > 64) {
    candidates_.erase(
        std::remove_if(candidates_.begin(), candidates_.end(), [&](int k) { return !fits(k); }),
        candidates_.end());
  }
  std::fill(candidate_costs_.begin(), candidate_costs_.end(), DOES_NOT_FIT);
  for (size_t i = 0; i < candidates_.size(); ++i) {
    candidate_costs_[i] = table_->value(candidates_[i]);
    for (int r = 0; r < n_; ++r) {
      columns_[static_cast<size_t>(r) * MAX_CANDIDATES + i] =
          table_
              ->rows()[static_cast<std::ptrdiff_t>(index_[r]) * table_->stride() + candidates_[i]];
    }
  }
}

/// The masks may take one state for another when there are more than 64.
bool Interpolator::fits(int point) const {
  if (table_->states() <= 64) return true;
  const auto& states = table_->belief(point).index;
  return std::includes(index_, index_ + n_, states.begin(), states.end());
}

void Interpolator::express(int column) {
  if (column < 0) {
    const int home = -2 - column;
    for (int r = 0; r < n_; ++r) {
      column_[static_cast<size_t>(r)] = inverse_[static_cast<size_t>(r * WIDTH + home)];
    }
    return;
  }
  for (int i = 0; i < n_; ++i) {
    entries_[static_cast<size_t>(i)] =
        table_->rows()[static_cast<std::ptrdiff_t>(index_[i]) * table_->stride() + column];
  }
  rowDots(inverse_.data(), WIDTH, entries_.data(), n_, inBlocks(n_), column_.data());
  work_ += static_cast<double>(n_) * n_;
}

/// The smallest ratio of amount to part; ratios are compared by their products.
int Interpolator::leaving() const {
  int row = -1;
  double amount = 0.0;
  double part = 0.0;
  for (int r = 0; r < n_; ++r) {
    const double its_part = column_[static_cast<size_t>(r)];
    if (its_part < SMALLEST_PIVOT) continue;
    const double its_amount = std::max(0.0, amounts_[static_cast<size_t>(r)]);
    const double left = its_amount * part;
    const double right = amount * its_part;
    if (row >= 0 && (left > right || (left == right && its_part <= part))) continue;
    row = r;
    amount = its_amount;
    part = its_part;
  }
  return row;
}

void Interpolator::pivot(int row) {
  pivotRows(inverse_.data(), WIDTH, column_.data(), n_, row, inBlocks(n_));
  amounts_[static_cast<size_t>(row)] /= column_[static_cast<size_t>(row)];
  for (int r = 0; r < n_; ++r) {
    if (r == row) continue;
    amounts_[static_cast<size_t>(r)] -=
        column_[static_cast<size_t>(r)] * amounts_[static_cast<size_t>(row)];
  }
  work_ += static_cast<double>(n_) * n_;
}

/// The point that lowers the value most: as much of it as tau holds, the rest from corners.
void Interpolator::takeOnePoint(int* basis) {
  basis[0] = -1;
  double best = 0.0;
  for (int k = 0; k < table_->size(); ++k) {
    if (costs_[static_cast<size_t>(k)] == DOES_NOT_FIT || !fits(k)) continue;
    const SparseBelief& point = table_->belief(k);
    double share = 1.0;
    double gain = table_->value(k);
    int r = 0;
    for (int i = 0; i < point.size(); ++i) {
      const int s = point.index[static_cast<size_t>(i)];
      const double entry = point.value[static_cast<size_t>(i)];
      while (index_[r] != s) ++r;
      share = std::min(share, tau_[r] / entry);
      gain -= entry * table_->corner(s);
    }
    work_ += point.size();
    if (share * gain >= best) continue;
    best = share * gain;
    basis[0] = k;
    amounts_[0] = share;
  }
}

double Interpolator::certify(const int* basis) {
  weights_.clear();
  std::fill_n(rest_.begin(), n_, 0.0);
  const int used = n_ <= 1 || table_->size() == 0 ? 0 : n_ <= MAX_ROWS ? n_ : 1;
  for (int r = 0; r < used; ++r) {
    const double amount = amounts_[static_cast<size_t>(r)];
    if (basis[r] < 0 || amount <= 0.0) continue;
    weights_.push_back({basis[r], amount});
    const double* entries = table_->rows() + basis[r];
    for (int i = 0; i < n_; ++i) {
      rest_[static_cast<size_t>(i)] +=
          amount * entries[static_cast<std::ptrdiff_t>(index_[i]) * table_->stride()];
    }
  }
  double scale = 1.0;
  for (int i = 0; i < n_; ++i) {
    const double used = rest_[static_cast<size_t>(i)];
    if (used > tau_[i]) scale = std::min(scale, tau_[i] / used);
  }
  double value = 0.0;
  for (Weight& weight : weights_) {
    weight.weight *= scale;
    value += weight.weight * table_->value(weight.point);
  }
  for (int i = 0; i < n_; ++i) {
    double& rest = rest_[static_cast<size_t>(i)];
    rest = std::max(0.0, tau_[i] - scale * rest);
    value += rest * table_->corner(index_[i]);
  }
  return value;
}

}  // namespace fabric::planner
