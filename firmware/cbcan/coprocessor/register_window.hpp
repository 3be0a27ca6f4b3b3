// SPDX-License-Identifier: MIT
#pragma once

/// Memory that the core shares with the Modbus side: the 70 words of the window, and process data.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/configuration.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan {

/// The core's view of R3700..R3769: ordinary memory that an interrupt, a thread or another processor also
/// writes.
///
/// Ordering: every word written through words() is visible to a reader that has seen the result which
/// finish() wrote; every word that the PLC wrote before CA0Eh is visible here once flag() has returned CA0Eh.
/// In between only the core uses them. Words are in host byte order. The caller owns the memory, which must
/// outlive this view.
class RegisterWindow {
 public:
  using Words = std::span<std::uint16_t, regmap::kWindowWords>;

  /// No window: no other function may be called.
  RegisterWindow() = default;
  explicit RegisterWindow(Words words) : words_(words.data()) {}

  std::uint16_t flag() const { return atomic_flag().load(std::memory_order_acquire); }

  /// The words from R3700 on.
  std::uint16_t* words() const { return words_; }

  /// Replaces CA0Eh by the result, after all earlier writes. False: the PLC has written another value, which
  /// is kept; the transaction was cancelled at the last moment. A processor without compare-and-swap
  /// (Cortex-M0+) uses a load and a store: there an interrupt that writes R3700 must be masked while the core
  /// is called.
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

// 0 in a build without process data, or without the scanner window.
inline constexpr std::size_t kProcessWords = kServices.process_data() ? regmap::kProcessWords : 0;
inline constexpr std::size_t kOutputWords = kServices.process_data() ? regmap::kOutputWords : 0;
inline constexpr std::size_t kScannerOutWords = kServices.scanner_window ? regmap::kScannerOutWords : 0;
inline constexpr std::size_t kScannerInWords = kServices.scanner_window ? regmap::kScannerInWords : 0;

/// R3800..R3927, or another range by configuration: inputs, then outputs. The core accesses them only inside
/// its own calls, so a Modbus server called from the same place always reads a complete PDO. The caller owns
/// the memory.
using ProcessRegisters = std::span<std::uint16_t, kProcessWords>;

/// R3928..R4099, or another range; see NetworkStatus.
inline constexpr std::size_t kStatusWords = kServices.manager() ? regmap::kStatusWords : 0;
using StatusRegisters = std::span<std::uint16_t, kStatusWords>;
/// R4142 and R4143: see regmap::NodeRequest.
using NodeRequestRegisters = std::span<std::uint16_t, 2>;

}  // namespace cbcan
