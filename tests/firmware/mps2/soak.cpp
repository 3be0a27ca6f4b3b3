// SPDX-License-Identifier: MIT
// A day of the board's time: the board's own image with its environment in memory, four CANopen nodes at the CAN
// port and a PLC program at the registers. Time, sleep, interrupts and the watchdog are those of the board; its two
// UARTs are not connected. Nothing may drift, leak or be lost, and the board's 32-bit counter wraps 20 times. Exit
// code 1 if something is wrong. Expected values are from docs/reference/contract.md, computed by hand.

#include <algorithm>
#include <array>
#include <initializer_list>
#include <span>

#include "boards/common/cortex_m.hpp"
#include "boards/common/ring.hpp"
#include "boards/common/semihosting.hpp"
#include "boards/mps2_an385/vectors.hpp"
#include "support/device.hpp"

namespace cbcan::test {

namespace {

using namespace cbcan::boards;

constexpr Time kRound = 60 * kSecond;
constexpr std::uint32_t kRounds = 1'440;
// The end is between the heartbeats of all nodes, so that their number is certain.
constexpr Time kDay = 86'400 * kSecond + 200 * kMillisecond;
constexpr std::uint32_t kWraps = 20;  ///< 86,400,000,000 / 2^32 = 20.1

constexpr std::uint32_t kOfSetUp = 7;   ///< transactions
constexpr std::uint32_t kOfRound = 22;  ///< of which two fail

constexpr std::uint16_t kNode = 2;     ///< a heartbeat every 1 s; 3: 1.3 s; 4: 1.7 s
constexpr std::uint16_t kGuarded = 5;  ///< none
constexpr std::uint16_t kAbsent = 6;

constexpr std::uint16_t kRead = 5055, kWrite = 5066;

// A message or a timeout may be due while a turn is busy with something else.
constexpr Time kMostOffBeat = 1'000, kMostLate = 300;
// A microsecond is 25 ticks, and the two counters are read one after the other.
constexpr std::uint32_t kTicksPerMicrosecond = 25, kMostTicksApart = 75;
/// An interrupt may occur when the stack is deeper than at any earlier one.
constexpr std::size_t kInterruptBytes = 96;

void tell(const char* what, std::uint64_t number) {
  semihosting::write("  ");
  semihosting::write(what);
  semihosting::write(": ");
  semihosting::write_hex(static_cast<std::uint32_t>(number >> 32));
  semihosting::write_hex(static_cast<std::uint32_t>(number));
  semihosting::write("h\n");
}

/// Ends the emulator with exit code 1 and a message, unless found is in least..most.
void check_range(std::uint64_t found, std::uint64_t least, std::uint64_t most, const char* what) {
  if (found >= least && found <= most) return;
  tell(what, found);
  tell("expected at least", least);
  tell("expected at most", most);
  semihosting::exit(1);
}
#define CHECK(found, expected) check_range(static_cast<std::uint64_t>(found), expected, expected, #found)

/// Messages that must always have the same period.
struct Beat {
  void on_message(Time now) {
    if (count++ == 0) expected = now;
    check_range(now, expected - kMostOffBeat, expected + kMostOffBeat, "time of a message, off its beat");
    expected += period;
  }
  Time period;
  Time expected = 0;
  std::uint32_t count = 0;
};

/// One direction of the bus.
struct Line final : CanPort {
  bool try_send(const Frame& frame) override { return frames.push(frame); }
  Ring<Frame, 64> frames;
};

/// Compares the board's microseconds with ticks of the system clock, counted down by an unused timer.
struct Reference {
  static constexpr std::uint32_t kControl = 0x00, kValue = 0x04, kReload = 0x08, kEnable = 1;
  void start(Time now) {
    timer.write(kReload, 0xFFFFFFFF);
    timer.write(kValue, 0xFFFFFFFF);
    timer.write(kControl, kEnable);
    last = timer.read(kValue);
    started = now;
  }
  /// Call it at least every 171 s: the timer has 32 bits.
  void check(Time now) {
    const std::uint32_t value = timer.read(kValue);
    ticks += last - value;
    last = value;
    const Time expected = (now - started) * kTicksPerMicrosecond;
    check_range(ticks + kMostTicksApart, expected, expected + 2 * kMostTicksApart, "ticks of the timer");
  }
  Mmio timer{0x40001000};  // TIMER1
  std::uint32_t last = 0;
  std::uint64_t ticks = 0;
  Time started = 0;
};

struct Bench final : Hardware {
  // Hardware.
  Time now() override { return time = board.now(); }
  bool receive(std::size_t /*network*/, Frame& frame) override {
    if (!to_coprocessor.frames.pop(frame)) return false;
    const std::uint32_t node = frame.id - 0x700 - kNode;
    if (node < heartbeats.size() && frame.data[0] != 0) heartbeats[node].on_message(time);
    return true;
  }
  BusState bus_state(std::size_t /*network*/) override { return BusState::kActive; }
  void respond(std::span<const std::uint8_t> /*response*/) override {}
  Health health(std::size_t network) override { return board.health(network); }

