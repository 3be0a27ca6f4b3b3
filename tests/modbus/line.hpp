// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "cbcan/modbus/rtu_server.hpp"
#include "cbcan/regmap.hpp"
#include "io/bytes.hpp"

namespace cbcan::test {

using io::test::Bytes;
using io::test::hex;

/// A read of R0 of station 1, and the response if it is 1234h.
inline const Bytes kRead = hex("01 03 00 00 00 01 84 0A");
inline const Bytes kValue = hex("01 03 02 12 34 B5 33");

/// The response to the request that waits, if its silence has passed at `now`; it has been sent then.
inline Bytes execute(RtuServer& server, std::uint32_t now) {
  if (server.poll(now) != 0) return {};
  const std::span<const std::uint8_t> bytes = server.execute();
  Bytes copy(bytes.begin(), bytes.end());
  server.on_sent();
  return copy;
}

/// A request after a gap, and its response.
inline Bytes ask(RtuServer& server, std::uint32_t& now, const Bytes& request) {
  now += 10'000;
  for (const std::uint8_t byte : request)
    server.on_byte(byte, now);
  return execute(server, now += 1'750);
}

/// A server on a line of 115200 baud, and the client at its other end. Each network has R0..R4167.
template <std::size_t kNetworks>
struct LineOf {
  static constexpr std::uint32_t kByteUs = 96;       ///< 11 bits
  static constexpr std::uint32_t kSilenceUs = 1750;  ///< t3.5

  explicit LineOf(const RtuServer::Settings& settings)
      : gap_us(std::max(settings.gap_us, settings.silence_us)), server(maps, settings) {}

  void send(const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) {
      now += kByteUs;
      server.on_byte(byte, now);
    }
  }
  /// The next byte arrives this long after the last one.
  void wait(std::uint32_t us) { now += us - kByteUs; }
  /// Just longer than a gap.
  void gap() { wait(gap_us + 1); }

  /// The response after t3.5 of silence; it has been sent then.
  Bytes response() {
    return execute(server, now += kSilenceUs);
  }
  Bytes ask(const Bytes& request) {
    gap();
    send(request);
    return response();
  }
  /// A request is waiting for its silence.
  bool request_waits() { return server.poll(now) != RtuServer::kNoRequest; }

  std::uint32_t gap_us;
  std::array<std::uint16_t, kNetworks * regmap::kRegisterFileWords> words{};
  std::array<RegisterRange, kNetworks> ranges = [this] {
    std::array<RegisterRange, kNetworks> all;
    for (std::size_t i = 0; i < kNetworks; ++i)
      all[i] = {0, std::span(words).subspan(i * regmap::kRegisterFileWords, regmap::kRegisterFileWords)};
    return all;
  }();
  std::array<RegisterMap, kNetworks> maps = [this]<std::size_t... i>(std::index_sequence<i...> /*networks*/) {
    return std::array{RegisterMap(std::span(ranges).subspan(i, 1))...};
  }
  (std::make_index_sequence<kNetworks>());
  RtuServer server;
  std::uint32_t now = 1'000'000;
};

/// For a port whose times are not those of the line: silence may go undetected.
inline RtuServer::Settings late_port() {
  RtuServer::Settings settings;
  settings.gap_us = 20'000;
  return settings;
}

struct Line : LineOf<1> {
  explicit Line(const RtuServer::Settings& settings = {}) : LineOf(settings) {}
};

/// Stations 17 and 18, unless the settings contain another one.
struct TwoNetworks : LineOf<2> {
  explicit TwoNetworks(const RtuServer::Settings& settings = {}) : LineOf(with_station(settings)) {}

  std::uint16_t& word(std::size_t network, std::size_t address) {
    return words[network * regmap::kRegisterFileWords + address];
  }
  std::uint16_t& first(std::size_t address) { return word(0, address); }
  std::uint16_t& second(std::size_t address) { return word(1, address); }

 private:
  static RtuServer::Settings with_station(RtuServer::Settings settings) {
    if (settings.station == 1) settings.station = 17;
    return settings;
  }
};

}  // namespace cbcan::test
