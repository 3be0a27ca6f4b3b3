// SPDX-License-Identifier: MIT
#pragma once

#include "contract/window.hpp"

namespace cbcan::contract {

/// A transfer with object 2000h:01 of node 5, up to a frame whose response is awaited. The value written is
/// "123456789", whose CRC is the published check value 31C3h.
struct Phase {
  const char* name;
  std::uint16_t mode;  ///< 3004h
  Words request;       ///< R3701..
  std::vector<Step> steps;
  const char* waiting;                ///< the frame; "" = a segment of the server is awaited
  std::uint8_t expected;              ///< expected command specifier; kSegment = a sequence number
  const char* asked_again = nullptr;  ///< after half the SDO timeout

  static constexpr std::uint8_t kSegment = 8;
};

inline const std::vector<Phase>& phases() {
  static const Words read{5055, 5, 0x2000, 1, 128}, block_read{5055, 5, 0x2000, 1, 9},
      short_write{5066, 5, 0x2000, 1, 2, 0x3231},
      write{5066, 5, 0x2000, 1, 9, 0x3231, 0x3433, 0x3635, 0x3837, 0x0039};
  using Steps = std::vector<Step>;
  static const Steps reads{{"605#4000200100000000", "585#4100200114000000"},
                           {"605#6000000000000000", "585#0001020304050607"}},
      writes{{"605#2100200109000000", "585#6000200100000000"},
             {"605#0031323334353637", "585#2000000000000000"}},
      block_writes{{"605#C600200109000000", "585#A40020017F000000"},
                   {"605#0131323334353637", ""},
                   {"605#8238390000000000", "585#A2027F0000000000"}},
      block_reads{{"605#A400200102000000", "585#C600200109000000"},
                  {"605#A300000000000000", "585#0131323334353637"},
                  {"", "585#8238390000000000"}};
  const auto first = [](std::ptrdiff_t count, const Steps& steps) {
    return Steps(steps.begin(), steps.begin() + count);
  };
  constexpr std::uint8_t kSegment = Phase::kSegment;
  static std::vector<Phase> all{
      {"read: start", 0, read, {}, "605#4000200100000000", 2},
      {"read: first segment", 0, read, first(1, reads), "605#6000000000000000", 0},
      {"read: second segment", 0, read, reads, "605#7000000000000000", 0},
      {"expedited write", 0, short_write, {}, "605#2B00200131320000", 3},
      {"write: start", 0, write, {}, "605#2100200109000000", 3},
      {"write: first segment", 0, write, first(1, writes), "605#0031323334353637", 1},
      {"write: last segment", 0, write, writes, "605#1B38390000000000", 1},
      {"block write: start", 3, write, {}, "605#C600200109000000", 5},
      {"block write: segments", 3, write, first(2, block_writes), "605#8238390000000000", 5},
      {"block write: end", 3, write, block_writes, "605#D5C3310000000000", 5},
      {"block read: start", 3, block_read, {}, "605#A400200102000000", 6},
      {"block read: no segment", 3, block_read, first(1, block_reads), "605#A300000000000000", kSegment,
       "605#A200020000000000"},
      {"block read: one segment", 3, block_read, first(2, block_reads), "", kSegment, "605#A201020000000000"},
      {"block read: end", 3, block_read, block_reads, "605#A202020000000000", 6},
  };
  static const bool in_blocks = make_target({})->lacks(Ability::kBlock).empty();
  if (!in_blocks) std::erase_if(all, [](const Phase& phase) { return phase.mode == 3; });
  return all;
}

inline const Phase& phase_called(std::string_view name) {
  for (const Phase& phase : phases())
    if (phase.name == name) return phase;
  throw std::invalid_argument("no phase is called " + std::string(name));
}

/// Brings a newly started window into the phase.
inline void enter(Window& window, const Phase& phase) {
  if (phase.mode != 0) window.set_mode(phase.mode);
  window.start(phase.request);
  window.exchange(phase.steps);
  window.exchange({{phase.waiting, ""}});
  CHECK(window.busy());
}

}  // namespace cbcan::contract
