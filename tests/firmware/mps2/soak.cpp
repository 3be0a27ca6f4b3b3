// SPDX-License-Identifier: MIT
// A day of the board's time: a PLC program that uses every service once a minute, with nodes that have
// heartbeats. Nothing may drift, leak or be lost, and the board's 32-bit counter wraps 20 times on the way.
// Exit code 1 when something is wrong. Expected values are from docs/reference/contract.md and worked out by hand.

#include <algorithm>

#include "bench.hpp"
#include "boards/common/cortex_m.hpp"
#include "boards/common/semihosting.hpp"
#include "client.hpp"

namespace cbcan::test {

namespace {

constexpr Time kRound = 60 * kSecond;
constexpr std::uint32_t kRounds = 1'440;
// The end lies between the beats of all nodes, so that their number is certain.
constexpr Time kDay = 86'400 * kSecond + 200 * kMillisecond;

constexpr std::uint32_t kOfRound = 35;  ///< transactions
constexpr std::uint32_t kFailuresOfRound = 4;
constexpr std::uint32_t kOfSetUp = 7;
constexpr std::uint32_t kWraps = 20;  ///< 86,400,000,000 / 2^32 = 20.1

/// A timeout is told in the turn that follows it, and a turn may just be busy with something else.
constexpr Time kMostLate = 300;

/// An interrupt may come where the stack is deeper than at any one before.
constexpr std::size_t kInterruptBytes = 96;

constexpr std::uint8_t kSelf = 0;
constexpr std::uint8_t kNode = Bench::kFirstNode;
constexpr std::uint8_t kGuarded = Bench::kGuarded;
constexpr std::uint8_t kAbsent = Bench::kAbsent;

Client client;
std::array<std::uint8_t, 128> pattern;
std::size_t first_stack = 0;  ///< bytes, in the first round
std::uint32_t latest = 0;     ///< timeout, in us

/// Other bytes each round, so that nothing old passes for new.
std::span<const std::uint8_t> bytes_of(std::uint32_t round, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i)
    pattern[i] = static_cast<std::uint8_t>(7 * i + 3 * round + (round >> 8) + 1);
  return std::span(pattern).first(size);
}

void write(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::uint32_t value, std::size_t size) {
  std::array<std::uint8_t, 4> bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i, value >>= 8)
    bytes[i] = static_cast<std::uint8_t>(value);
  CHECK(client.write(node, index, sub, std::span(bytes).first(size)), 0);
}

/// Writes and reads back.
void transfer(std::uint8_t node, std::uint16_t index, std::span<const std::uint8_t> bytes) {
  CHECK(client.write(node, index, 0, bytes), 0);
  CHECK(client.read(node, index, 0, 128), 0);
  CHECK(client.size(), bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i)
    CHECK(client.byte(i), bytes[i]);
}

void check_number(std::uint8_t node, std::uint16_t index, std::uint8_t sub, std::size_t size,
                  std::uint32_t expected) {
  CHECK(client.read(node, index, sub, 4), 0);
  CHECK(client.size(), size);
  std::uint32_t value = 0;
  for (std::size_t i = size; i-- > 0;)
    value = value << 8 | client.byte(i);
  CHECK(value, expected);
}

void command(std::uint8_t node, std::uint16_t service) {
  const std::array<std::uint8_t, 2> bytes{static_cast<std::uint8_t>(service),
                                          static_cast<std::uint8_t>(service >> 8)};
  CHECK(client.write(kSelf, 0x1F82, node, bytes), 0);
}

void check_state(std::uint8_t node, std::uint32_t expected) {
  check_number(node, 0x300C, 0, 1, expected);
}

/// The last transaction has ended with a timeout, `after` its time began.
void check_timeout(Time since, Time after) {
  CHECK(client.abort_code(), 0x05040000);
  CHECK(bench.ended >= since + after, true);
  const Time late = bench.ended - since - after;
  check_at_most(late, kMostLate, "us that a timeout came late");
  latest = std::max(latest, static_cast<std::uint32_t>(late));
}

// ---- Parts of a round, with their transactions ----

