// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace fabric::planner {

/// Bits that look random, one word for one word (the finaliser of SplitMix64, Steele et al. 2014).
inline std::uint64_t mixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// The upper 53 bits of a word as a number in [0, 1).
inline double toUniform(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }

/// A stream of random numbers: SplitMix64. The same seed gives the same stream on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(mixBits(seed + STEP)) {}
  /// The stream that belongs to u: a model that needs several random numbers in one step takes
  /// them from here, so that the step stays a function of (state, action, u).
  static Random of(double u) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &u, sizeof(bits));
    return Random(bits);
  }
  /// An independent stream, named by a number; this one does not move.
  [[nodiscard]] Random child(std::uint64_t name) const {
    return Random(state_ ^ mixBits(name * STEP + 1));
  }

  /// 64 random bits.
  std::uint64_t bits() { return mixBits(state_ += STEP); }
  /// Uniform in [0, 1).
  double uniform() { return toUniform(bits()); }
  /// Uniform in {0, .., n - 1}; n in [1, 2^32].
  int below(int n) {
    return static_cast<int>(((bits() >> 32) * static_cast<std::uint64_t>(n)) >> 32);
  }
  /// Standard normal (Box & Muller 1958); takes two uniforms.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  }

 private:
  static constexpr std::uint64_t STEP = 0x9e3779b97f4a7c15ULL;
  std::uint64_t state_;
};

}  // namespace fabric::planner
