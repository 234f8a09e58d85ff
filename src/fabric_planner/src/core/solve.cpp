// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/solve.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>

#include "lower_solver.hpp"
#include "solver_model.hpp"
#include "text.hpp"
#include "upper_solver.hpp"

namespace fabric::planner {
namespace {

constexpr int PATIENCE = 8;         // fruitless steps after which the lower bound has to wait
constexpr double FRUITFUL = 1e-4;   // share of the gap that a step has to close
constexpr double FIRST_WORK = 4e7;  // for the lower bound before the upper one begins

double threadTime() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void check(const SolveOptions& options) {
  const auto need = [](bool good, const char* name, double value, const char* expected) {
    if (good) return;
    throw ModelError(std::string("solve option ") + name + " is " + text(value) + ", expected " +
                     expected);
  };
  need(options.time > 0.0, "time", options.time, "a number above 0");
  need(options.work > 0.0, "work", options.work, "a number above 0");
  need(options.gap >= 0.0, "gap", options.gap, "a number not below 0");
  need(options.beliefs > 0, "beliefs", options.beliefs, "at least 1");
  need(options.points > 0, "points", options.points, "at least 1");
  need(options.query_points >= 0, "query_points", options.query_points, "at least 0");
  need(options.lower_share >= 0.0 && options.lower_share <= 1.0, "lower_share", options.lower_share,
       "a share from 0 to 1");
}

class Solver {
 public:
  Solver(const Pomdp& pomdp, const SolveOptions& options)
      : options_(options),
        model_(pomdp),
        lower_(model_, options.seed),
        upper_(model_, fastInformedBound(pomdp), options.seed) {
    lower_options_.beliefs = options.beliefs;
  }

  void run() {
    note();
    while (goesOn()) {
      const double work_before = work();
      const double gap_before = gap();
      const bool lower = lowerIsNext();
      if (lower) {
        stepLower();
      } else {
        stepUpper();
      }
      note();
      double& rate = lower ? lower_rate_ : upper_rate_;
      rate = 0.5 * (rate + (gap_before - gap()) / std::max(1.0, work() - work_before));
    }
  }

  Solution solution() && {
    return {lower_.bound(), upper_.bound(options_.query_points), std::move(history_)};
  }

 private:
  [[nodiscard]] double work() const { return lower_.work() + upper_.work(); }

  [[nodiscard]] bool goesOn() const {
    if (!lower_left_ && !upper_left_) return false;
    const double open = std::min(upper_.root(), history_.back().upper) - history_.back().lower;
    return open > options_.gap && work() < options_.work && threadTime() - begin_ < options_.time;
  }

  /// The beliefs of the optimist's last trial are tried too: the own policy alone meets only what
  /// it knows already.
  void stepLower() {
    int added = 0;
    for (const SparseBelief& belief : upper_.path()) {
      if (static_cast<int>(lower_.beliefs().size()) >= options_.beliefs) break;
      if (lower_.addBelief(belief)) ++added;
    }
    const double before = lower_.root();
    const bool moved = lower_.step(lower_options_) || added > 0;
    fruitless_ = lower_.root() - before > FRUITFUL * gap() ? 0 : fruitless_ + 1;
    lower_left_ = moved || fruitless_ < PATIENCE;
    if (fruitless_ == 0) upper_left_ = true;
  }

  /// Where the one bound moves, the other may find something again.
  void stepUpper() {
    upper_left_ = upper_.round(lower_.vectors(), options_.points, [this] { return goesOn(); });
    if (upper_left_) lower_left_ = true;
  }

  [[nodiscard]] double gap() const { return history_.back().upper - history_.back().lower; }

  /// The lower bound has its share, and as much again while it closes the gap faster.
  [[nodiscard]] bool lowerIsNext() const {
    if (!lower_left_ || !upper_left_) return lower_left_;
    const double share = options_.lower_share * (lower_rate_ > upper_rate_ ? 2.0 : 1.0);
    const double first = fruitless_ < PATIENCE ? FIRST_WORK : 0.0;
    return lower_.work() < std::max(first, share * work());
  }

  void note() {
    SolveProgress now{threadTime() - begin_, work(), lower_.root(), upper_.root()};
    if (!history_.empty()) {
      now.lower = std::max(now.lower, history_.back().lower);
      now.upper = std::min(now.upper, history_.back().upper);
    }
    history_.push_back(now);
    if (options_.progress) options_.progress(now);
  }

  double begin_ = threadTime();
  SolveOptions options_;
  PointBasedOptions lower_options_;
  SolverModel model_;
  LowerSolver lower_;
  UpperSolver upper_;
  double lower_rate_ = 0.0;  ///< gap closed for each multiplication of late
  double upper_rate_ = 0.0;
  int fruitless_ = 0;  ///< steps of the lower bound in a row that gained nothing
  bool lower_left_ = true;
  bool upper_left_ = true;
  std::vector<SolveProgress> history_;
};

/// Where every observation tells the state, the MDP's values are the answer.
Solution stateSeen(const Pomdp& model) {
  AlphaVectors lower = pointBasedBound(model);
  PointUpperBound upper(fastInformedBound(model));
  const double least = lower.value(model.initialBelief());
  const double most = std::max(least, upper.value(model.initialBelief()));
  return {std::move(lower), std::move(upper), {{0.0, 0.0, least, most}}};
}

}  // namespace

Solution solve(const Pomdp& model, const SolveOptions& options) {
  check(options);
  if (model.fullyObservable()) {
    Solution solution = stateSeen(model);
    if (options.progress) options.progress(solution.history.back());
    return solution;
  }
  Solver solver(model, options);
  solver.run();
  return std::move(solver).solution();
}

}  // namespace fabric::planner
