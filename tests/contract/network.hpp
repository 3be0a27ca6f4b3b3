// SPDX-License-Identifier: MIT
#pragma once

/// A network that the module boots: node 5 has device type 0F0191h and vendor 22h; a time of 250 ms in 1016h.

#include "contract/pdo.hpp"

namespace cbcan::contract {

inline constexpr std::uint16_t kStartup = 0x1F80, kAssignment = 0x1F81, kType = 0x1F84, kVendor = 0x1F85;

/// 1017h = 100 and 6423h = 1 for node 5.
inline void put_configuration(Window& window) {
  window.configure(0x1F22, 5, 21, {2, 0, 0x1017, 0x0200, 0, 0x6400, 0x2300, 0x0064, 1, 0, 1});
}

/// `startup`: 1F80h, `assignment`: 1F81h:05.
struct Network : Window {
  explicit Network(std::uint32_t startup = 1, std::uint32_t assignment = 5,
                   const std::function<void(Window&)>& more = {}, const Settings& settings = {})
      : Window(settings) {
    put(0x1016, 1, 0x000500FA);
    put(kAssignment, 5, assignment);
    put(kType, 5, 0x000F0191);
    put(kVendor, 5, 0x22);
    put_configuration(*this);
    if (more) more(*this);
    put(kStartup, 0, startup);
    if ((assignment & 0x10) == 0) expect("000#8200");
  }
  /// R3972 + node.
  unsigned of(unsigned node) { return reg(3972 + node); }
  bool in_map(unsigned map, unsigned node) { return (reg(3932 + 8 * map + node / 16) >> node % 16 & 1) != 0; }
};

inline constexpr unsigned kHeard = 0, kConfigured = 1, kRunning = 2, kEmergency = 3, kLost = 4;

inline const std::vector<Step> kCheck{{"", "705#00"},
                                      {"605#4000100000000000", "585#4300100091010F00"},
                                      {"605#4018100100000000", "585#4318100122000000"}};
inline const std::vector<Step> kWrites{{"605#2B17100064000000", "585#6017100000000000"},
                                       {"605#2F23640001000000", "585#6023640000000000"}};

/// TPDO 1 sends R3864 on 205h.
inline void put_output(Window& window) {
  window.put(0x1A00, 1, 0xA5800110);
  window.configure(0x1A00, 0, 1, {1});
  window.put(0x1800, 1, 0x205);
}

inline void boot(Network& network) {
  network.exchange(kCheck).exchange(kWrites);
  network.arrive("705#7F").expect("000#0105");
  network.arrive("705#05").expect_silence();
  CHECK(network.of(5) == 0x0105);
}

}  // namespace cbcan::contract
