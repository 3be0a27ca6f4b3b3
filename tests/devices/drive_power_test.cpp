// SPDX-License-Identifier: MIT
// The power state machine: every state and every command, and the option codes.

#include "drive_bench.hpp"

namespace cbcan::test {

using devices::PowerEvent;
using devices::PowerState;

namespace {

// Statuswords with voltage (0010h) and remote (0200h).
constexpr unsigned kSwitchOnDisabled = 0x0250;
constexpr unsigned kReadyToSwitchOn = 0x0231;
constexpr unsigned kSwitchedOn = 0x0233;
constexpr unsigned kOperationEnabled = 0x0237;
constexpr unsigned kQuickStopActive = 0x0217;
constexpr unsigned kFaultReactionActive = 0x021F;
constexpr unsigned kFault = 0x0218;

/// Without bits 10..13, which belong to the modes.
unsigned state_of(DriveBench& bench) {
  return bench.status() & ~0x3C00U;
}

/// Brings a new drive to the state of this statusword, at rest.
void bring_to(DriveBench& bench, unsigned state) {
  bench.put(0x605A, 0, 6);
  if (state == kSwitchOnDisabled) return void(bench.control(0x0000));
  if (state == kFault) {
    bench.incident("overcurrent", true);
    return void(bench.incident("overcurrent", false));
  }
  bench.control(0x0006);
  if (state == kReadyToSwitchOn) return;
  bench.control(0x0007);
  if (state == kSwitchedOn) return;
  bench.control(0x000F);
  if (state == kQuickStopActive) bench.control(0x000B);
}

struct Row {
  unsigned from;
  unsigned shutdown, switch_on, enable, disable_voltage, quick_stop, fault_reset;
};

}  // namespace

TEST_CASE("Delayed commands: of those within the delay the last is seen; a reset forgets it") {
  DriveBench bench;
  bench.control(0x0006);
  bench.drive.delay_commands(50 * kMillisecond);
  CHECK(state_of(bench.control(0x0007)) == kReadyToSwitchOn);
  bench.pass(30 * kMillisecond);
  CHECK(state_of(bench.control(0x000F)) == kReadyToSwitchOn);
  bench.pass(20 * kMillisecond);
  CHECK(state_of(bench) == kOperationEnabled);
  bench.control(0x0000);
  bench.drive.delay_commands(0);
  bench.control(0x0006);  // at once, and the one ahead is never seen
  CHECK(state_of(bench) == kReadyToSwitchOn);
  bench.pass(50 * kMillisecond);
  CHECK(state_of(bench) == kReadyToSwitchOn);
  bench.drive.delay_commands(50 * kMillisecond);
  bench.control(0x0007).control(0x0006);  // as before
  bench.pass(kSecond);
  CHECK(state_of(bench) == kReadyToSwitchOn);
  bench.control(0x0007);
  bench.put(0x6040, 0, 0);
  bench.drive.reset(true, bench.now);
  bench.pass(kSecond);
  CHECK(state_of(bench) == kSwitchOnDisabled);
}

TEST_CASE("Every state and every command") {
  constexpr std::array<Row, 6> kTable = {{
      // from            0006h   0007h   000Fh   0000h   0002h   0080h
      {kSwitchOnDisabled, 0x231, 0x250, 0x250, 0x250, 0x250, 0x250},
      {kReadyToSwitchOn, 0x231, 0x233, 0x237, 0x250, 0x250, 0x231},
      {kSwitchedOn, 0x231, 0x233, 0x237, 0x250, 0x250, 0x233},
      {kOperationEnabled, 0x231, 0x233, 0x237, 0x250, 0x217, 0x237},
      {kQuickStopActive, 0x217, 0x217, 0x237, 0x250, 0x217, 0x217},
      {kFault, 0x218, 0x218, 0x218, 0x218, 0x218, 0x250},
  }};
  constexpr std::array<std::uint16_t, 6> kWords = {0x0006, 0x0007, 0x000F, 0x0000, 0x0002, 0x0080};
  for (const Row& row : kTable) {
    const std::array<unsigned, 6> to = {row.shutdown,        row.switch_on,  row.enable,
                                        row.disable_voltage, row.quick_stop, row.fault_reset};
    for (std::size_t i = 0; i < kWords.size(); ++i) {
      DriveBench bench;
      bring_to(bench, row.from);
      INFO(std::hex << "from " << row.from << " by " << kWords[i]);
      REQUIRE(state_of(bench) == row.from);
      bench.control(kWords[i]);
      CHECK(state_of(bench) == to[i]);
    }
  }
}

TEST_CASE("Commands are the patterns of the controlword, whatever the bits that do not count") {
  struct Pattern {
    std::uint16_t word;
    PowerEvent command;
  };
  constexpr std::array<Pattern, 14> kPatterns = {{
      {0x0006, PowerEvent::kShutdown},
      {0xFF7E, PowerEvent::kShutdown},
      {0x0007, PowerEvent::kSwitchOn},
      {0xFF77, PowerEvent::kSwitchOn},
      {0x000F, PowerEvent::kEnableOperation},
      {0xFF7F, PowerEvent::kEnableOperation},
      {0x0000, PowerEvent::kDisableVoltage},
      {0xFF7D, PowerEvent::kDisableVoltage},
      {0x0002, PowerEvent::kQuickStop},
      {0xFF7B, PowerEvent::kQuickStop},
      {0x0080, PowerEvent::kFaultReset},
      {0xFFFF, PowerEvent::kFaultReset},
      {0x000E, PowerEvent::kShutdown},
      {0x000B, PowerEvent::kQuickStop},
  }};
  for (const Pattern& pattern : kPatterns) {
    INFO(std::hex << pattern.word);
    CHECK(devices::command_of(pattern.word, 0x0000) == pattern.command);
  }
  CHECK(devices::command_of(0x0080, 0x0080) == PowerEvent::kNone);
  CHECK(devices::command_of(0x008F, 0x0080) == PowerEvent::kNone);
}

TEST_CASE("A fault from every state without one") {
  for (int state = 0; state <= static_cast<int>(PowerState::kQuickStopActive); ++state)
    CHECK(devices::power_transition(static_cast<PowerState>(state), PowerEvent::kFault)->number == 13);
  for (const PowerState state : {PowerState::kFault, PowerState::kFaultReactionActive})
    CHECK(devices::power_transition(state, PowerEvent::kFault) == nullptr);
  CHECK(devices::status_of(PowerState::kNotReadyToSwitchOn) == 0x0000);
  CHECK(devices::status_of(PowerState::kSwitchOnDisabled) == 0x0040);
  CHECK(devices::status_of(PowerState::kFaultReactionActive) == 0x000F);
}

TEST_CASE("A drive comes up as Switch on disabled, and does so again after a reset") {
  DriveBench bench;
  CHECK(bench.status() == 0x0250);
  bench.enable(3);
  bench.put(0x6040, 0, 0);
  bench.drive.reset(true, bench.now);
  bench.update().shows({.status = 0x0250});
  bench.enable(3);
  bench.drive.reset(false, bench.now);
  bench.update();
  CHECK(state_of(bench) == kOperationEnabled);
}

TEST_CASE("Quick stop option codes: the ramp, and where it ends") {
  // 6084h 1,000,000/s^2: 100 ms; 6085h 4,000,000/s^2: 25 ms.
  const auto [code, during, stops, after] =
      GENERATE(table<int, unsigned, Time, unsigned>({{0, 0x250, 25'000, 0x250},
                                                     {1, 0x217, 100'000, 0x250},
                                                     {2, 0x217, 25'000, 0x250},
                                                     {3, 0x217, 25'000, 0x250},
                                                     {4, 0x217, 25'000, 0x250},
                                                     {5, 0x217, 100'000, 0x617},
                                                     {6, 0x217, 25'000, 0x617},
                                                     {7, 0x217, 25'000, 0x617},
                                                     {8, 0x217, 25'000, 0x617}}));
  INFO(code);
  DriveBench bench;
  bench.enable(3, {{0x605A, 0, code}, {0x60FF, 0, 100'000}});
  bench.pass(kSecond);
  REQUIRE(bench.velocity() == 100'000);
  bench.control(0x0002).shows({.status = during});
  bench.pass(stops - 1);
  CHECK(bench.get(0x606C) >= 1);
  CHECK(bench.status() == during);
  bench.pass(1).shows({.status = after, .velocity = 0});
  bench.control(0x000F);
  CHECK(state_of(bench) == (code >= 5 ? kOperationEnabled : kSwitchOnDisabled));
}

TEST_CASE("Shutdown and disable operation: at once, or after the slow down ramp") {
  const auto [object, code, word, during, after, stops] =
      GENERATE(table<std::uint16_t, int, std::uint16_t, unsigned, unsigned, Time>(
          {{0x605B, 0, 0x0006, kReadyToSwitchOn, kReadyToSwitchOn, 25'000},
           {0x605B, 1, 0x0006, kOperationEnabled, kReadyToSwitchOn, 100'000},
           {0x605C, 0, 0x0007, kSwitchedOn, kSwitchedOn, 25'000},
           {0x605C, 1, 0x0007, kOperationEnabled, kSwitchedOn, 100'000}}));
  INFO(object << " = " << code);
  DriveBench bench;
  bench.enable(3, {{object, 0, code}, {0x60FF, 0, -100'000}});
  bench.pass(kSecond);
  bench.control(word).shows({.status = during});
  bench.pass(stops - 1);
  CHECK(bench.velocity() <= -1);
  bench.pass(1).shows({.status = after, .velocity = 0});
}

TEST_CASE("Enable operation calls a ramp to Switched on off") {
  DriveBench bench;
  bench.enable(3, {{0x60FF, 0, 100'000}});
  bench.pass(kSecond);
  bench.control(0x0007);
  bench.pass(50'000).shows({.velocity = 50'000});
  bench.control(0x000F);
  bench.pass(50'000).shows({.velocity = 100'000});
  CHECK(state_of(bench) == kOperationEnabled);
}

TEST_CASE("Fault reaction option codes") {
  const auto [code, stops] =
      GENERATE(table<int, Time>({{0, 0}, {1, 100'000}, {2, 25'000}, {3, 25'000}, {4, 25'000}}));
  INFO(code);
  DriveBench bench;
  bench.enable(3, {{0x605E, 0, code}, {0x60FF, 0, 100'000}});
  bench.pass(kSecond);
  bench.incident("overtemperature", true);
  if (stops != 0) {
    CHECK(bench.status() == kFaultReactionActive);
    bench.pass(stops - 1).shows({.status = kFaultReactionActive});
    bench.pass(1).shows({.velocity = 0});
  }
  CHECK(bench.status() == kFault);
}

TEST_CASE(
    "Every fault: EMCY code, error register and 603Fh; a reset by the rising edge when its cause is gone") {
  const auto [name, told, code, status, over] =
      GENERATE(table<const char*, const char*, std::int64_t, unsigned, const char*>(
          {{"overcurrent", "2310/03", 0x2310, 0x0218, "2310 over"},
           {"short-circuit", "2320/03", 0x2320, 0x0218, "2320 over"},
           {"overvoltage", "3210/05", 0x3210, 0x0218, "3210 over"},
           {"undervoltage", "3220/05", 0x3220, 0x0208, "3220 over"},
           {"overtemperature", "4210/09", 0x4210, 0x0218, "4210 over"},
           {"encoder", "7305/21", 0x7305, 0x0218, "7305 over"},
           {"following-error", "8611/21", 0x8611, 0x0218, "8611 over"}}));
  INFO(name);
  DriveBench bench;
  bench.enable(3);
  bench.incident(name, true).shows({.status = status, .objects = {{0x603F, code}}});
  CHECK(bench.log == std::vector<std::string>{told});
  bench.control(0x0080).shows({.status = status});
  bench.incident(name, false);
  bench.control(0x0080).shows({.status = kFault});  // no edge
  bench.control(0x0000);
  bench.control(0x0080).shows({.status = kSwitchOnDisabled, .objects = {{0x603F, 0}}});
  CHECK(bench.log == std::vector<std::string>{told, over});
}

TEST_CASE("A fault is reported again after a reset of the application, if it is still there") {
  DriveBench bench;
  bench.incident("overvoltage", true);
  bench.log.clear();
  bench.drive.reset(true, bench.now);
  bench.update().shows({.status = kFault});
  CHECK(bench.log == std::vector<std::string>{"3210/05"});
}

TEST_CASE("A warning is bit 7 and nothing else") {
  DriveBench bench;
  bench.incident("warning", true).shows({.status = 0x02D0});
  bench.incident("warning", false).shows({.status = 0x0250});
  CHECK(bench.log.empty());
}

TEST_CASE("Abort connection option codes") {
  const auto [code, during, after, error] =
      GENERATE(table<int, unsigned, unsigned, std::int64_t>({{0, kOperationEnabled, kOperationEnabled, 0},
                                                             {1, kFaultReactionActive, kFault, 0x8130},
                                                             {2, kSwitchOnDisabled, kSwitchOnDisabled, 0},
                                                             {3, kQuickStopActive, kSwitchOnDisabled, 0}}));
  INFO(code);
  DriveBench bench;
  bench.enable(3, {{0x6007, 0, code}, {0x60FF, 0, 100'000}});
  bench.pass(kSecond);
  bench.network_failure(sim::NetworkFailure::kHeartbeat);
  CHECK(state_of(bench) == during);
  bench.pass(kSecond);
  CHECK(state_of(bench) == after);
  CHECK(bench.get(0x603F) == error);
  CHECK(bench.log.empty());  // the node sends the EMCY
}

TEST_CASE("NMT stop acts as 6007h on an enabled drive, and only there") {
  DriveBench bench;
  bench.state(nmt::State::kStopped).shows({.status = kSwitchOnDisabled});
  bench.enable(3);
  bench.state(nmt::State::kPreOperational);
  CHECK(state_of(bench) == kOperationEnabled);
  bench.state(nmt::State::kStopped).shows({.status = kFault, .objects = {{0x603F, 0x8100}}});
}

TEST_CASE("After the drive has stopped by itself the controlword counts again when it is written") {
  DriveBench bench;
  bench.enable(3, {{0x605A, 0, 6}, {0x6007, 0, 3}});
  bench.network_failure(sim::NetworkFailure::kGuarding);
  CHECK(state_of(bench) == kQuickStopActive);
  bench.pass(kSecond);
  CHECK(state_of(bench) == kQuickStopActive);  // although the controlword is still 000Fh
  CHECK(bench.write(0x6040, 0, 0x000F) == AbortCode::kNone);
  CHECK(state_of(bench) == kOperationEnabled);
}

TEST_CASE("A changed statusword is an event for TPDOs, and so is a changed mode") {
  DriveBench bench;
  bench.events.clear();
  bench.update();
  CHECK(bench.events.empty());
  bench.control(0x0006);
  CHECK(bench.events == std::vector<std::uint16_t>{0x6041});
  bench.events.clear();
  bench.set(0x6060, 0, 3);
  CHECK(bench.events == std::vector<std::uint16_t>{0x6061});
}

}  // namespace cbcan::test
