// SPDX-License-Identifier: MIT
// Reads the name of pressure transducer 1 of `cbcan-sim --demo` as a PLC does: one transaction through R3700.

#include <cstdlib>
#include <iostream>
#include <string>

#include "cbcan/window.hpp"

int main(int argc, char** argv) {
  try {
    cbcan::window::Client client({.port = argc > 1 ? std::atoi(argv[1]) : 1502});
    const auto name = client.execute({.command = 5055, .node = 1, .index = 0x1008, .size = 32});
    if (name.code == 0) std::cout << std::string(name.data.begin(), name.data.end()) << "\n";
    if (name.code != 0) std::cerr << "result " << name.code << ", abort code " << name.abort_code << "\n";
    return name.code == 0 ? 0 : 1;
  } catch (const cbcan::window::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
