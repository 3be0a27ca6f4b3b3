// SPDX-License-Identifier: MIT
#include "fuzz/fuzz.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cbcan::fuzz::run(cbcan::fuzz::Input({data, size}));
  return 0;
}
