// SPDX-License-Identifier: MIT
#pragma once

/// What a plant may want to change: in the image, or in the board's registers (R4150..), which take effect
/// after 1010h has stored them and the board has been reset.

#include <algorithm>
#include <array>
#include <optional>
#include <span>

#include "boards/common/station.hpp"
#include "boards/stm32/rcc.hpp"
#include "boards/stm32/usart.hpp"
#include "cbcan/modbus/identification.hpp"
#include "cbcan/version.hpp"
#include "chip.hpp"

namespace cbcan::boards::stm32 {

enum class ModbusLine : std::uint8_t {
  kVirtualComPort,  ///< USART2, PA2 and PA3: through the ST-LINK to a PC
  kRs485,           ///< USART1, PA9 (D8) and PA10 (D2); PA8 (D7) switches the transceiver's driver on
};

struct Settings {
  ModbusLine line = ModbusLine::kVirtualComPort;
  std::uint32_t baud = 115'200;
  SerialFormat format = SerialFormat::k8E1;
  /// Time from a request to its response, if more than t3.5 is needed, for masters whose transceivers are
  /// slow to switch to receive; at most 50,000.
  std::uint32_t response_delay_us = 0;
  std::uint32_t can_bit_rate = 500'000;  ///< bit/s
  bool hse_is_clock = kHseIsClock;       ///< false = a crystal
  std::uint8_t station = 1;              ///< Modbus
  std::uint8_t node_id = 127;            ///< CANopen
};

inline constexpr std::size_t kNetworks = 1;  ///< the driver runs one controller
using TheStation = Station<kNetworks>;
inline constexpr modbus::Identification kIdentification({"cbcan", kProduct, kVersion});
inline constexpr Settings kBoardSettings{};

// ---- As registers

using Words = std::array<std::uint16_t, regmap::kBoardWords>;
inline constexpr std::uint32_t kBaudUnit = 100, kBitRateUnit = 1000;

constexpr Words words_of(const Settings& settings) {
  return {settings.station,
          static_cast<std::uint16_t>(settings.baud / kBaudUnit),
          static_cast<std::uint16_t>(settings.format),
          static_cast<std::uint16_t>(settings.response_delay_us),
          static_cast<std::uint16_t>(settings.can_bit_rate / kBitRateUnit),
          settings.node_id};
}

/// The settings from these words, the rest from the image; none = the words are invalid.
constexpr std::optional<Settings> settings_of(std::span<const std::uint16_t> words) {
  constexpr std::uint32_t kLeastBaud = 1'221, kMostBaud = 500'000;  // with a bus clock of 80 MHz, of 16 MHz
  Settings settings = kBoardSettings;
  settings.station = static_cast<std::uint8_t>(words[0]);
  settings.baud = words[1] * kBaudUnit;
  settings.format = static_cast<SerialFormat>(words[2]);
  settings.response_delay_us = words[3];
  settings.can_bit_rate = words[4] * kBitRateUnit;
  settings.node_id = static_cast<std::uint8_t>(words[5]);
  const bool valid = words[0] - 1u < 247 && settings.baud >= kLeastBaud && settings.baud <= kMostBaud &&
                     words[2] <= static_cast<std::uint16_t>(SerialFormat::k8N2) &&
                     settings.response_delay_us <= 50 * kMillisecond && words[5] - 1u < nmt::kMaxNode &&
                     settings.can_bit_rate <= 1'000'000 &&
                     Can<Mmio>::timing(kHseClocks.apb1, settings.can_bit_rate).has_value();
  return valid ? std::optional(settings) : std::nullopt;
}

static_assert(settings_of(words_of(kBoardSettings)),
              "settings.hpp: one of kBoardSettings is none that the board can do with (R4150.. in "
              "docs/reference/registers.md)");

// ---- Derived values

/// Interrupt priorities, highest first: a byte in the USART can wait for one character, the CAN controller
/// for three frames.
inline constexpr std::uint8_t kModbusPriority = 0, kOthersPriority = 1;

/// Time from the USART's interrupt for a request's last byte to the response: `setting_us`, at least t3.5.
/// The interrupt comes in the middle of the first stop bit, and the RC oscillator may be 5 % fast.
constexpr std::uint32_t response_delay_us(std::uint32_t baud, SerialFormat format, std::uint32_t setting_us) {
  const std::uint32_t two_bits = 2'000'000 / baud;
  return std::max(setting_us, (rtu_silence_us(baud, bits(format)) + two_bits) * 21 / 20);
}

/// The gap is t3.5 at the baud rate; the ST-LINK forwards bytes in packets, so there it is at least 20 ms.
/// `board`: the registers of the board's settings.
constexpr TheStation::Settings station_settings(const Settings& settings, std::span<std::uint16_t> board) {
  TheStation::Settings station;
  station.modbus = {
      .station = settings.station,
      .silence_us = rtu_silence_us(settings.baud, bits(settings.format)),
      .gap_us = settings.line == ModbusLine::kVirtualComPort ? 20'000u : 0u,
      .response_delay_us = response_delay_us(settings.baud, settings.format, settings.response_delay_us),
      .more = &kIdentification};
  station.coprocessors[0].node_id = settings.node_id;
  station.board = board;
  return station;
}

}  // namespace cbcan::boards::stm32
