// SPDX-License-Identifier: MIT
// Reads the name of pressure transducer 1 of `cbcan-sim --demo`, and ends: one block, one call.

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

#include "cbcan/cia405.hpp"

int main(int argc, char** argv) {
  using std::chrono::steady_clock;
  namespace cia405 = cbcan::cia405;
  cia405::Link link({.host = "localhost", .port = argc > 1 ? std::atoi(argv[1]) : 1502});
  std::array<std::uint8_t, 32> text{};
  cia405::SdoRead name(link);
  name.device = 1;
  name.index = 0x1008;
  name.data = text;
  if (!cia405::run(name, steady_clock::now() + std::chrono::seconds(2))) {
    std::cerr << "error " << static_cast<int>(name.error) << " " << link.problem() << "\n";
    return 1;
  }
  std::cout << std::string(text.begin(), text.begin() + name.datalength) << "\n";
}
