// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "cbcan/regmap.hpp"
#include "io/bytes.hpp"
#include "modbus/rtu_server.hpp"

namespace cbcan::test {

using io::test::Bytes;
using io::test::hex;

/// `head`, `count` bytes of 5Ah, and the CRC of it all, which the caller has worked out.
inline Bytes filled(std::string_view head, std::size_t count, std::string_view crc) {
  Bytes frame = hex(head);
  frame.insert(frame.end(), count, 0x5A);
  for (const std::uint8_t byte : hex(crc))
    frame.push_back(byte);
  return frame;
}

/// A server on a line of 115200 baud, and the client at its other end.
template <std::size_t kNetworks>
struct LineOf {
  static constexpr std::uint32_t kByteUs = 96;       ///< 11 bits
  static constexpr std::uint32_t kSilenceUs = 1751;  ///< just over a gap

  explicit LineOf(const RtuServer::Settings& settings) : server(words, settings) {}

  void send(const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) {
      now += kByteUs;
      server.on_byte(byte, now);
    }
  }
  /// The next byte comes this long after the last one.
  void wait(std::uint32_t us) { now += us - kByteUs; }
  void gap() { wait(kSilenceUs); }

  /// What a poll gives, sent.
  Bytes response() {
    const std::span<const std::uint8_t> bytes = server.poll();
    Bytes copy(bytes.begin(), bytes.end());
    server.on_sent();
    return copy;
  }
  Bytes ask(const Bytes& request) {
    gap();
    send(request);
    return response();
  }

  std::array<std::uint16_t, kNetworks * regmap::kRegisterFileWords> words{};
  RtuServer server;
  std::uint32_t now = 1'000'000;
};

struct Line : LineOf<1> {
  explicit Line(const RtuServer::Settings& settings = {}) : LineOf(settings) {}
};

/// Stations 17 and 18, unless the settings name another one.
struct TwoNetworks : LineOf<2> {
  explicit TwoNetworks(const RtuServer::Settings& settings = {}) : LineOf(with_networks(settings)) {}

  std::uint16_t& word(std::size_t network, std::size_t address) {
    return words[network * regmap::kRegisterFileWords + address];
  }
  std::uint16_t& first(std::size_t address) { return word(0, address); }
  std::uint16_t& second(std::size_t address) { return word(1, address); }

 private:
  static RtuServer::Settings with_networks(RtuServer::Settings settings) {
    if (settings.station == 1) settings.station = 17;
    settings.networks = 2;
    return settings;
  }
};

}  // namespace cbcan::test
