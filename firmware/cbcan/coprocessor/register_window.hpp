// SPDX-License-Identifier: MIT
#pragma once

/// Memory that the core shares with the PLC's side: the 70 words of the window, and process data.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/configuration.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan {

/// R3700..R3769 as the core sees them: ordinary memory that an interrupt, a thread or another processor also
/// writes.
///
/// Ordering: every word written through words() is visible to a reader that has seen the result which
/// finish() wrote; every word that the PLC wrote before CA0Eh is seen once flag() has returned CA0Eh. In
/// between they are the core's. Words are in host byte order. The memory is the caller's and must outlive
/// this view.
class RegisterWindow {
 public:
  using Words = std::span<std::uint16_t, regmap::kWindowWords>;

  /// None: to be asked nothing.
  RegisterWindow() = default;
  explicit RegisterWindow(Words words) : words_(words.data()) {}

  std::uint16_t flag() const { return atomic_flag().load(std::memory_order_acquire); }

  /// R3700 on.
  std::uint16_t* words() const { return words_; }

  /// Replaces CA0Eh by the result, after everything set before. Where the PLC has written something else
  /// meanwhile, that stays and the response is false: the transaction was cancelled at the last moment.
  /// A processor without compare-and-swap (Cortex-M0+) loads and stores: there an interrupt that writes R3700
  /// is masked while the core is called.
  bool finish(regmap::Result result) const {
    std::uint16_t expected = regmap::kExecute;
    if constexpr (!std::atomic_ref<std::uint16_t>::is_always_lock_free) {
      const bool unchanged = flag() == expected;
      if (unchanged) atomic_flag().store(static_cast<std::uint16_t>(result), std::memory_order_release);
      return unchanged;
    } else {
      return atomic_flag().compare_exchange_strong(expected, static_cast<std::uint16_t>(result),
                                                   std::memory_order_release, std::memory_order_relaxed);
    }
  }

 private:
  std::atomic_ref<std::uint16_t> atomic_flag() const { return std::atomic_ref<std::uint16_t>(words_[0]); }

  std::uint16_t* words_ = nullptr;
};

// Words that a build without process data, or without the scanner window, needs no memory for.
inline constexpr std::size_t kProcessWords = kServices.process_data() ? regmap::kProcessWords : 0;
inline constexpr std::size_t kOutputWords = kServices.process_data() ? regmap::kOutputWords : 0;
inline constexpr std::size_t kScannerOutWords = kServices.scanner_window ? regmap::kScannerOutWords : 0;
inline constexpr std::size_t kScannerInWords = kServices.scanner_window ? regmap::kScannerInWords : 0;

/// R3800..R3927, or wherever the range has been put: inputs, then outputs. The core writes and reads them
/// inside its own calls only, so whoever serves Modbus from the same place sees a PDO whole. The memory is
/// the caller's.
using ProcessRegisters = std::span<std::uint16_t, kProcessWords>;

}  // namespace cbcan
