// SPDX-License-Identifier: MIT
#pragma once

/// A queue of plain values between one writer and one reader, each in its own context (an interrupt and the
/// loop). Neither blocks or masks interrupts.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace cbcan::boards {

/// `kSize` places, a power of two.
template <class Item, std::size_t kSize>
class Ring {
  static_assert((kSize & (kSize - 1)) == 0, "a power of two");

 public:
  // The writer's side.

  /// False when full: the item is dropped and counted.
  bool push(const Item& item) {
    if (free() == 0) {
      overflows_.store(overflows_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    const std::uint32_t end = end_.load(std::memory_order_relaxed);
    items_[end % kSize] = item;
    end_.store(end + 1, std::memory_order_release);
    return true;
  }
  /// Free places; the reader can only increase it.
  std::size_t free() const { return kSize - used(); }

  // The reader's side.

  bool pop(Item& item) {
    const std::uint32_t begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return false;
    item = items_[begin % kSize];
    begin_.store(begin + 1, std::memory_order_release);
    return true;
  }

  // Either side.

  bool empty() const { return used() == 0; }
  /// Number of items that push() dropped.
  std::uint32_t overflows() const { return overflows_.load(std::memory_order_relaxed); }

 private:
  std::size_t used() const {
    return end_.load(std::memory_order_acquire) - begin_.load(std::memory_order_acquire);
  }

  std::array<Item, kSize> items_;
  std::atomic<std::uint32_t> begin_{0};
  std::atomic<std::uint32_t> end_{0};
  std::atomic<std::uint32_t> overflows_{0};
};

}  // namespace cbcan::boards
