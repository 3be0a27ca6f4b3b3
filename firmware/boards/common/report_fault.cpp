// SPDX-License-Identifier: MIT
// on_fault() of images that run under a debugger or an emulator: prints the fault, and ends with exit code 1.

#include <utility>

#include "boards/common/cortex_m.hpp"
#include "boards/common/semihosting.hpp"

namespace cbcan::boards {

void on_fault(const Fault& fault) {
  const std::pair<const char*, std::uint32_t> parts[] = {{"cbcan: fault: exception ", fault.exception},
                                                         {" status ", fault.status},
                                                         {" address ", fault.address},
                                                         {" pc ", fault.pc()}};
  for (const auto& [name, value] : parts) {
    semihosting::write(name);
    semihosting::write_hex(value);
  }
  semihosting::write("\n");
  semihosting::exit(1);
}

}  // namespace cbcan::boards
