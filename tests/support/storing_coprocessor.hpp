// SPDX-License-Identifier: MIT
#pragma once

/// A coprocessor with a memory for 1010h, and parameters to store.

#include "support/bench.hpp"

namespace cbcan::test {

inline constexpr std::uint16_t kSave[] = {0x6173, 0x6576}, kLoad[] = {0x6F6C, 0x6461};

struct Parameter {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint16_t size;
  std::uint32_t value;
};

/// In an order in which they can be written by SDO.
inline constexpr Parameter kParameters[] = {
    {0x1019, 0, 1, 10},         {0x1005, 0, 4, 0x00000081}, {0x1006, 0, 4, 10'000},
    {0x1007, 0, 4, 5'000},      {0x1012, 0, 4, 0x80000100}, {0x1014, 0, 4, 0x800000C1},
    {0x1015, 0, 2, 100},        {0x1016, 1, 4, 0x000501F4}, {0x1016, 127, 4, 0x7E0064},
    {0x1017, 0, 2, 700},        {0x1029, 1, 1, 2},          {0x1400, 2, 1, 254},
    {0x1600, 1, 4, 0xA1000110}, {0x1600, 0, 1, 1},          {0x1400, 1, 4, 0x00000185},
    {0x180F, 2, 1, 254},        {0x180F, 3, 2, 100},        {0x180F, 5, 2, 250},
    {0x1A0F, 1, 4, 0xA5800110}, {0x1A0F, 2, 4, 0xA5800210}, {0x1A0F, 0, 1, 2},
    {0x180F, 1, 4, 0x000001FF}, {0x3003, 0, 2, 250},        {0x3004, 0, 1, 2},
};

struct StoringCoprocessor {
  /// Power on.
  void start(ParameterMemory& memory, std::uint8_t node_id = 127) {
    bench.emplace(Coprocessor::Settings{.node_id = node_id});
    bench->coprocessor.keep_in(memory);
    bench->start();
  }
  std::uint32_t get(std::uint16_t index, std::uint8_t sub) {
    bench->registers.put(3706, {0, 0});
    bench->read(0, index, sub, 128).check_done();
    return bench->reg(3706) | static_cast<std::uint32_t>(bench->reg(3707)) << 16;
  }
  CoprocessorRig& put(std::uint16_t index, std::uint16_t sub, std::uint16_t size, std::uint32_t value) {
    return bench->write(0, index, sub, size,
                        {static_cast<std::uint16_t>(value), static_cast<std::uint16_t>(value >> 16)});
  }
  CoprocessorRig& command(std::uint16_t index, std::uint16_t sub, const std::uint16_t (&word)[2]) {
    return bench->write(0, index, sub, 4, {word[0], word[1]});
  }
  void save(std::uint16_t sub = 1) { command(0x1010, sub, kSave).check_done(); }
  void put_all() {
    for (const Parameter& parameter : kParameters) {
      INFO(std::hex << parameter.index << " " << int{parameter.sub});
      put(parameter.index, parameter.sub, parameter.size, parameter.value).check_done();
    }
  }
  void check_all() {
    for (const Parameter& parameter : kParameters) {
      INFO(std::hex << parameter.index << " " << int{parameter.sub});
      CHECK(get(parameter.index, parameter.sub) == parameter.value);
    }
  }

  std::optional<CoprocessorRig> bench;
};

}  // namespace cbcan::test
