// SPDX-License-Identifier: MIT
#include "boards/common/semihosting.hpp"

namespace cbcan::boards::semihosting {

std::intptr_t call(std::uintptr_t operation, const void* argument) {
  register std::uintptr_t x0 asm("x0") = operation;
  register const void* x1 asm("x1") = argument;
  asm volatile("hlt 0xF000" : "+r"(x0) : "r"(x1) : "memory");
  return static_cast<std::intptr_t>(x0);
}

}  // namespace cbcan::boards::semihosting
