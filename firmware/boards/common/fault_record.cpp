// SPDX-License-Identifier: MIT
#include "boards/common/fault_record.hpp"

#include <algorithm>

namespace cbcan::boards {

void FaultRecord::start(regmap::ResetCause cause) {
  if (check_ != sum() || cause == regmap::ResetCause::kPowerOn) set({}, 0, 0);
  if (cause == regmap::ResetCause::kPin) on_good();  // a person pressed reset
  if (cause == regmap::ResetCause::kWatchdog) note({});
}

void FaultRecord::note(const Fault& fault) {
  constexpr std::uint16_t kMost = 0xFFFF;
  if (check_ != sum()) set({}, 0, 0);
  const auto next = [](std::uint16_t n) { return n == kMost ? n : static_cast<std::uint16_t>(n + 1); };
  set(fault, next(count_), next(in_a_row_));
}

Time FaultRecord::can_wait() const {
  if (in_a_row_ == 0) return 0;
  return kSecond << std::min(in_a_row_ - 1, 6);
}

void FaultRecord::show(Diagnostics registers) const {
  static_assert(regmap::kFaultLr == regmap::kFaultPc + 2 && regmap::kFaultStatus == regmap::kFaultLr + 2);
  registers[regmap::kFaults - regmap::kDiagnosticsFirst] = count_;
  __builtin_memcpy(&registers[regmap::kFaultPc - regmap::kDiagnosticsFirst], &fault_, sizeof fault_);
}

/// Never 0 if all fields are 0, nor all ones if all fields are.
std::uint32_t FaultRecord::sum() const {
  return 0x0FA017ED ^ fault_.pc ^ fault_.lr << 1 ^ fault_.status << 2 ^
         (std::uint32_t{count_} << 16 | in_a_row_);
}

void FaultRecord::set(const Fault& fault, std::uint16_t count, std::uint16_t in_a_row) {
  fault_ = fault;
  count_ = count;
  in_a_row_ = in_a_row;
  check_ = sum();
}

}  // namespace cbcan::boards
