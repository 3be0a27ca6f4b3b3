// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/regmap.hpp"

namespace cbcan::fuzz {

/// What a PLC program may rely on in the scanner window (docs/contract.md, "The scanner window"), asked after
/// every call into the core. A number that is taken while it is still the one answered last does not show
/// its end: then less is asked.
struct Scanner {
  /// Around each call into the core.
  void before() { seen_ = in; }
  void after();
  /// Before the call that tells of OUT+first..OUT+first+count-1.
  void written(std::size_t first, std::size_t count);

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

  void take(std::uint16_t number, std::size_t count);
  std::size_t words_needed() const;
  void check_answer() const;

  std::array<std::uint16_t, regmap::kScannerInWords> seen_{};
  std::uint16_t taken_ = 0;
  unsigned due_ = kAny;     ///< result that the number taken has to have at once
  bool may_break_ = false;  ///< it has been written again in part: 6 where it waits
  bool used_ = false, restarted_ = true, open_ = false, hidden_ = false;
};

}  // namespace cbcan::fuzz
