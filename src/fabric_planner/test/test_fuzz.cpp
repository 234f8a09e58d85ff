// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>

#include "../fuzz/targets.hpp"

namespace fabric::planner {
namespace {

using Read = std::function<bool(const std::string&)>;

/// The files of a fuzzer's corpus, by name.
std::vector<std::string> corpus(const std::string& name) {
  std::vector<std::filesystem::path> paths;
  for (const auto& file :
       std::filesystem::directory_iterator(std::string(PACKAGE_DIR) + "/fuzz/corpus/" + name)) {
    paths.push_back(file.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> texts;
  for (const auto& path : paths) {
    std::ostringstream bytes;
    bytes << std::ifstream(path, std::ios::binary).rdbuf();
    texts.push_back(bytes.str());
  }
  return texts;
}

/// A few small changes: a byte, a piece taken out, doubled or moved, a word that means something.
std::string mutated(std::string text, const std::vector<std::string>& words, std::mt19937& random) {
  const auto below = [&](size_t n) { return n == 0 ? 0 : random() % n; };
  const size_t changes = 1 + below(4);
  for (size_t i = 0; i < changes; ++i) {
    const size_t at = below(text.size());
    const size_t length = std::min(1 + below(24), text.size() - at);
    switch (below(5)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(below(text.size() + 1), text.substr(at, length));
        break;
      case 3:
        text.replace(at, length, words[below(words.size())]);
        break;
      default:
        text.insert(at, words[below(words.size())]);
    }
  }
  return text;
}

/// All of the corpus is accepted, and of its mutants some are and some are not.
void expectSturdy(const std::string& name, const std::vector<std::string>& words,
                  const Read& read) {
  const auto texts = corpus(name);
  ASSERT_FALSE(texts.empty());
  for (const auto& text : texts) EXPECT_TRUE(read(text)) << text;
  std::mt19937 random(11);
  int accepted = 0;
  constexpr int MUTANTS = 4000;
  for (int i = 0; i < MUTANTS; ++i) {
    accepted += read(mutated(texts[random() % texts.size()], words, random)) ? 1 : 0;
  }
  EXPECT_GT(accepted, 10);
  EXPECT_LT(accepted, MUTANTS / 2);
}

TEST(Fuzz, PomdpxReaderSurvivesDamagedFiles) {
  expectSturdy(
      "pomdpx",
      {"*", "-", "1e308", "nan", "uniform", "identity", "<DAG>", "</Node>", "-->", "s0",
       "<NumValues>9</NumValues>", "type='DD'", " "},
      [](const std::string& text) { return fuzzing::readPomdpx(text, text.size() % 2 == 0); });
}

TEST(Fuzz, PomdpReaderSurvivesDamagedFiles) {
  expectSturdy(
      "pomdp",
      {"*", ":", "T:", "O:", "R:", "uniform", "reset", "identity", "1e308", "nan", "#", "\n",
       "states: 40", "start exclude:", "0.5 "},
      [](const std::string& text) { return fuzzing::readPomdp(text, text.size() % 2 == 0); });
}

TEST(Fuzz, PolicyReaderSurvivesDamagedFiles) {
  const Pomdp model = fuzzing::policyModel();
  expectSturdy("policy",
               {"<Vector action='1' obsValue='2'>1 2</Vector>", "<Entry>0 1</Entry>", "2147483647",
                "nan", "-->", "numVectors='1'", "'", " "},
               [&](const std::string& text) { return fuzzing::readPolicy(text, model); });
}

}  // namespace
}  // namespace fabric::planner
