// SPDX-License-Identifier: MIT
#pragma once

/// What a plant may want otherwise. The image is built again after a change.

#include <algorithm>

#include "boards/common/station.hpp"
#include "boards/stm32f4/usart.hpp"

namespace cbcan::boards::stm32f4 {

enum class ModbusLine : std::uint8_t {
  kVirtualComPort,  ///< USART2, PA2 and PA3: through the ST-LINK to a PC
  kRs485,           ///< USART1, PA9 (D8) and PA10 (D2); PA8 (D7) switches the transceiver's driver on
};

struct Settings {
  ModbusLine line = ModbusLine::kVirtualComPort;
  std::uint32_t baud = 115'200;
  SerialFormat format = SerialFormat::k8E1;
  /// From a request to its response, where that should be more than t3.5, for masters whose transceivers are
  /// slow to listen; at most 50,000.
  std::uint32_t response_delay_us = 0;
  std::uint32_t can_bit_rate = 500'000;  ///< bit/s
  bool hse_is_clock = true;              ///< 8 MHz from the ST-LINK; false = a crystal of 8 MHz
};

/// From the USART's word of a request's last byte to the response: `setting_us`, t3.5 at least. It tells in
/// the middle of the first stop bit, and the RC oscillator may be 5 % fast.
constexpr std::uint32_t response_delay_us(std::uint32_t baud, SerialFormat format, std::uint32_t setting_us) {
  const std::uint32_t two_bits = 2'000'000 / baud;
  return std::max(setting_us, (rtu_silence_us(baud, bits(format)) + two_bits) * 21 / 20);
}

inline constexpr std::size_t kNetworks = 1;  ///< the driver runs CAN1
inline constexpr Settings kBoardSettings{};
/// Modbus station 1, CANopen node 127. A gap of 20 ms, as the ST-LINK passes bytes on in packets; on RS-485
/// leave it out.
inline constexpr std::uint32_t kSilence = rtu_silence_us(kBoardSettings.baud, bits(kBoardSettings.format));
inline constexpr std::uint32_t kDelay =
    response_delay_us(kBoardSettings.baud, kBoardSettings.format, kBoardSettings.response_delay_us);
inline constexpr Station<kNetworks>::Settings kStationSettings{
    .modbus = {.station = 1, .silence_us = kSilence, .gap_us = 20'000, .response_delay_us = kDelay},
    .coprocessors = {}};

}  // namespace cbcan::boards::stm32f4
