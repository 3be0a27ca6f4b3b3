// SPDX-License-Identifier: MIT
#pragma once

/// What a plant may want otherwise. The image is built again after a change.

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
  std::uint32_t can_bit_rate = 500'000;  ///< bit/s
  bool hse_is_clock = true;              ///< 8 MHz from the ST-LINK; false = a crystal of 8 MHz
};

inline constexpr std::size_t kNetworks = 1;  ///< the driver runs CAN1
inline constexpr Settings kBoardSettings{};
/// Modbus station 1, CANopen node 127. A gap of 20 ms, as the ST-LINK passes bytes on in packets; on RS-485
/// leave it out.
inline constexpr std::uint32_t kSilence = rtu_silence_us(kBoardSettings.baud, bits(kBoardSettings.format));
inline constexpr Station<kNetworks>::Settings kStationSettings{
    .modbus = {.station = 1, .silence_us = kSilence, .gap_us = 20'000, .response_delay_us = 0},
    .coprocessors = {}};

}  // namespace cbcan::boards::stm32f4
