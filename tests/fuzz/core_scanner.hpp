// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/regmap.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

/// What a PLC program may rely on in the scanner window (docs/reference/contract.md, "The scanner window"), asked after
/// every call into the core. A number that is taken while it is still the one answered last does not show
/// its end: then less is asked.
struct Scanner {
  /// Around each call into the core.
  void before() { seen_ = in; }
  void after() {
    require(in[2] == taken_, "IN+2 shows the number taken last at once");  // [SCAN-2]
    seen_[2] = taken_;
    if (hidden_) {
      due_ = kAny;
      return;
    }
    require(open_ || in == seen_, "a result stays until the next number");  // [SCAN-3], [SCAN-4], [SCAN-7]
    if (!open_) return;
    if (in[0] != taken_) {
      require(in == seen_, "a result comes with its number");  // [SCAN-3], [SCAN-5]
      return require(due_ == kAny, "what can be told at once is told at once");
    }
    check_answer();
    open_ = false;
    due_ = kAny;
  }
  /// Before the call that tells of OUT+first..OUT+first+count-1.
  void written(std::size_t first, std::size_t count) {
    used_ = true;
    const std::uint16_t number = out[0];
    if (first == 0 && number == 0) {
      if (open_) due_ = 4;  // [SCAN-6]
    } else if (first == 0 && number != taken_) {
      take(number, count);
    } else if (first < words_needed() && (first != 0 || count < words_needed())) {
      may_break_ = true;  // [SCAN-15]
    }
  }

  /// Something has been written: the two windows share the coprocessor from then on.
  bool used() const { return used_; }
  /// A number has been taken and is not answered yet.
  bool open() const { return open_ && !hidden_; }
  /// The number that comes next; never 0.
  std::uint16_t next() const {
    return taken_ == 0xFFFF ? std::uint16_t{1} : static_cast<std::uint16_t>(taken_ + 1);
  }

  std::array<std::uint16_t, regmap::kScannerOutWords> out{};
  std::array<std::uint16_t, regmap::kScannerInWords> in{};

 private:
  static constexpr unsigned kAny = 0xFFFF;

  void take(std::uint16_t number, std::size_t count) {
    taken_ = number;
    open_ = true;
    may_break_ = false;
    hidden_ = in[0] == number;
    if (restarted_) {
      due_ = 5;  // [SCAN-11]
    } else if (count < words_needed()) {
      due_ = 6;  // [SCAN-8]
    }
    restarted_ = false;
  }
  /// [SCAN-9]
  std::size_t words_needed() const {
    if (out[1] != 5066) return 6;
    if (out[3] == 0x1F82) return 7;
    return out[5] > 128 ? 6 : 6 + (out[5] + 1u) / 2;
  }
  void check_answer() const {
    const unsigned result = in[1];
    const bool of_request = result <= 2 || result == 4;
    require(due_ == kAny ? of_request || (result == 6 && may_break_) : result == due_,
            "a result is one of those that the contract names");
    require(result != 4 || in[4] != 0 || in[5] != 0, "a failure has an abort code");
    require(due_ != 4 || (in[4] == 0 && in[5] == 0x0800), "what is cancelled is told as such");
    require(in[3] <= 128 && (result == 0 || in[3] == 0), "the size is that of data");
  }

  std::array<std::uint16_t, regmap::kScannerInWords> seen_{};
  std::uint16_t taken_ = 0;
  unsigned due_ = kAny;     ///< result that the number taken has to have at once
  bool may_break_ = false;  ///< it has been written again in part: 6 where it waits
  bool used_ = false, restarted_ = true, open_ = false, hidden_ = false;
};

}  // namespace cbcan::fuzz
