// SPDX-License-Identifier: MIT
// cbcan::slcan: a frame as a line for an adapter.
#include <array>
#include <cstdio>

#include "cbcan/slcan/slcan.hpp"

int main() {
  std::array<char, cbcan::slcan::kMaxLine> line{};
  const auto length = cbcan::slcan::encode({.id = 0x000, .length = 2, .data = {0x01, 0x42}}, line);
  std::printf("%.*s\n", static_cast<int>(length) - 1, line.data());
}
