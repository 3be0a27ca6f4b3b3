// SPDX-License-Identifier: MIT
#include "boards/stm32/settings.hpp"

#include "support/catch.hpp"

namespace cbcan {

using boards::stm32::response_delay_us;
using boards::stm32::SerialFormat;

TEST_CASE("Response delay: t3.5 after the last stop bit, by a clock 5 % fast too; a setting lengthens it") {
  // RXNE comes in the stop bit: t3.5, 1.5 bits or 2, and 5 %.
  for (const std::uint32_t setting : {0u, 1000u}) {
    CHECK(response_delay_us(19'200, SerialFormat::k8E1, setting) >= 2188);  // 2006 us and 1.5 bits of 52 us
    CHECK(response_delay_us(19'200, SerialFormat::k8E1, setting) < 2300);
    CHECK(response_delay_us(115'200, SerialFormat::k8N1, setting) >= 1852);  // 1750 us
    CHECK(response_delay_us(115'200, SerialFormat::k8N1, setting) < 1900);
  }
  CHECK(response_delay_us(19'200, SerialFormat::k8E1, 50'000) == 50'000);
}

TEST_CASE("Settings of the board: as registers and back, and words that are none") {
  using namespace boards::stm32;
  Settings settings;
  settings.station = 247;
  settings.baud = 9'600;
  settings.format = SerialFormat::k8O1;
  settings.response_delay_us = 50'000;
  settings.can_bit_rate = 10'000;
  settings.node_id = 1;
  CHECK(words_of(settings) == Words{247, 96, 1, 50'000, 10, 1});
  const auto back = settings_of(words_of(settings));
  REQUIRE(back);
  CHECK(words_of(*back) == words_of(settings));
  const auto line = station_settings(*back, {}).modbus;
  CHECK(line.station == 247);
  CHECK(line.silence_us == 4011);  // 3.5 characters of 11 bits
  CHECK(line.gap_us == 20'000);    // the ST-LINK's
  settings.line = ModbusLine::kRs485;
  CHECK(station_settings(settings, {}).modbus.gap_us == 0);  // no extra gap: the silence applies
  CHECK(settings_of(Words{1, 5000, 3, 0, 1000, 127}));
  CHECK(settings_of(Words{1, 13, 0, 0, 800, 127}));
  for (const Words& none :
       {Words{0, 96, 0, 0, 500, 127}, Words{248, 96, 0, 0, 500, 127}, Words{1, 12, 0, 0, 500, 127},
        Words{1, 5001, 0, 0, 500, 127}, Words{1, 96, 4, 0, 500, 127}, Words{1, 96, 0, 50'001, 500, 127},
        Words{1, 96, 0, 0, 0, 127}, Words{1, 96, 0, 0, 300, 127}, Words{1, 96, 0, 0, 1001, 127},
        Words{1, 96, 0, 0, 500, 0}, Words{1, 96, 0, 0, 500, 128},
        Words{0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF}}) {
    INFO(none[0] << " " << none[1] << " " << none[2] << " " << none[3] << " " << none[4] << " " << none[5]);
    CHECK_FALSE(settings_of(none));
  }
}

}  // namespace cbcan