  void start() {
    CHECK(board.health(0).reset_cause, static_cast<unsigned>(regmap::ResetCause::kPowerOn));
    board.start(station.modbus());
    reference.start(board.now());
    station.start();
    for (Device& node : nodes)
      node.slave.start(board.now());
  }
  void run_until(Time end) {
    while (time < end)
      turn(end);
  }
  /// One turn of the board's loop, and of the nodes.
  void turn(Time end) {
    Time due = station.turn();
    if (time >= next_check) {
      reference.check(board.now());
      next_check = time + 100 * kMillisecond;
    }
    for (Frame frame; to_nodes.frames.pop(frame);) {
      if (frame.id == 0x080) sync.on_message(time);
      if (frame.id == 0x77F && frame.data[0] != 0) own_heartbeat.on_message(time);
      for (Device& node : nodes)
        node.slave.on_frame(frame, time);
    }
    for (Device& node : nodes)
      due = earlier(due, node.slave.poll(time));
    board.sleep_until(to_coprocessor.frames.empty() ? earlier(due, end) : time);
  }

  std::uint16_t& reg(unsigned address) { return station.registers().window[address - regmap::kWindowFirst]; }
  std::uint32_t value() { return reg(3706) | static_cast<std::uint32_t>(reg(3707)) << 16; }
  /// Writes R3701.. and CA0Eh; one turn begins the transaction.
  void begin(std::initializer_list<std::uint16_t> request) {
    std::copy(request.begin(), request.end(), &reg(3701));
    reg(3700) = 0xCA0E;
    turn(time);
    begun = time;
  }
  void await(std::uint16_t result) {
    while (reg(3700) == 0xCA0E)
      turn(begun + 10 * kSecond);
    CHECK(reg(3700), result);
  }
  void execute(std::initializer_list<std::uint16_t> request, std::uint16_t result = 0) {
    begin(request);
    await(result);
  }
  void read(std::uint16_t node, std::uint16_t index, std::uint16_t sub, std::uint32_t expected) {
    execute({kRead, node, index, sub, 4, 0, 0});
    CHECK(value(), expected);
  }
  void await_timeout() {
    await(4);
    CHECK(value(), 0x05040000);
    check_range(time - begun, kSecond, kSecond + kMostLate, "us until a timeout");
  }

