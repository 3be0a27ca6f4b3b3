// SPDX-License-Identifier: MIT
// Expected register values derived by hand from the bit definitions of RM0390, 25.6; those of the STM32G4 are
// the same.

#include "boards/stm32/usart.hpp"

#include "boards/model_registers.hpp"
#include "boards/stm32/usart_model.hpp"
#include "support/catch.hpp"

using cbcan::boards::stm32::SerialFormat;
using cbcan::test::UsartModel;

namespace {

namespace numbers = cbcan::test::numbers;
using Bytes = std::vector<std::uint8_t>;

struct UsartRig {
  UsartModel model;
  cbcan::boards::stm32::Usart<cbcan::test::ModelRegisters<UsartModel>> usart{
      cbcan::test::ModelRegisters<UsartModel>(model)};
  Bytes received;
  int sent = 0;
  int broken = 0;

  UsartRig() { REQUIRE(usart.init(40'000'000, 19'200, SerialFormat::k8E1)); }

  void on_byte(std::uint8_t byte) { received.push_back(byte); }
  void on_broken_byte() { ++broken; }
  void on_sent() { ++sent; }

  /// Serves interrupts while the interrupt line is active.
  void serve() {
    for (int i = 0; model.line(); ++i) {
      REQUIRE(i < 10);
      usart.on_interrupt(*this);
    }
  }
  void receive(std::uint8_t byte, std::uint32_t faults = UsartModel::kGood) {
    model.receive(byte, faults);
    serve();
  }
};

}  // namespace

TEST_CASE("USART: format and baud rate") {
  UsartRig rig;
  CHECK(rig.model.read(numbers::kBrr) == 0x823);  // 40 MHz / 19200 = 2083.33
  CHECK(rig.model.read(numbers::kCr1) ==
        (numbers::kUe | 0x142C));  // UE, M, PCE, RXNEIE, TE, RE; PS = 0: even
  CHECK(rig.model.read(numbers::kCr2) == 0);
  REQUIRE(rig.usart.init(40'000'000, 115'200, SerialFormat::k8N1));
  CHECK(rig.model.read(numbers::kBrr) == 0x15B);  // 347.22
  CHECK(rig.model.read(numbers::kCr1) == (numbers::kUe | 0x002C));
  CHECK(rig.model.read(numbers::kCr2) == 0);
  REQUIRE(rig.usart.init(40'000'000, 19'200, SerialFormat::k8O1));
  CHECK(rig.model.read(numbers::kCr1) == (numbers::kUe | 0x162C));  // PS = 1: odd
  CHECK(rig.model.read(numbers::kCr2) == 0);
  REQUIRE(rig.usart.init(80'000'000, 9'600, SerialFormat::k8N2));
  CHECK(rig.model.read(numbers::kBrr) == 0x208D);  // 8333.33
  CHECK(rig.model.read(numbers::kCr1) == (numbers::kUe | 0x002C));
  CHECK(rig.model.read(numbers::kCr2) == 0x2000);  // STOP = 10
}

TEST_CASE("USART: a baud rate that the clock does not give is refused") {
  UsartRig rig;
  CHECK_FALSE(rig.usart.init(40'000'000, 0, SerialFormat::k8N1));
  CHECK_FALSE(rig.usart.init(40'000'000, 3'000'000, SerialFormat::k8N1));  // 13.3: below 16
  CHECK_FALSE(rig.usart.init(40'000'000, 600, SerialFormat::k8N1));        // 66667
  CHECK(rig.model.read(numbers::kBrr) == 0x823);                           // as before
}

TEST_CASE(
    "USART: bytes with parity or framing errors are reported as broken, noisy ones passed on; each is "
    "counted") {
  UsartRig rig;
  rig.receive(1, UsartModel::kParity);
  rig.receive(2, UsartModel::kFraming);
  rig.receive(3, UsartModel::kNoise);
  rig.receive(4, UsartModel::kFraming | UsartModel::kNoise);
  rig.receive(5);
  CHECK(rig.received == Bytes{3, 5});
  CHECK(rig.broken == 3);
  CHECK(rig.usart.counters().parity == 1);
  CHECK(rig.usart.counters().framing == 2);
  CHECK(rig.usart.counters().overrun == 0);
}

TEST_CASE("USART: an overrun is counted, and the bytes before it are reported as broken") {
  UsartRig rig;
  rig.model.receive(1);
  rig.model.receive(2);
  rig.serve();
  CHECK(rig.received.empty());
  CHECK(rig.broken == 1);
  CHECK(rig.usart.counters().overrun == 1);
  rig.receive(3);
  CHECK(rig.received == Bytes{3});
  CHECK(rig.usart.counters().overrun == 1);
}

TEST_CASE("USART: an overrun whose byte has been read before is cleared all the same") {
  UsartRig rig;
  rig.model.receive(1);
  rig.model.receive(2);
  rig.model.read(numbers::kRdr);  // RXNE gone, ORE still there
  rig.serve();
  CHECK(rig.received.empty());
  CHECK(rig.broken == 1);
  CHECK(rig.usart.counters().overrun == 1);
  CHECK_FALSE(rig.model.line());
}

TEST_CASE("USART: a response leaves byte by byte, and on_sent comes with the end of the last one") {
  UsartRig rig;
  const Bytes response{0x01, 0x03, 0x02, 0x00, 0xFF};
  rig.usart.send(response);
  rig.serve();
  Bytes wire;
  while (const auto byte = rig.model.shift_out()) {
    CHECK(rig.sent == 0);
    wire.push_back(*byte);
    rig.serve();
  }
  CHECK(wire == response);
  CHECK(rig.sent == 1);
  CHECK(rig.model.read(numbers::kCr1) == (numbers::kUe | 0x142C));  // TXEIE and TCIE off again
  CHECK_FALSE(rig.model.line());
}

TEST_CASE("USART: one byte alone, twice: TC of the one before does not end the next") {
  UsartRig rig;
  const Bytes first{0xAA}, second{0x55};
  for (const Bytes* response : {&first, &second}) {
    const int before = rig.sent;
    rig.usart.send(*response);
    rig.serve();
    CHECK(rig.sent == before);
    CHECK(rig.model.shift_out() == response->front());
    rig.serve();
    CHECK(rig.sent == before + 1);
  }
}

TEST_CASE("USART: bytes that arrive while it sends are handed on") {
  UsartRig rig;
  const Bytes response{1, 2};
  rig.usart.send(response);
  rig.receive(0x77);
  CHECK(rig.model.shift_out() == 1);
  rig.receive(0x78);
  CHECK(rig.model.shift_out() == 2);
  rig.receive(0x79);
  CHECK(rig.received == Bytes{0x77, 0x78, 0x79});
  CHECK(rig.sent == 1);
}

TEST_CASE("USART: a response whose end is never reported is abandoned; one that is sent is not") {
  UsartRig rig;
  const Bytes response{1, 2, 3, 4, 5, 6, 7, 8};
  std::uint32_t now = 1'000'000;
  for (unsigned i = 1; i <= 2; ++i) {
    rig.usart.send(response);
    rig.serve();
    CHECK_FALSE(rig.usart.give_up(now));
    CHECK_FALSE(rig.usart.give_up(now += 17'160));  // ten characters take 5729 us; a quarter and 10 ms more
    CHECK(rig.usart.give_up(now += 1));
    CHECK_FALSE(rig.usart.is_sending());
    CHECK(rig.usart.counters().given_up == i);
    for (unsigned left = 0; left < 2; ++left)  // what was in the registers; the rest is dropped
      CHECK(rig.model.shift_out());
    CHECK_FALSE(rig.model.shift_out());
    CHECK_FALSE(rig.usart.give_up(now += 100'000));
    rig.usart.send(response);
    rig.serve();
    CHECK_FALSE(rig.usart.give_up(now += 16'000));
    while (rig.model.shift_out())
      rig.serve();
    now += 16'000;
  }
}
