// SPDX-License-Identifier: MIT
#pragma once

/// A coprocessor that boots a network; the test acts as PLC and as the other nodes.

#include "support/bench.hpp"

namespace cbcan::test {

using Bytes = std::vector<std::uint8_t>;

/// An object of an image: its value low byte first.
struct Item {
  std::uint16_t index;
  std::uint8_t sub;
  Bytes value;
};

inline Bytes u8(std::uint8_t value) {
  return {value};
}
inline Bytes u32(std::uint32_t value) {
  Bytes bytes(4);
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(value);
    value >>= 8;
  }
  return bytes;
}

inline Bytes concise(const std::vector<Item>& items) {
  Bytes bytes = u32(static_cast<std::uint32_t>(items.size()));
  for (const Item& item : items) {
    for (const int byte : {item.index & 0xFF, item.index >> 8, int{item.sub}})
      bytes.push_back(static_cast<std::uint8_t>(byte));
    for (const Bytes& part : {u32(static_cast<std::uint32_t>(item.value.size())), item.value})
      bytes.insert(bytes.end(), part.begin(), part.end());
  }
  return bytes;
}

/// A concise DCF with its CRC: x^16 + x^12 + x^5 + 1.
inline Bytes image_of(Bytes bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= unsigned{byte} << 8;
    for (int bit = 0; bit != 8; ++bit)
      crc = (crc << 1 ^ ((crc & 0x8000) != 0 ? 0x1021u : 0u)) & 0xFFFF;
  }
  for (const unsigned byte : {crc & 0xFF, crc >> 8})
    bytes.push_back(static_cast<std::uint8_t>(byte));
  return bytes;
}

struct ManagerRig : CoprocessorRig {
  enum class Place { kRam, kFlash };
  explicit ManagerRig(const std::vector<Item>& items, Coprocessor::Settings settings = {},
                      Place place = Place::kRam)
      : CoprocessorRig(settings), memory(image_of(concise(items))) {
    const std::size_t used = memory.size();
    memory.resize(used + 256);
    REQUIRE((place == Place::kRam
                 ? coprocessor.use_network(memory, used)
                 : coprocessor.use_network(std::span<const std::uint8_t>(memory).first(used))));
    coprocessor.show_status_in(registers.status(), registers.node_requests());
    coprocessor.start(now);
    pass(0);
  }

  // The PLC.
  CoprocessorRig& nmt(std::uint16_t node, std::uint16_t command) {
    return request({5066, 0, 0x1F82, node, 1, command});
  }
  StackRig& write_words(unsigned first, std::initializer_list<std::uint16_t> words) {
    put(first, words);
    coprocessor.on_plc(1, first, words.size(), now);
    return pass(0);
  }

  /// R3972 + node.
  unsigned of(unsigned node) { return reg(3972 + node); }
  unsigned summary() { return reg(3928); }
  bool in_map(unsigned map, unsigned node) { return (reg(3932 + 8 * map + node / 16) >> node % 16 & 1) != 0; }

  Bytes memory;
};

inline constexpr unsigned kHeard = 0, kConfigured = 1, kRunning = 2;

inline const Item kManager{0x1F80, 0, u32(1)};
inline const Item kHeartbeats{0x1016, 1, u32(0x000500FA)};
inline const Item kWrites{0x1F22, 5, concise({{0x1017, 0, {100, 0}}, {0x6423, 0, {1}}})};

/// Own TPDO 1 sends the first output, R3864, on 205h.
inline const std::vector<Item> kOutput{
    {0x1A00, 1, u32(0xA5800110)}, {0x1A00, 0, {1}}, {0x1800, 1, u32(0x205)}};

/// Node 5: 1F81h, then expected device type, vendor and product.
inline std::vector<Item> node_5(std::uint32_t assignment = 5, const std::vector<Item>& more = {kWrites}) {
  std::vector<Item> items{kHeartbeats,
                          kManager,
                          {0x1F81, 5, u32(assignment)},
                          {0x1F84, 5, u32(0x000F0191)},
                          {0x1F85, 5, u32(0x22)},
                          {0x1F86, 5, u32(0x191)}};
  items.insert(items.end(), more.begin(), more.end());
  return items;
}

/// From the request for 1000h, which has been sent, to what follows the last check.
inline void check_identity(ManagerRig& rig) {
  rig.expect("605#4000100000000000");
  rig.arrive("585#4300100091010F00").expect("605#4018100100000000");
  rig.arrive("585#4318100122000000").expect("605#4018100200000000");
  rig.arrive("585#4318100291010000");
}

/// From the boot-up message to the last confirmed write.
inline void check_and_configure(ManagerRig& rig) {
  rig.arrive("705#00");
  check_identity(rig);
  rig.expect("605#2B17100064000000");
  rig.arrive("585#6017100000000000").expect("605#2F23640001000000");
  rig.arrive("585#6023640000000000").expect_silence();
}

/// To kRun.
inline void boot(ManagerRig& rig) {
  check_and_configure(rig);
  rig.arrive("705#7F").expect("000#0105");
  rig.arrive("705#05").expect_silence();
  REQUIRE(rig.of(5) == 0x0105);
}

inline void begin(ManagerRig& rig) {
  rig.expect("77F#00", "000#8200");
}

}  // namespace cbcan::test
