// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

/// Compiles a hot function for several instruction sets; the machine picks the best at load time.
/// Left out where the loader's choice is not available (other compilers), comes before the
/// sanitizers are ready, or nothing is optimised.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__linux__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__) && defined(__OPTIMIZE__)
#define FABRIC_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define FABRIC_CLONES
#endif

namespace fabric::planner {

/// Eight numbers that are computed with at once. Sums run over the same lanes in the same order
/// whatever the machine's registers hold, so that results are the same bits everywhere.
inline constexpr int LANES = 8;
using Lanes = double __attribute__((vector_size(LANES * sizeof(double)), aligned(8), may_alias));

/// The next multiple of LANES.
inline constexpr int padded(int count) { return (count + LANES - 1) / LANES * LANES; }

/// Memory that is neither set nor touched when it is made, so that reserving much costs nothing.
template <class T>
class AlignedArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size)
      : data_(static_cast<T*>(::operator new(size * sizeof(T) + 1, ALIGNMENT))) {}

  T& operator[](std::size_t i) { return data_.get()[i]; }
  const T& operator[](std::size_t i) const { return data_.get()[i]; }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }

 private:
  static constexpr std::align_val_t ALIGNMENT{64};
  struct Free {
    void operator()(T* data) const { ::operator delete(data, ALIGNMENT); }
  };
  std::unique_ptr<T, Free> data_;
};

}  // namespace fabric::planner
