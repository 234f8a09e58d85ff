// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/pomdp_file.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "factored_model.hpp"
#include "file.hpp"
#include "pomdp_lexer.hpp"
#include "text.hpp"

namespace fabric::planner {
namespace {

using Token = PomdpLexer::Token;
using Names = std::vector<std::string>;

[[noreturn]] void refuse(int line, const std::string& what) {
  throw ModelError("line " + std::to_string(line) + ": " + what);
}

std::string quoted(const Token& token) {
  return token.text.empty() ? "the end of the file" : "'" + std::string(token.text) + "'";
}

std::optional<int> wholeNumber(std::string_view text) {
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// One of T, O and R while it is being filled.
struct Table {
  std::string letter;
  Factor factor;
  size_t fewest;  ///< axes an entry must name; the others are listed
  std::vector<std::pair<int, Picks>> said = {};
};

/// Reads one .pomdp file into a FactoredModel.
class Reader {
 public:
  Reader(std::string_view bytes, bool normalise, const FileLimits& limits)
      : lexer_(bytes), normalise_(normalise), limits_(limits) {}

  FactoredModel run() {
    while (!lexer_.atEnd()) {
      const auto& word = lexer_.peek().text;
      if (!lexer_.atHeader()) {
        refuse(lexer_.peek().line, "expected a keyword and ':', not " + quoted(lexer_.peek()));
      }
      if (word == "T" || word == "O" || word == "R") {
        beginTables();
        readEntry(word[0]);
      } else {
        readPreamble();
      }
    }
    beginTables();
    finish();
    return std::move(model_);
  }

 private:
  void readPreamble() {
    const Token keyword = lexer_.take();
    const std::string word(keyword.text);
    if (!tables_.empty()) refuse(keyword.line, word + ": must come before the first T, O or R");
    if (!known_.emplace(word, keyword.line).second) {
      refuse(keyword.line,
             word + ": given twice, first in line " + std::to_string(known_.at(word)));
    }
    if (word == "start") return readStart(keyword.line);
    lexer_.take();  // the colon
    if (word == "discount") {
      const auto place = [&] { return "line " + std::to_string(keyword.line) + ": discount"; };
      model_.discount = number(lexer_.take().text, place);
    } else if (word == "values") {
      const Token kind = lexer_.take();
      if (kind.text != "reward" && kind.text != "cost") {
        refuse(kind.line, "values: " + quoted(kind) + " is neither reward nor cost");
      }
      sign_ = kind.text == "cost" ? -1.0 : 1.0;
    } else {
      domains_[word] = readNames(word);
    }
  }

  std::shared_ptr<const Domain> readNames(const std::string& kind) {
    const int line = lexer_.peek().line;
    Names names;
    while (!lexer_.atEnd() && !lexer_.atHeader()) {
      const Token token = lexer_.take();
      if (token.text == ":" || token.text == "*") {
        refuse(token.line, kind + ": " + quoted(token) + " is not a name");
      }
      names.emplace_back(token.text);
      if (names.size() > limits_.values) refuse(line, kind + ": too many names");
    }
    const auto count = names.size() == 1 ? wholeNumber(names[0]) : std::nullopt;
    if (count) names = numbered(line, kind, *count);
    if (names.empty()) refuse(line, kind + ": neither a count nor a name");
    auto domain = std::make_shared<const Domain>(names);
    for (size_t i = 0; i < names.size(); ++i) {
      if (!count && wholeNumber(names[i])) {
        refuse(line, kind + ": a number, '" + names[i] + "', cannot be a name");
      }
      if (domain->find(names[i]) != static_cast<int>(i)) {
        refuse(line, kind + ": '" + names[i] + "' is named twice");
      }
    }
    return domain;
  }

  [[nodiscard]] Names numbered(int line, const std::string& kind, int count) const {
    if (count < 1 || static_cast<size_t>(count) > limits_.values) {
      refuse(line, kind + ": " + std::to_string(count) + " is not a count in 1.." +
                       std::to_string(limits_.values));
    }
    Names names;
    for (int i = 0; i < count; ++i) names.push_back(std::to_string(i));
    return names;
  }

  const Domain& domain(const std::string& kind) const {
    const auto found = domains_.find(kind);
    if (found == domains_.end()) {
      refuse(lexer_.peek().line, kind + ": missing before this line");
    }
    return *found->second;
  }

  void readStart(int line) {
    const auto& states = domain("states");
    std::string how;
    if (lexer_.peek().text != ":") how = lexer_.take().text;
    lexer_.take();  // the colon
    std::vector<Token> tokens;
    while (!lexer_.atEnd() && !lexer_.atHeader()) tokens.push_back(lexer_.take());
    if (tokens.empty()) refuse(line, "start: nothing is given");
    const auto size = static_cast<size_t>(states.size());
    start_.assign(size, 0.0);
    if (!how.empty()) return startAmong(tokens, how == "include");
    const bool one = tokens.size() == 1;
    if (one && tokens[0].text == "uniform") {
      start_.assign(size, 1.0 / static_cast<double>(size));
    } else if (one && states.find(tokens[0].text) >= 0) {
      start_[static_cast<size_t>(states.find(tokens[0].text))] = 1.0;
    } else if (one && size > 1) {
      refuse(tokens[0].line, "start: " + quoted(tokens[0]) + " is no state");
    } else {
      startFrom(tokens);
    }
  }

  void startFrom(const std::vector<Token>& tokens) {
    if (tokens.size() != start_.size()) {
      refuse(tokens[0].line, "start: " + std::to_string(tokens.size()) + " numbers, expected " +
                                 std::to_string(start_.size()));
    }
    for (size_t i = 0; i < tokens.size(); ++i) {
      start_[i] = number(tokens[i].text, [&] {
        return "line " + std::to_string(tokens[i].line) + ": start column " +
               domain("states").names()[i];
      });
    }
  }

  void startAmong(const std::vector<Token>& tokens, bool include) {
    std::vector<bool> named(start_.size(), false);
    for (const auto& token : tokens) {
      const int state = domain("states").find(token.text);
      if (state < 0) refuse(token.line, "start: " + quoted(token) + " is no state");
      named[static_cast<size_t>(state)] = true;
    }
    const auto count = std::count(named.begin(), named.end(), include);
    if (count == 0) refuse(tokens[0].line, "start: no state is left");
    for (size_t i = 0; i < named.size(); ++i) {
      if (named[i] == include) start_[i] = 1.0 / static_cast<double>(count);
    }
  }

  /// With the first of T, O and R the names are complete.
  void beginTables() {
    if (!tables_.empty()) return;
    for (const char* word : {"discount", "values", "states", "actions"}) {
      if (known_.count(word) == 0) {
        refuse(lexer_.peek().line, std::string(word) + ": missing before this line");
      }
    }
    const bool mdp = known_.count("observations") == 0;
    const auto states = domains_.at("states");
    model_.actions = {{"action", "", domains_.at("actions"), false}};
    model_.states = {{"state_1", "state_0", states, mdp}};
    const Axis action{Role::ACTION, 0, "action", domains_.at("actions")};
    const Axis from{Role::PREVIOUS, 0, "state_0", states};
    const Axis to{Role::CURRENT, 0, "state_1", states};
    add('T', {action, from, to}, 1, 1);
    if (mdp) return add('R', {action, from, to}, 0, 1);
    model_.observations = {{"observation", "", domains_.at("observations"), false}};
    const Axis seen{Role::OBSERVATION, 0, "observation", domains_.at("observations")};
    add('O', {action, to, seen}, 1, 1);
    add('R', {action, from, to, seen}, 0, 2);
  }

  void add(char letter, std::vector<Axis> axes, size_t children, size_t fewest) {
    const std::string name(1, letter);
    tables_.emplace(letter,
                    Table{name, Factor(name, std::move(axes), children, limits_.entries), fewest});
  }

  Table& tableOf(char letter, int line) {
    const auto found = tables_.find(letter);
    if (found == tables_.end()) refuse(line, "O, but no observations");
    return found->second;
  }

  /// "T: a : s : s' p" and its shorter forms, of which the axes left out are listed.
  void readEntry(char letter) {
    const int line = lexer_.take().line;
    Table& table = tableOf(letter, line);
    const auto& axes = table.factor.axes();
    Picks picks;
    while (lexer_.takeIf(":")) {
      const Token token = lexer_.take();
      if (picks.size() == axes.size()) {
        refuse(token.line, table.letter + ": " + quoted(token) + " is one ':' too many");
      }
      const auto& axis = axes[picks.size()];
      picks.push_back(token.text == "*" ? int{ALL} : axis.domain->find(token.text));
      if (token.text != "*" && picks.back() < 0) {
        refuse(token.line, table.letter + ": " + quoted(token) + " is no " + kindOf(axis));
      }
    }
    if (picks.size() < table.fewest) {
      refuse(line, table.letter + ": needs at least " + std::to_string(table.fewest) +
                       " names with ':' before its numbers");
    }
    picks.resize(axes.size(), LISTED);
    table.said.emplace_back(line, picks);
    readBody(table, std::move(picks), line);
  }

  static std::string kindOf(const Axis& axis) {
    return axis.role == Role::ACTION ? "action"
                                     : (axis.role == Role::OBSERVATION ? "observation" : "state");
  }

  void readBody(Table& table, Picks picks, int line) {
    const auto listed = std::count(picks.begin(), picks.end(), int{LISTED});
    const bool rows = table.letter != "R" && listed > 0;
    if (rows && lexer_.takeIf("uniform")) {
      std::replace(picks.begin(), picks.end(), int{LISTED}, int{ALL});
      assign(table, picks, {1.0 / table.factor.axes().back().domain->size()}, line);
    } else if (rows && table.letter == "T" && lexer_.takeIf("reset")) {
      picks[1] = picks[1] == LISTED ? int{ALL} : picks[1];
      assign(table, picks, startOrUniform(), line);
    } else if (listed == 2 && table.letter == "T" && lexer_.takeIf("identity")) {
      table.factor.assignIdentity(picks, 1, 2);
    } else {
      assign(table, picks, readNumbers(table, picks, line), line);
    }
  }

  void assign(Table& table, const Picks& picks, const std::vector<double>& values, int line) {
    try {
      table.factor.assign(picks, values);
    } catch (const ModelError& error) {
      refuse(line, error.what());
    }
  }

  std::vector<double> readNumbers(const Table& table, const Picks& picks, int line) {
    double wanted = 1.0;
    for (size_t i = 0; i < picks.size(); ++i) {
      if (picks[i] == LISTED) wanted *= table.factor.axes()[i].domain->size();
    }
    std::vector<double> values;
    const double sign = table.letter == "R" ? sign_ : 1.0;
    while (static_cast<double>(values.size()) < wanted) {
      if (lexer_.atEnd() || lexer_.atHeader()) {
        refuse(lexer_.peek().line, place(table, picks, values.size()) + ": " +
                                       std::to_string(values.size()) + " numbers, expected " +
                                       text(wanted));
      }
      const Token token = lexer_.take();
      const auto where = [&] {
        return "line " + std::to_string(token.line) + ": " + place(table, picks, values.size());
      };
      values.push_back(sign * number(token.text, where) + 0.0);
    }
    if (!lexer_.atEnd() && !lexer_.atHeader()) {
      refuse(lexer_.peek().line, place(table, picks, 0) + ": " + quoted(lexer_.peek()) +
                                     " after the " + text(wanted) + " numbers begun in line " +
                                     std::to_string(line));
    }
    return values;
  }

  static std::string place(const Table& table, const Picks& picks, size_t index) {
    Names tokens(picks.size());
    for (size_t i = picks.size(); i-- > 0;) {
      const auto& names = table.factor.axes()[i].domain->names();
      if (picks[i] == LISTED) {
        tokens[i] = names[index % names.size()];
        index /= names.size();
      } else {
        tokens[i] = picks[i] == ALL ? "*" : names[static_cast<size_t>(picks[i])];
      }
    }
    return table.factor.place(tokens);
  }

  std::vector<double> startOrUniform() const {
    if (!start_.empty()) return start_;
    const auto size = static_cast<size_t>(domain("states").size());
    return std::vector<double>(size, 1.0 / static_cast<double>(size));
  }

  void finish() {
    const auto& state = model_.states[0];
    Factor initial("start", {Axis{Role::PREVIOUS, 0, state.previous, state.domain}}, 1,
                   limits_.entries);
    initial.assign({LISTED}, startOrUniform());
    try {
      initial.checkRows(normalise_);
    } catch (const ModelError& error) {
      refuse(known_.at("start"), error.what());
    }
    model_.initial.push_back(std::move(initial));
    for (const char letter : {'T', 'O', 'R'}) {
      const auto found = tables_.find(letter);
      if (found == tables_.end()) continue;
      if (letter != 'R') checkRows(found->second);
      auto& target = letter == 'T'   ? model_.transition
                     : letter == 'O' ? model_.observation
                                     : model_.reward;
      target.push_back(std::move(found->second.factor));
    }
  }

  /// The line named is that of the last entry that spoke of the row.
  void checkRows(Table& table) const {
    try {
      table.factor.checkRows(normalise_);
    } catch (const RowError& error) {
      const auto speaks = [&](const auto& entry) {
        return std::equal(error.row().begin(), error.row().end(), entry.second.begin(),
                          [](int value, int pick) { return pick < 0 || pick == value; });
      };
      const auto last = std::find_if(table.said.rbegin(), table.said.rend(), speaks);
      if (last == table.said.rend()) throw;
      refuse(last->first, error.what());
    }
  }

  PomdpLexer lexer_;
  bool normalise_;
  const FileLimits& limits_;
  FactoredModel model_;
  double sign_ = 1.0;
  std::vector<double> start_;  // empty: not given
  std::map<std::string, int> known_;
  std::map<std::string, std::shared_ptr<const Domain>> domains_;
  std::map<char, Table> tables_;
};

}  // namespace

Pomdp parsePomdpFile(std::string_view bytes, const std::string& name, bool normalise,
                     const FileLimits& limits) {
  FactoredModel model = Reader(bytes, normalise, limits).run();
  model.name = name;
  return Pomdp(flatten(model, limits));
}

Pomdp loadPomdpFile(const std::string& path, bool normalise) {
  return loadWith(path, [&](const std::string& bytes, const std::string& name) {
    return parsePomdpFile(bytes, name, normalise);
  });
}

}  // namespace fabric::planner
