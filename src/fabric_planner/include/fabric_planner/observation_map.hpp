// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fabric_planner/features.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// From the booleans of an observation to the symbols of one model.
///
/// The map is a YAML list of rules; the first rule whose conditions all hold decides, and the last
/// rule has none, so that the map is total:
///
///     initial: idle                     # the symbol before the first; needed with `previous`
///     rules:
///       - {when: {warning: true}, symbol: warning}
///       - {when: {failed_attempts: {at_least: 1}, previous: idle}, symbol: stuck}
///       - {symbol: idle}
///
/// Conditions are the booleans of fabric_msgs/Observation by name, thresholds (`at_least`,
/// `below`) on subtask_elapsed, waiting_time and failed_attempts, and `previous`: a symbol or a
/// list of symbols, one of which came before.
class ObservationMap {
 public:
  /// Reads the map of a model with these observation symbols.
  /// @throw ModelError naming file, rule and entry: unknown fields or symbols, bad values,
  ///        rules that can never be reached, maps that are not total.
  static ObservationMap load(const std::string& path, const std::vector<std::string>& observations);

  /// As load, from text; `name` begins every error message.
  static ObservationMap parse(const std::string& text, const std::string& name,
                              const std::vector<std::string>& observations);

  /// Index of the symbol for these features after the symbol `previous` (none: `initial`).
  /// @throw std::out_of_range when `previous` is no symbol of the model.
  [[nodiscard]] int symbol(const Features& features,
                           std::optional<int> previous = std::nullopt) const;

  [[nodiscard]] const std::vector<std::string>& observations() const { return observations_; }

  struct Flag {
    bool Features::*field;
    bool wanted;
  };
  struct Threshold {
    double Features::*field;
    std::optional<double> at_least;
    std::optional<double> below;
  };
  struct Rule {
    std::vector<Flag> flags;
    std::vector<Threshold> thresholds;
    std::vector<int> previous;  ///< any of these; empty: whatever came before
    int symbol = 0;

    [[nodiscard]] bool unconditional() const {
      return flags.empty() && thresholds.empty() && previous.empty();
    }
    [[nodiscard]] bool holds(const Features& features, int before) const;
  };

 private:
  ObservationMap(std::vector<std::string> observations, std::vector<Rule> rules, int initial);

  std::vector<std::string> observations_;
  std::vector<Rule> rules_;
  int initial_;
};

}  // namespace fabric::planner
