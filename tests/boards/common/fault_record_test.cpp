// SPDX-License-Identifier: MIT
#include "boards/common/fault_record.hpp"

#include <cstring>

#include "boards/common/cortex_m.hpp"
#include "boards/common/indicators.hpp"
#include "support/catch.hpp"

using namespace cbcan;
using namespace cbcan::boards;
using Cause = regmap::ResetCause;

namespace {

using Words = std::array<std::uint16_t, regmap::kDiagnosticsWords>;

/// R4133..R4139.
std::vector<std::uint16_t> shown(const FaultRecord& record) {
  alignas(4) Words words{};
  record.show(words);
  return {words.begin() + 33, words.end()};
}

/// Memory after power on, or after a reset.
struct Memory {
  explicit Memory(int content) { std::memset(static_cast<void*>(&record), content, sizeof record); }
  FaultRecord record;
};

}  // namespace

TEST_CASE("Faults: after power on there are none, whatever the memory holds") {
  for (const int content : {0x00, 0xFF, 0xA5, 0x01}) {
    for (const Cause cause : {Cause::kPowerOn, Cause::kBrownOut, Cause::kSoftware, Cause::kPin}) {
      Memory memory(content);
      memory.record.start(cause);
      CHECK(shown(memory.record) == std::vector<std::uint16_t>(7));
      CHECK(memory.record.can_wait() == 0);
    }
  }
}

TEST_CASE("Faults: the registers that the core has stacked, if the stack was valid") {
  constexpr std::uint32_t kStacked[] = {0, 1, 2, 3, 12, 0x0800'0101, 0x0800'0202, 0x0100'0000};
  const Fault fault{3, 0x8200, 0x20, kStacked};
  CHECK((fault.lr() == 0x0800'0101 && fault.pc() == 0x0800'0202));
  const Fault without{3, 0x1000, 0, nullptr};
  CHECK((without.lr() == 0 && without.pc() == 0));
}

TEST_CASE("Faults: each is counted over resets, the last one is reported; the watchdog has no place") {
  Memory memory(0xFF);
  memory.record.start(Cause::kPowerOn);
  memory.record.note({0x08010203, 0x08020305, 0x02000000});
  memory.record.start(Cause::kSoftware);
  CHECK(shown(memory.record) == std::vector<std::uint16_t>{1, 0x0203, 0x0801, 0x0305, 0x0802, 0, 0x0200});
  memory.record.start(Cause::kWatchdog);
  CHECK(shown(memory.record) == std::vector<std::uint16_t>{2, 0, 0, 0, 0, 0, 0});
  memory.record.start(Cause::kPowerOn);
  CHECK(shown(memory.record)[0] == 0);
}

TEST_CASE("Faults: one before the record was started") {
  Memory memory(0xFF);
  memory.record.note({4, 5, 6});
  memory.record.start(Cause::kSoftware);
  CHECK(shown(memory.record) == std::vector<std::uint16_t>{1, 4, 0, 5, 0, 6, 0});
}

TEST_CASE(
    "Faults: each one in a row keeps the board longer off the bus; a good run or the reset pin ends that") {
  Memory memory(0);
  memory.record.start(Cause::kPowerOn);
  for (const Time seconds : std::initializer_list<Time>{1, 2, 4, 8, 16, 32, 64, 64, 64}) {
    memory.record.note({1, 2, 3});
    memory.record.start(Cause::kSoftware);
    CHECK(memory.record.can_wait() == seconds * kSecond);
  }
  memory.record.on_good();
  CHECK(memory.record.can_wait() == 0);
  CHECK(shown(memory.record)[0] == 9);
  memory.record.start(Cause::kWatchdog);
  CHECK(memory.record.can_wait() == kSecond);
  memory.record.start(Cause::kPin);
  CHECK(memory.record.can_wait() == 0);
  CHECK(shown(memory.record)[0] == 10);
}

TEST_CASE("Indicators: the patterns of CiA 303-3, in steps of 200 ms") {
  struct Row {
    nmt::State state;
    BusState bus;
    const char *run, *error;
  };
  for (const Row& row :
       {Row{nmt::State::kInitialising, BusState::kActive, "000000000000", "000000000000"},
        Row{nmt::State::kPreOperational, BusState::kBusOff, "101010101010", "111111111111"},
        Row{nmt::State::kStopped, BusState::kErrorPassive, "100000100000", "100000100000"},
        Row{nmt::State::kOperational, BusState::kOverflow, "111111111111", "100000100000"}}) {
    Indicators indicators;
    std::string run, error;
    Time due = 5;
    for (int step = 0; step < 12; ++step) {
      const Time now = due;
      due = indicators.poll(row.state, row.bus, now);
      CHECK(due == now + 200'000);
      CHECK(indicators.poll(row.state, row.bus, due - 1) == due);  // the same step
      run += indicators.run() ? '1' : '0';
      error += indicators.error() ? '1' : '0';
    }
    CHECK(run == row.run);
    CHECK(error == row.error);
  }
}
