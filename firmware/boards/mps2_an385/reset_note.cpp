// SPDX-License-Identifier: MIT
#include "boards/mps2_an385/reset_note.hpp"

#include <cstdint>

#include "boards/common/cortex_m.hpp"

namespace cbcan::boards::mps2 {

namespace {

constexpr std::uint32_t kMark = 0x52535421;

struct Note {
  std::uint32_t mark;
  regmap::ResetCause cause;
};

[[gnu::section(".noinit")]] Note note;

}  // namespace

void leave_reset_cause(regmap::ResetCause cause) {
  note = {kMark, cause};
}

regmap::ResetCause take_reset_cause() {
  const bool left = note.mark == kMark;
  note.mark = 0;
  return left ? note.cause : regmap::ResetCause::kPowerOn;
}

void on_watchdog() {
  leave_reset_cause(regmap::ResetCause::kWatchdog);
  system_reset();
}

}  // namespace cbcan::boards::mps2
