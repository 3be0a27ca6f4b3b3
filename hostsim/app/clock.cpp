// SPDX-License-Identifier: MIT
#include "app/clock.hpp"

#include "io/loop/reactor.hpp"

namespace cbcan::app {

Time RealClock::now() const {
  return io::Reactor::now();
}

Time RealClock::wall_offset() const {
  return io::Reactor::wall_offset();
}

void RealClock::drive(Program& program) {
  while (!program.stop_requested())
    program.turn(kNever);
}

std::string seconds_text(Time time) {
  const std::string fraction = std::to_string(time % kSecond);
  return std::to_string(time / kSecond) + "." + std::string(6 - fraction.size(), '0') + fraction;
}

}  // namespace cbcan::app
