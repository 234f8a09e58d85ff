// SPDX-License-Identifier: BSD-3-Clause
#include "factor.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "fabric_planner/pomdp.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

constexpr double ROW_TOLERANCE = 1e-6;
constexpr size_t MAX_ENTRIES = size_t{1} << 26;  // half a gigabyte of doubles

/// place: called for the words that begin a message.
template <typename Place>
double number(const std::string& token, const Place& place) {
  const char* begin = token.data() + (token.front() == '+' ? 1 : 0);
  const char* end = token.data() + token.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end) {
    throw ModelError(place() + ": '" + token + "' is not a number");
  }
  if (std::isnan(value)) throw ModelError(place() + ": '" + token + "' is NaN");
  if (std::isinf(value)) throw ModelError(place() + ": '" + token + "' is infinite");
  return value;
}

/// Advances a mixed-radix counter, last digit fastest; false when it wraps round.
bool advance(std::vector<size_t>& digits, const std::vector<size_t>& radix) {
  for (size_t i = digits.size(); i-- > 0;) {
    if (++digits[i] < radix[i]) return true;
    digits[i] = 0;
  }
  return false;
}

}  // namespace

Factor::Factor(std::string element, std::vector<Axis> axes)
    : element_(std::move(element)), axes_(std::move(axes)), strides_(axes_.size()) {
  size_t total = 1;
  for (size_t i = axes_.size(); i-- > 0;) {
    strides_[i] = total;
    total *= size(i);
    if (total > MAX_ENTRIES) throw ModelError(element_ + ": table too large");
  }
  values_.assign(total, 0.0);
  given_.assign(total, false);
}

size_t Factor::count(const std::vector<size_t>& listed) const {
  return std::accumulate(listed.begin(), listed.end(), size_t{1},
                         [this](size_t product, size_t axis) { return product * size(axis); });
}

void Factor::addEntry(const Tokens& instance, const Tokens& table) {
  if (instance.size() != axes_.size()) {
    throw ModelError(element_ + ": instance '" + join(instance, " ") + "' has " +
                     std::to_string(instance.size()) + " tokens, expected " +
                     std::to_string(axes_.size()));
  }
  std::vector<size_t> listed;
  std::vector<std::vector<int>> choices(axes_.size());
  for (size_t i = 0; i < axes_.size(); ++i) {
    if (instance[i] == "-") listed.push_back(i);
    if (instance[i] == "-" || instance[i] == "*") {
      choices[i].resize(size(i));
      std::iota(choices[i].begin(), choices[i].end(), 0);
    } else {
      const auto& names = axes_[i].values;
      const auto found = std::find(names.begin(), names.end(), instance[i]);
      if (found == names.end()) {
        throw ModelError(element_ + ": instance '" + join(instance, " ") + "': '" + instance[i] +
                         "' is no value of " + axes_[i].name + " (" + join(names, ", ") + ")");
      }
      choices[i].push_back(static_cast<int>(found - names.begin()));
    }
  }
  const auto values = expand(instance, table, listed);
  refuseConflict(instance, values);
  store(choices, listed, values);
}

std::vector<double> Factor::expand(const Tokens& instance, const Tokens& table,
                                   const std::vector<size_t>& listed) const {
  if (table.size() == 1 && table[0] == "uniform") return uniform(listed);
  if (table.size() == 1 && table[0] == "identity") return identity(listed);
  const size_t wanted = count(listed);
  std::vector<double> values;
  std::vector<size_t> digits(listed.size(), 0);
  std::vector<size_t> radix;
  for (size_t axis : listed) radix.push_back(size(axis));
  for (size_t i = 0; i < std::min(table.size(), wanted); ++i) {
    values.push_back(number(table[i], [&] {
      Tokens row = instance;
      for (size_t j = 0; j < listed.size(); ++j) {
        row[listed[j]] = axes_[listed[j]].values[digits[j]];
      }
      return place(row);
    }));
    advance(digits, radix);
  }
  if (table.size() != wanted) {
    throw ModelError(place(instance) + ": entry '" + join(instance, " ") + "' has " +
                     std::to_string(table.size()) + " numbers, expected " + std::to_string(wanted));
  }
  return values;
}

