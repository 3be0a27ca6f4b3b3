// SPDX-License-Identifier: MIT
#pragma once

/// The window for PLCs that exchange whole blocks of registers cyclically (docs/reference/contract.md, "The
/// scanner window"): OUT words that the PLC writes any number of times, IN words that it reads any number of
/// times. A request is identified by its number, so writing it again has no effect, and its result stays.
///
///   OUT+0  number          IN+0  number answered
///   OUT+1  as R3701        IN+1  its result
///   ...                    IN+2  number taken last
///   OUT+69 as R3769        IN+3  bytes of data
///                          IN+4  data, or the SDO abort code
///
/// This class handles numbers and words only; Channel interprets requests. Ordering: IN+0 is released after
/// the result, so a client that reads IN upwards and finds a number there also finds its result.

#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan {

class ScannerWindow {
 public:
  using Out = std::span<const std::uint16_t, kScannerOutWords>;
  using In = std::span<std::uint16_t, kScannerInWords>;

  /// No window: there are no requests.
  ScannerWindow() = default;
  /// Host byte order; the caller owns the memory, which outlives this. Call restart() first.
  ScannerWindow(Out out, In in) : out_(out.data()), in_(in.data()) {}

  /// Power on: it is not known which requests have been executed.
  void restart();

  /// OUT+first..OUT+first+count-1 have been written, by one request of the PLC. True: cancel the request in
  /// progress, if there is one; a new one may wait for begin().
  bool on_written(std::size_t first, std::size_t count);

  /// A request is waiting for its turn.
  bool waiting() const { return state_ == State::kWaiting; }
  /// The waiting request begins: copy its words now.
  void begin() { state_ = State::kUnderWay; }
  /// It could not begin: it waits again.
  void hold_back() { state_ = State::kWaiting; }

  /// The words of the request: word k corresponds to R3700 + k.
  const std::uint16_t* words() const { return out_; }

  /// Destination of the data or the abort code of the request in progress, before finish(): kDataWords words.
  std::uint16_t* data() const { return in_ + regmap::kScannerData; }
  /// Ends the request in progress. `size`: bytes in data().
  void finish(regmap::Result result, std::size_t size = 0);

 private:
  enum class State : std::uint8_t { kIdle, kWaiting, kUnderWay };

  bool take(std::uint16_t number, std::size_t count);
  bool cancel();
  std::size_t words_needed() const;

  const std::uint16_t* out_ = nullptr;
  std::uint16_t* in_ = nullptr;  ///< null: there is no window
  std::uint16_t taken_ = 0;      ///< number taken last, as in IN+2, which the PLC can overwrite
  State state_ = State::kIdle;
  bool restarted_ = true;  ///< and no number has been written since
};

}  // namespace cbcan
