// SPDX-License-Identifier: MIT
#pragma once

/// What a Modbus client asks and is answered, as words, and as bytes from the unit ID on: those are the same
/// over TCP and over a serial line. Source: Modbus Application Protocol V1.1b3, section 6.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace cbcan::window {

/// One request for holding registers: FC 16 when it only writes, FC 3 when it only reads, FC 23, which writes
/// first, when it does both.
struct Request {
  std::uint16_t write_address = 0;
  std::vector<std::uint16_t> words{};  ///< to write
  std::uint16_t read_address = 0;
  std::uint16_t count = 0;  ///< of registers to read
};

struct Response {
  std::uint8_t exception = 0;          ///< its code; 0 = none
  std::vector<std::uint16_t> words{};  ///< as many as the request wanted
};

/// What the response to a request has to be.
struct Expected {
  std::uint8_t unit = 0;
  std::uint8_t function = 0;
  std::uint16_t words = 0;

  /// Bytes of the response from the unit ID on, by its first two bytes.
  std::size_t size(std::uint8_t function_code) const;
  /// None where `bytes`, from the unit ID on, are no such response.
  std::optional<Response> in(std::span<const std::uint8_t> bytes) const;
};

/// Unit ID and PDU.
std::vector<std::uint8_t> bytes_of(std::uint8_t unit, const Request& request);
Expected expected_by(std::uint8_t unit, const Request& request);

}  // namespace cbcan::window
