// SPDX-License-Identifier: MIT
// on_fault() of images that run under a debugger or an emulator: prints the fault, and ends with exit code 1.

#include "boards/common/cortex_m.hpp"
#include "boards/common/semihosting.hpp"

namespace cbcan::boards {

namespace {

void tell(const char* name, std::uint32_t value) {
  semihosting::write(name);
  semihosting::write_hex(value);
}

}  // namespace

void on_fault(const Fault& fault) {
  tell("cbcan: fault: exception ", fault.exception);
  tell(" status ", fault.status);
  tell(" address ", fault.address);
  tell(" pc ", fault.pc());
  semihosting::write("\n");
  semihosting::exit(1);
}

}  // namespace cbcan::boards
