// SPDX-License-Identifier: MIT
#pragma once

/// Modbus frames by libmodbus: header or CRC, lengths, transaction numbers. Nothing here waits.

#include <array>
#include <cstdint>
#include <memory>
#include <span>

struct _modbus;  ///< modbus_t of modbus.h

namespace cbcan::window {

inline constexpr std::size_t kLongestFrame = 260;  ///< over TCP; 256 over a serial line

class Framing {
 public:
  using Bytes = std::span<const std::uint8_t>;

  /// Takes over what modbus_new_tcp() or modbus_new_rtu() has returned. Throws Error: kNoDescriptor.
  explicit Framing(_modbus* context);
  ~Framing();
  Framing(const Framing&) = delete;
  Framing& operator=(const Framing&) = delete;

  /// Sends unit ID and PDU, and discards bytes that were received before. False: errno says why not.
  bool send(int descriptor, Bytes request);
  /// Unit ID and PDU of a response, if `received` is one whole frame of the unit asked last, and undamaged;
  /// valid until the next call.
  Bytes response_in(Bytes received);

 private:
  std::unique_ptr<_modbus, void (*)(_modbus*)> context_;
  std::array<int, 2> pair_{-1, -1};
  std::array<std::uint8_t, kLongestFrame + 1> frame_{};
};

}  // namespace cbcan::window