void set_up() {                             // 7
  write(kSelf, 0x1016, 1, 0x0002'05DC, 4);  // node 2: 1,500 ms
  write(kSelf, 0x1016, 2, 0x0003'07D0, 4);  // node 3: 2 s
  write(kSelf, 0x1016, 3, 0x0004'09F6, 4);  // node 4: 2,550 ms
  write(kSelf, 0x1016, 4, 0x0006'03E8, 4);  // the absent one: 1 s
  write(kSelf, 0x1017, 0, 2'000, 2);
  write(kSelf, 0x1006, 0, 1'000'000, 4);
  write(kSelf, 0x1005, 0, 0x4000'0080, 4);
}

void expedited(std::uint32_t round) {  // 8
  for (std::uint8_t node = kNode; node <= kGuarded; ++node)
    transfer(node, 0x2000, bytes_of(round + node, 4));
}

void segmented(std::uint32_t round) {  // 2
  transfer(kNode, 0x2001, bytes_of(round, 5 + round % 28));
}

void block(std::uint32_t round) {  // 4
  write(kSelf, 0x3004, 0, 3, 1);
  transfer(kNode + 1, 0x2002, bytes_of(round, 128));
  write(kSelf, 0x3004, 0, 0, 1);
}

void refused() {  // 2, failed: 2
  CHECK(client.read(kNode, 0x3333, 0, 4), 4);
  CHECK(client.abort_code(), 0x06020000);
  CHECK(client.write(kNode + 2, 0x2003, 0, bytes_of(0, 2)), 4);
  CHECK(client.abort_code(), 0x06010002);
}

/// All nodes by one command; then their heartbeats tell.
void all_nodes(std::uint32_t round) {  // 7
  const bool start = round % 2 == 0;
  command(128, start ? 5 : 127);
  bench.run_until(bench.time() + 2 * kSecond);
  for (std::uint8_t node = kNode; node < kGuarded; ++node) {
    check_state(node, start ? 5 : 127);
    check_number(kSelf, 0x3007, node, 1, start ? 5 : 3);
  }
}

void one_node() {  // 7
  const unsigned resets = bench.nodes[3].resets;
  command(kGuarded, 4);
  check_state(kGuarded, 4);
  command(kGuarded, 6);
  check_state(kGuarded, 127);
  CHECK(bench.nodes[3].resets, resets + 1);
  check_number(kGuarded, 0x2000, 0, 4, 0x12345678);  // as at power-on
  command(kGuarded, 5);
  check_state(kGuarded, 5);
}

void absent_node() {  // 3, failed: 1
  CHECK(client.read(kAbsent, 0x2000, 0, 4), 4);
  check_timeout(bench.begun, kSecond);
  check_state(kAbsent, 6);
  check_number(kSelf, 0x3007, kAbsent, 1, 7);
}

/// The next request to the node is held back for another SDO timeout.
void cancelled() {  // 2, failed: 1
  bench.run_until(bench.time() + 1'100 * kMillisecond);
  client.begin_read(kAbsent, 0x2000, 0, 4);
  bench.run_until(bench.time() + 200 * kMillisecond);
  client.cancel();
  const Time cancelled_at = bench.ended;
  bench.run_until(bench.time() + 100 * kMillisecond);
  CHECK(client.read(kAbsent, 0x2000, 0, 4), 4);
  check_timeout(cancelled_at, 2 * kSecond);
}

void uptime() {
  client.read_diagnostics();
  const Time up = client.number(regmap::kUptime) * kMillisecond;
  CHECK(up <= bench.time(), true);
  check_at_most(bench.time() - up, 999, "us between R4102 and the time");
}

void run_round(std::uint32_t round) {
  expedited(round);
  segmented(round);
  block(round);
  refused();
  all_nodes(round);
  one_node();
  absent_node();
  cancelled();
  uptime();
}

/// The counter wraps in the middle of a timeout and between two bytes of a request.
void cross(Time wrap) {  // 1, failed: 1
  bench.run_until(wrap - 500 * kMillisecond);
  client.begin_read(kAbsent, 0x2000, 0, 4);
  bench.run_until(wrap - 500);
  CHECK(client.poll(wrap + 200), 0xCA0E);
  CHECK(client.await_result(), 4);
  check_timeout(bench.begun, kSecond);
}

// ---- The end ----

void check_beats() {
  CHECK(bench.heartbeats[0].count(), 86'400);
  CHECK(bench.heartbeats[1].count(), 66'461);
  CHECK(bench.heartbeats[2].count(), 50'823);
  CHECK(bench.own_heartbeat.count(), 43'200);
  CHECK(bench.sync.count(), 86'400);
}

void check_coprocessor() {
  const Coprocessor& coprocessor = bench.station.coprocessor();
  const NodeMonitor::Counters& monitor = coprocessor.node_monitor().counters();
  CHECK(monitor.boot_ups, 4 + kRounds);
  CHECK(monitor.heartbeats, 86'400 + 66'461 + 50'823 + 2 * kRounds);  // one_node() has two by guarding
  CHECK(monitor.ignored, 0);
  const SdoClient::Counters& sdo = coprocessor.sdo_client().counters();
  CHECK(sdo.timeouts, 2 * kRounds + kWraps);
  CHECK(sdo.aborts_received, 2 * kRounds);
  CHECK(sdo.late + sdo.unexpected + sdo.other_object + sdo.repeated_blocks, 0);
}

void check_diagnostics() {
  const std::uint32_t requests = client.requests();
  client.read_diagnostics();
  CHECK(client.word(regmap::kResetCause), 1);  // power on: the watchdog has not been
  CHECK(client.number(regmap::kModbusRequests), requests);
  CHECK(client.number(regmap::kModbusCrcErrors), 0);
  CHECK(client.number(regmap::kModbusExceptions), 0);
  CHECK(client.number(regmap::kModbusLost), 0);
  CHECK(client.number(regmap::kCanReceived), bench.to_coprocessor.sent());
  CHECK(client.number(regmap::kCanRefused), 0);
  CHECK(bench.to_coprocessor.refused(), 0);
  CHECK(client.number(regmap::kCanLost), 0);
  CHECK(client.number(regmap::kCanErrors), 0);
  CHECK(client.number(regmap::kTransactions), kRounds * kOfRound + kWraps + kOfSetUp);
  CHECK(client.number(regmap::kTransactionsFailed), kRounds * kFailuresOfRound + kWraps);
  CHECK(client.number(regmap::kTransactionsCancelled), kRounds);
}

void check_watchdog_armed() {
  constexpr std::uint32_t kControl = 8, kInterruptAndReset = 3;
  CHECK(boards::Mmio(0x40008000).read(kControl), kInterruptAndReset);
}

void tell(const char* what, std::uint32_t number) {
  print("  ");
  print(what);
  print(": ");
  print(number);
  print("\n");
}

void report() {
  tell("transactions", client.number(regmap::kTransactions));
  tell("Modbus requests", client.requests());
  tell("CAN frames received", bench.received);
  tell("CAN frames sent", bench.to_nodes.sent());
  tell("heartbeats", bench.station.coprocessor().node_monitor().counters().heartbeats);
  tell("turns of the loop", bench.turns);
  tell("wraps of the counter", bench.wraps);
  tell("ticks (40 ns) from the reference at most", bench.reference.farthest());
  for (const Beat& beat : bench.heartbeats)
    tell("us that a heartbeat was off its beat at most", beat.farthest());
  tell("us that SYNC was off its beat at most", bench.sync.farthest());
  tell("us that a timeout came late at most", latest);
  tell("stack used in the first round", static_cast<std::uint32_t>(first_stack));
  tell("stack used", client.word(regmap::kStackUsed));
}

void run() {
  constexpr Time kWrap = Time{1} << 32;
  bench.start();
  const Time start = bench.board.now();
  set_up();
  check_at_most(bench.time() - start, 150 * kMillisecond, "us of set-up");
  Time wrap = kWrap;
  for (std::uint32_t round = 0; round < kRounds; ++round) {
    const Time at = start + kSecond + round * kRound;
    if (wrap < at + kRound) {
      cross(wrap);
      wrap += kWrap;
    }
    bench.run_until(at);
    run_round(round);
    if (round == 0) first_stack = boards::stack_high_water();
    if (round % 240 == 0) tell("hours", round / 60);
  }
  bench.run_until(start + kDay);
  CHECK(bench.wraps, kWraps);
  check_at_most(boards::stack_high_water(), first_stack + kInterruptBytes, "bytes of stack");
  check_beats();
  check_coprocessor();
  check_diagnostics();
  check_watchdog_armed();
  report();
}

}  // namespace

}  // namespace cbcan::test

int main() {
  cbcan::test::run();
  cbcan::test::print("passed  a day\n");
  cbcan::boards::semihosting::exit(0);
}
