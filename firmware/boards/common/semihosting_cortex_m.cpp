// SPDX-License-Identifier: MIT
#include "boards/common/semihosting.hpp"

namespace cbcan::boards::semihosting {

std::intptr_t call(std::uintptr_t operation, const void* argument) {
  register std::uintptr_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return static_cast<std::intptr_t>(r0);
}

}  // namespace cbcan::boards::semihosting
