// SPDX-License-Identifier: MIT
#pragma once

/// The window for PLCs that exchange whole blocks of registers again and again (docs/reference/contract.md,
/// "The scanner window"): OUT words that the PLC writes as often as it likes, IN words that it reads as often
/// as it likes. A request goes by its number, so writing it again starts nothing, and its result stays.
///
///   OUT+0  number          IN+0  number answered
///   OUT+1  as R3701        IN+1  its result
///   ...                    IN+2  number taken last
///   OUT+69 as R3769        IN+3  bytes of data
///                          IN+4  data, or the SDO abort code
///
/// Numbers and words only: what a request means is the coprocessor's. Ordering: IN+0 is released after the
/// result, so who reads IN upwards and finds a number there finds its result behind it.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/configuration.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan {

class ScannerWindow {
 public:
  using Out = std::span<const std::uint16_t, kScannerOutWords>;
  using In = std::span<std::uint16_t, kScannerInWords>;

  /// None: nothing comes through it.
  ScannerWindow() = default;
  /// Host byte order; the memory is the caller's and outlives this. To be started by restart().
  ScannerWindow(Out out, In in) : out_(out.data()), in_(in.data()) {}

  /// What a write asks of whoever executes requests.
  enum class Event : std::uint8_t {
    kNone,
    kCancel,   ///< the request under way is no longer wanted
    kRequest,  ///< likewise, if there is one; and a new one waits for begin()
  };

  /// Power on: what has been executed before is not known.
  void restart();

  /// OUT+first..OUT+first+count-1 have been written, by one request of the PLC.
  Event on_written(std::size_t first, std::size_t count);

  /// A request waits for its turn.
  bool waiting() const { return kServices.scanner_window && state_ == State::kWaiting; }
  /// Its turn: its words are to be copied now.
  void begin() { state_ = State::kUnderWay; }
  /// It was not: it waits again.
  void hold_back() { state_ = State::kWaiting; }

  /// The words of the request: word k is what is R3700 + k in the other window.
  const std::uint16_t* words() const { return out_; }

  /// Where the data of the request under way, or its abort code, go before finish(): kDataWords words.
  std::uint16_t* data() const { return in_ + regmap::kScannerData; }
  /// Ends the request under way. `size`: bytes in data().
  void finish(regmap::Result result, std::size_t size = 0);

 private:
  enum class State : std::uint8_t { kIdle, kWaiting, kUnderWay };

  std::uint16_t word(std::size_t k) const { return out_[k]; }
  Event take(std::uint16_t number, std::size_t count);
  Event cancel();
  std::size_t words_needed() const;

  const std::uint16_t* out_ = nullptr;
  std::uint16_t* in_ = nullptr;  ///< null: there is no such window
  std::uint16_t taken_ = 0;      ///< number taken last; what IN+2 shows, where the PLC cannot write it
  State state_ = State::kIdle;
  bool restarted_ = true;  ///< no number has come since
};

}  // namespace cbcan