  Time time = 0;  ///< of the last turn
  Time begun = 0;
  Time next_check = 0;
  mps2::Board board{{115'200, 115'200, 500}, mps2::take_reset_cause()};
  Line to_nodes, to_coprocessor;
  Station<> station{*this, {&to_nodes}, {}};
  std::array<Device, 4> nodes{Device{kNode, to_coprocessor, 1000}, Device{kNode + 1, to_coprocessor, 1300},
                              Device{kNode + 2, to_coprocessor, 1700}, Device{kGuarded, to_coprocessor}};
  Reference reference;
  std::array<Beat, 3> heartbeats{Beat{1000 * kMillisecond}, Beat{1300 * kMillisecond},
                                 Beat{1700 * kMillisecond}};
  Beat own_heartbeat{2 * kSecond};
  Beat sync{kSecond};
} bench;

mps2::Board& the_board() {
  return bench.board;
}
[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<the_board>();

void set_up() {                                               // 7
  bench.execute({kWrite, 0, 0x1016, 1, 4, 0x05DC, 2});        // node 2: 1,500 ms
  bench.execute({kWrite, 0, 0x1016, 2, 4, 0x07D0, 3});        // node 3: 2 s
  bench.execute({kWrite, 0, 0x1016, 3, 4, 0x09F6, 4});        // node 4: 2,550 ms
  bench.execute({kWrite, 0, 0x1016, 4, 4, 0x03E8, kAbsent});  // 1 s
  bench.execute({kWrite, 0, 0x1017, 0, 2, 2'000});
  bench.execute({kWrite, 0, 0x1006, 0, 4, 0x4240, 0x000F});  // 1 s
  bench.execute({kWrite, 0, 0x1005, 0, 4, 0x0080, 0x4000});
}

void expedited(std::uint16_t round) {  // 8
  for (std::uint16_t node = kNode; node <= kGuarded; ++node) {
    bench.execute({kWrite, node, 0x2000, 0, 4, round, node});
    bench.read(node, 0x2000, 0, static_cast<std::uint32_t>(node) << 16 | round);
  }
}

void block(std::uint16_t round) {  // 4
  bench.execute({kWrite, 0, 0x3004, 0, 1, 3});
  const auto data = std::span(&bench.reg(3706), 64);
  for (std::size_t i = 0; i < data.size(); ++i)
    data[i] = static_cast<std::uint16_t>(1031 * i + round);
  bench.execute({kWrite, kNode + 1, 0x2002, 0, 128});
  std::ranges::fill(data, std::uint16_t{0});
  bench.execute({kRead, kNode + 1, 0x2002, 0, 128});
  for (std::size_t i = 0; i < data.size(); ++i)
    CHECK(data[i], static_cast<std::uint16_t>(1031 * i + round));
  bench.execute({kWrite, 0, 0x3004, 0, 1, 0});
}

/// All nodes by one command; then their states from heartbeats, and of one node by guarding.
void all_nodes(std::uint16_t round) {  // 8
  const std::uint16_t state = round % 2 == 0 ? 5 : 127;
  bench.execute({kWrite, 0, 0x1F82, 128, 2, state});
  bench.run_until(bench.time + 2 * kSecond);
  for (std::uint16_t node = kNode; node <= kGuarded; ++node)
    bench.read(node, 0x300C, 0, state);
  for (std::uint16_t node = kNode; node < kGuarded; ++node)
    bench.read(0, 0x3007, node, state == 5 ? 5 : 3);
}

void failures() {  // 2
  bench.execute({kRead, kNode, 0x3333, 0, 4}, 4);
  CHECK(bench.value(), 0x06020000);
  bench.begin({kRead, kAbsent, 0x2000, 0, 4});
  bench.await_timeout();
}

/// The counter wraps in the middle of a timeout.
void cross(Time wrap) {  // 1, failed
  bench.run_until(wrap - 500 * kMillisecond);
  bench.begin({kRead, kAbsent, 0x2000, 0, 4});
  bench.await_timeout();
}

void check_day() {
  CHECK(bench.heartbeats[0].count, 86'400);
  CHECK(bench.heartbeats[1].count, 66'461);
  CHECK(bench.heartbeats[2].count, 50'823);
  CHECK(bench.own_heartbeat.count, 43'200);
  CHECK(bench.sync.count, 86'400);
  const Coprocessor& coprocessor = bench.station.coprocessor();
  const NodeMonitor::Counters& monitor = coprocessor.node_monitor().counters();
  CHECK(monitor.boot_ups, 4);
  CHECK(monitor.heartbeats, 86'400 + 66'461 + 50'823 + kRounds);  // one in each round by guarding
  CHECK(monitor.ignored, 0);
  const SdoClient::Counters& sdo = coprocessor.sdo_client().counters();
  CHECK(sdo.timeouts, kRounds + kWraps);
  CHECK(sdo.aborts_received, kRounds);
  CHECK(sdo.late + sdo.unexpected + sdo.other_object + sdo.repeated_blocks, 0);
  CHECK(coprocessor.counters().executed, kRounds * kOfRound + kWraps + kOfSetUp);
  CHECK(coprocessor.counters().failed, kRounds * 2 + kWraps);
  CHECK(bench.to_nodes.frames.overflows() + bench.to_coprocessor.frames.overflows(), 0);
  constexpr std::uint32_t kControl = 8, kInterruptAndReset = 3;
  CHECK(Mmio(0x40008000).read(kControl), kInterruptAndReset);  // the watchdog is armed
}

void run() {
  constexpr Time kWrap = Time{1} << 32;
  bench.start();
  const Time start = bench.board.now();
  set_up();
  std::uint32_t wraps = 0;
  std::size_t first_stack = 0;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    const Time at = start + kSecond + round * kRound;
    if (kWrap * (wraps + 1) < at + kRound) cross(kWrap * ++wraps);
    bench.run_until(at);
    expedited(static_cast<std::uint16_t>(round));
    block(static_cast<std::uint16_t>(round));
    all_nodes(static_cast<std::uint16_t>(round));
    failures();
    if (round == 0) first_stack = stack_high_water();
    if (round % 240 == 0) tell("hours", round / 60);
  }
  bench.run_until(start + kDay);
  CHECK(wraps, kWraps);
  check_day();
  check_range(stack_high_water(), 1, first_stack + kInterruptBytes, "bytes of stack");
  tell("bytes of stack", stack_high_water());
}

}  // namespace

}  // namespace cbcan::test

int main() {
  cbcan::test::run();
  cbcan::boards::semihosting::write("passed  a day\n");
  cbcan::boards::semihosting::exit(0);
}
