// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>

namespace fabric::planner {

/// One block of memory, handed out from its start and taken back all at once. Nothing is
/// constructed or destroyed; pages that were never handed out take no memory.
class Arena {
 public:
  explicit Arena(std::size_t bytes) : block_(new std::byte[bytes]), size_(bytes) {}

  /// Room for `count` objects without values; nullptr when there is no room left.
  template <class T>
  T* take(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>,
                  "an arena holds plain data");
    static_assert(alignof(T) <= alignof(std::max_align_t), "alignment is not supported");
    const std::size_t start = (used_ + alignof(T) - 1) / alignof(T) * alignof(T);
    const std::size_t end = start + count * sizeof(T);
    if (end > size_) return nullptr;
    used_ = end;
    return reinterpret_cast<T*>(block_.get() + start);
  }

  /// A place to return to by release(), which takes back all that came after it.
  [[nodiscard]] std::size_t mark() const { return used_; }
  void release(std::size_t mark) { used_ = mark; }
  [[nodiscard]] std::size_t used() const { return used_; }

 private:
  std::unique_ptr<std::byte[]> block_;
  std::size_t size_;
  std::size_t used_ = 0;
};

}  // namespace fabric::planner
