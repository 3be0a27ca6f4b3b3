// SPDX-License-Identifier: MIT
// cbcan::rtu: station 1 has one register, 100, and a master writes 7 to it.
#include <array>
#include <cstdio>

#include "cbcan/modbus/rtu_server.hpp"

int main() {
  std::array<std::uint16_t, 1> word{};
  const std::array ranges{cbcan::RegisterRange{100, word}};
  const std::array networks{cbcan::RegisterMap(ranges)};
  cbcan::RtuServer server(networks, {.silence_us = cbcan::rtu_silence_us(19'200)});
  std::uint32_t now = 10'000;  // microseconds
  for (const std::uint8_t byte : {0x01, 0x06, 0x00, 0x64, 0x00, 0x07, 0x89, 0xD7})
    server.on_byte(byte, now += 573);
  if (server.poll(now + 2006) == 0) server.execute();  // 3.5 characters of silence
  std::printf("register 100 is %d\n", word[0]);
}
