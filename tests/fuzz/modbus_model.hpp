// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace cbcan::fuzz {

/// The correct behaviour of a Modbus TCP server with a stream of bytes, written from the specification (Modbus
/// Application Protocol V1.1b3; Messaging on TCP/IP Implementation Guide V1.0b), independently of the product.
struct ModbusModel {
  static constexpr std::size_t kRegisters = 4168;
  using Bytes = std::vector<std::uint8_t>;
  using View = std::span<const std::uint8_t>;

  explicit ModbusModel(std::vector<std::uint16_t> at_start) : registers(std::move(at_start)) {}

  void receive(View bytes);

  /// All expected responses so far.
  const Bytes& responses() const { return responses_; }
  /// The stream is not Modbus: the connection ends after the responses.
  bool closed() const { return closed_; }
  /// The last request is not complete.
  bool waits() const { return !closed_ && !rest_.empty(); }
  /// Requests to the only network.
  std::size_t requests() const { return requests_; }

  std::vector<std::uint16_t> registers;  ///< R0..R4167

 private:
  void respond(View request);
  Bytes response_to(View pdu);
  Bytes read(View pdu);
  Bytes write_one(View pdu);
  Bytes write_many(View pdu);
  Bytes mask(View pdu);
  Bytes read_write(View pdu);
  void store(std::size_t address, View values);
  Bytes load(std::uint8_t function, std::size_t address, std::size_t count) const;

  Bytes rest_;
  Bytes responses_;
  std::size_t requests_ = 0;
  bool closed_ = false;
};

/// Initial values of the registers; nearly all are different.
inline const std::vector<std::uint16_t> kAtStart = [] {
  std::vector<std::uint16_t> values(ModbusModel::kRegisters);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::uint16_t>(i * 40503);
  return values;
}();

}  // namespace cbcan::fuzz