std::vector<double> Factor::uniform(const std::vector<size_t>& listed) const {
  if (listed.empty() || listed.back() != axes_.size() - 1) {
    throw ModelError(element_ + ": 'uniform' needs '-' as the last token of its instance");
  }
  return std::vector<double>(count(listed), 1.0 / static_cast<double>(size(listed.back())));
}

std::vector<double> Factor::identity(const std::vector<size_t>& listed) const {
  if (listed.size() != 2 || size(listed[0]) != size(listed[1])) {
    throw ModelError(element_ + ": 'identity' needs two '-' of equal size in its instance");
  }
  const size_t n = size(listed[0]);
  std::vector<double> values(n * n, 0.0);
  for (size_t i = 0; i < n; ++i) values[i * n + i] = 1.0;
  return values;
}

void Factor::refuseConflict(const Tokens& instance, const std::vector<double>& values) {
  const auto [known, fresh] = seen_.emplace(join(instance, " "), values);
  if (fresh || known->second == values) return;
  throw ModelError(place(instance) + ": entry '" + known->first +
                   "' is given twice with different values");
}

void Factor::store(const std::vector<std::vector<int>>& choices, const std::vector<size_t>& listed,
                   const std::vector<double>& values) {
  std::vector<size_t> digits(axes_.size(), 0);
  std::vector<size_t> radix;
  for (const auto& options : choices) radix.push_back(options.size());
  do {
    size_t target = 0;
    size_t source = 0;
    for (size_t i = 0; i < axes_.size(); ++i) {
      target += static_cast<size_t>(choices[i][digits[i]]) * strides_[i];
    }
    for (size_t axis : listed) source = source * size(axis) + digits[axis];
    values_[target] = values[source];
    given_[target] = true;
  } while (advance(digits, radix));
}

void Factor::checkRows(bool normalise) {
  const size_t width = size(axes_.size() - 1);
  std::vector<size_t> digits(axes_.size(), 0);
  std::vector<size_t> radix;
  for (const auto& axis : axes_) radix.push_back(axis.values.size());
  radix.back() = 1;
  for (size_t start = 0; start < values_.size(); start += width, advance(digits, radix)) {
    Tokens row;
    for (size_t i = 0; i < axes_.size(); ++i) row.push_back(axes_[i].values[digits[i]]);
    double sum = 0.0;
    for (size_t i = start; i < start + width; ++i) {
      if (values_[i] < 0.0 || values_[i] > 1.0 + ROW_TOLERANCE) {
        throw ModelError(place(row) + " column " + axes_.back().values[i - start] + " is " +
                         text(values_[i]) + ", not a probability");
      }
      sum += values_[i];
    }
    if (std::none_of(given_.begin() + static_cast<std::ptrdiff_t>(start),
                     given_.begin() + static_cast<std::ptrdiff_t>(start + width),
                     [](bool given) { return given; })) {
      throw ModelError(place(row) + " has no entry");
    }
    if (std::abs(sum - 1.0) > ROW_TOLERANCE && !(normalise && sum > 0.0)) {
      throw ModelError(place(row) + " sums to " + text(sum) + ", not 1");
    }
    if (normalise) {
      for (size_t i = start; i < start + width; ++i) values_[i] /= sum;
    }
  }
}

double Factor::at(const Assignment& assignment) const {
  size_t index = 0;
  for (size_t i = 0; i < axes_.size(); ++i) {
    const auto& group = assignment[static_cast<size_t>(axes_[i].role)];
    index += static_cast<size_t>(group[static_cast<size_t>(axes_[i].variable)]) * strides_[i];
  }
  return values_[index];
}

bool Factor::dependsOn(Role role) const {
  return std::any_of(axes_.begin(), axes_.end(), [role](const Axis& a) { return a.role == role; });
}

std::string Factor::place(const Tokens& tokens) const {
  Tokens actions;
  Tokens row;
  const size_t row_axes = element_ == "R" ? axes_.size() : axes_.size() - 1;
  for (size_t i = 0; i < row_axes; ++i) {
    (axes_[i].role == Role::ACTION ? actions : row).push_back(tokens[i]);
  }
  return element_ + (actions.empty() ? "" : "[" + join(actions, ",") + "]") +
         (row.empty() ? "" : " row " + join(row, "/"));
}

}  // namespace fabric::planner
