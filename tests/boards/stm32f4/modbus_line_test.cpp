// SPDX-License-Identifier: MIT
// The RTU server on the USART's driver, as a board has them: when a response begins, and what takes a request
// back (MODBUS over Serial Line V1.02, 2.5.1.1). CRCs worked out apart from this project.

#include "boards/model_registers.hpp"
#include "boards/stm32f4/settings.hpp"
#include "boards/stm32f4/usart_model.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using boards::stm32f4::response_delay_us;
using boards::stm32f4::SerialFormat;
using test::UsartModel;
using Bytes = std::vector<std::uint8_t>;

const Bytes kWrite{0x01, 0x06, 0x00, 0x00, 0x00, 0x07, 0xC8, 0x08};

/// A line of 19200 baud, 8E1: 573 us for a character.
struct LineRig {
  static constexpr std::uint32_t kBaud = 19'200, kCharacterUs = 573, kSilenceUs = 2006;

  explicit LineRig(std::uint32_t longer_us = 0)
      : server(maps, {.silence_us = kSilenceUs,
                      .response_delay_us = response_delay_us(kBaud, SerialFormat::k8E1, longer_us)}) {
    REQUIRE(usart.init(16'000'000, kBaud, SerialFormat::k8E1));
  }

  void on_byte(std::uint8_t byte) { server.on_byte(byte, now); }
  void on_broken_byte() { server.on_broken_byte(now); }
  void on_sent() { server.on_sent(); }

  void hear(const Bytes& bytes, std::uint32_t faults = UsartModel::kGood) {
    for (const std::uint8_t byte : bytes) {
      now += kCharacterUs;
      model.receive(byte, faults);
      serve();
    }
  }
  void serve() {
    while (model.line())
      usart.on_interrupt(*this);
  }
  /// The loop, every microsecond: how long until the response's first bit, at most 100 ms; 0 = none.
  std::uint32_t response_begins_after() {
    for (std::uint32_t us = 1; us <= 100'000; ++us) {
      if (server.poll(now + us) != 0) continue;
      usart.send(server.execute());
      serve();
      return us;
    }
    return 0;
  }
  Bytes sent() {
    Bytes bytes;
    while (const auto byte = model.shift_out()) {
      bytes.push_back(*byte);
      serve();
    }
    return bytes;
  }

  std::uint32_t now = 1'000'000;
  std::array<std::uint16_t, 4> words{};
  std::array<RegisterRange, 1> ranges{{{0, words}}};
  std::array<RegisterMap, 1> maps{RegisterMap(ranges)};
  RtuServer server;
  UsartModel model;
  boards::stm32f4::Usart<test::ModelRegisters<UsartModel>> usart{test::ModelRegisters<UsartModel>(model)};
};

}  // namespace

TEST_CASE("Modbus line: a response begins t3.5 after the request's last stop bit, by a clock 5 % fast too") {
  LineRig rig;
  rig.hear(kWrite);
  // RXNE comes in the stop bit: 2006 us, 1.5 bits of 52 us, and 5 %.
  CHECK(rig.response_begins_after() >= 2188);
  CHECK(rig.words[0] == 7);
  CHECK(rig.sent() == kWrite);
}

TEST_CASE("Modbus line: a setting lengthens that, and does not shorten it") {
  for (const auto& [setting, least, most] : {std::array{0u, 2188u, 2300u}, std::array{1000u, 2188u, 2300u},
                                             std::array{50'000u, 50'000u, 50'000u}}) {
    INFO(setting << " us");
    LineRig rig(setting);
    rig.hear(kWrite);
    const std::uint32_t after = rig.response_begins_after();
    CHECK(after >= least);
    CHECK(after <= most);
  }
  static_assert(response_delay_us(115'200, SerialFormat::k8N1, 0) >= 1852);  // 1750 us, 1.5 bits, 5 %
  static_assert(response_delay_us(115'200, SerialFormat::k8N1, 0) < 1900);
}

TEST_CASE("Modbus line: a character behind the request takes it back, one received wrong too") {
  for (const std::uint32_t faults : {UsartModel::kGood, UsartModel::kParity, UsartModel::kFraming}) {
    INFO(faults);
    LineRig rig;
    rig.hear(kWrite);
    rig.hear({0x00}, faults);
    CHECK(rig.response_begins_after() == 0);
    CHECK(rig.words[0] == 0);
    rig.now += 100'000;
    rig.hear(kWrite);
    CHECK(rig.response_begins_after() != 0);
    CHECK(rig.words[0] == 7);
  }
}

TEST_CASE("Modbus line: two characters behind the request that the interrupt was late for take it back") {
  LineRig rig;
  rig.hear(kWrite);
  rig.model.receive(0x00);
  rig.model.receive(0x00);
  rig.serve();
  CHECK(rig.response_begins_after() == 0);
  CHECK(rig.words[0] == 0);
}

TEST_CASE("Modbus line: a character that was lost behind the last one takes the request back") {
  LineRig rig;
  rig.hear({kWrite.begin(), kWrite.end() - 1});
  rig.model.receive(kWrite.back());
  rig.model.receive(0x00);  // RXNE is still set: overrun
  rig.serve();
  CHECK(rig.response_begins_after() == 0);
  CHECK(rig.words[0] == 0);
}

TEST_CASE("Modbus line: a character received wrong ahead of a request, as where a driver is switched on") {
  LineRig rig;
  rig.hear({0x00}, UsartModel::kFraming);
  rig.hear(kWrite);
  CHECK(rig.response_begins_after() != 0);
  CHECK(rig.words[0] == 7);
}

TEST_CASE("Modbus line: a character received wrong within a request") {
  LineRig rig;
  rig.hear({kWrite.begin(), kWrite.begin() + 4});
  rig.hear({kWrite[4]}, UsartModel::kParity);  // the parity bit alone
  rig.hear({kWrite.begin() + 5, kWrite.end()});
  CHECK(rig.response_begins_after() == 0);
  CHECK(rig.words[0] == 0);
  CHECK(rig.server.counters().broken_frames == 1);
}

TEST_CASE("Modbus line: a response whose end is never told is given up, and the next request is heard") {
  LineRig rig;
  for (int i = 1; i <= 2; ++i) {
    rig.hear(kWrite);
    CHECK(rig.response_begins_after() != 0);
    CHECK_FALSE(rig.usart.give_up(rig.now));
    CHECK_FALSE(
        rig.usart.give_up(rig.now += 17'160));  // ten characters take 5729 us; a quarter and 10 ms more
    CHECK(rig.usart.give_up(rig.now += 1));
    CHECK_FALSE(rig.usart.is_sending());
    rig.on_sent();
    CHECK(rig.usart.counters().given_up == static_cast<unsigned>(i));
    CHECK(rig.sent().size() == 2);  // what it had got, the rest is gone
    CHECK_FALSE(rig.usart.give_up(rig.now += 100'000));
  }
}

TEST_CASE("Modbus line: one that leaves is not given up, however rarely the loop looks") {
  LineRig rig;
  for (int i = 0; i < 3; ++i) {
    rig.hear(kWrite);
    CHECK(rig.response_begins_after() != 0);
    CHECK_FALSE(rig.usart.give_up(rig.now += 16'000));
    CHECK(rig.sent() == kWrite);
    rig.now += 16'000;
  }
}

TEST_CASE("Settings of the board: as registers and back, and words that are none") {
  using namespace boards::stm32f4;
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
  CHECK(station_settings(settings, {}).modbus.gap_us == 0);  // so it is the silence
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
