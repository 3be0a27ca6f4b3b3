// SPDX-License-Identifier: MIT
#include "bench.hpp"

#include <algorithm>

#include "boards/common/cortex_m.hpp"
#include "boards/common/semihosting.hpp"
#include "boards/mps2_an385/vectors.hpp"

namespace cbcan::test {

using namespace cbcan::boards;

Bench bench;

namespace {

constexpr std::uint32_t kTicksPerMicrosecond = 25;
// A microsecond is 25 ticks, and the two counters are read one after the other.
constexpr std::uint32_t kMostTicksApart = 75;
// A message may be due while a turn is busy with something else.
constexpr std::uint32_t kMostOffBeat = 1'000;
constexpr Time kCheckInterval = 100 * kMillisecond;

[[noreturn]] void fail(std::uint64_t found, const char* relation, std::uint64_t bound, const char* what) {
  print("soak: ");
  print(what);
  print(": found ");
  semihosting::write_hex(static_cast<std::uint32_t>(found >> 32));
  semihosting::write_hex(static_cast<std::uint32_t>(found));
  print(relation);
  semihosting::write_hex(static_cast<std::uint32_t>(bound >> 32));
  semihosting::write_hex(static_cast<std::uint32_t>(bound));
  print(" after ");
  print(static_cast<std::uint32_t>(bench.board.now() >> 6) / 15'625);  // a 64-bit division is a library's
  print(" s\n");
  semihosting::exit(1);
}

mps2::Board& the_board() {
  return bench.board;
}

[[gnu::section(".vectors"), gnu::used]] constinit const mps2::Vectors vectors = mps2::vectors_of<the_board>();

}  // namespace

void check(std::uint64_t found, std::uint64_t expected, const char* what) {
  if (found != expected) fail(found, ", expected ", expected, what);
}

void check_at_most(std::uint64_t found, std::uint64_t most, const char* what) {
  if (found > most) fail(found, ", expected at most ", most, what);
}

void print(const char* text) {
  semihosting::write(text);
}

void print(std::uint32_t number) {
  char text[11];
  char* digit = text + sizeof text - 1;
  *digit = 0;
  do {
    *--digit = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  print(digit);
}

void Beat::on_message(Time now) {
  if (count_++ == 0) expected_ = now;
  const auto apart = static_cast<std::uint32_t>(now > expected_ ? now - expected_ : expected_ - now);
  check_at_most(apart, kMostOffBeat, "us that a message is off its beat");
  farthest_ = std::max(farthest_, apart);
  expected_ += period_;
}

bool Line::try_send(const Frame& frame) {
  if (!frames_.push(frame)) return false;
  ++sent_;
  return true;
}

void Reference::start(Time now) {
  constexpr std::uint32_t kControl = 0x00, kValue = 0x04, kReload = 0x08, kEnable = 1;
  timer_.write(kReload, 0xFFFFFFFF);
  timer_.write(kValue, 0xFFFFFFFF);
  timer_.write(kControl, kEnable);
  last_ = timer_.read(kValue);
  started_ = now;
}

void Reference::check(Time now) {
  constexpr std::uint32_t kValue = 0x04;
  const std::uint32_t value = timer_.read(kValue);
  ticks_ += last_ - value;  // it counts down
  last_ = value;
  const Time expected = (now - started_) * kTicksPerMicrosecond;
  const Time apart = ticks_ > expected ? ticks_ - expected : expected - ticks_;
  check_at_most(apart, kMostTicksApart, "ticks between the board's time and the timer");
  farthest_ = std::max(farthest_, static_cast<std::uint32_t>(apart));
}

Bench::Bench()
    : board({115'200, 115'200, 500}, mps2::take_reset_cause()),
      station(*this, {&to_nodes}, {}),
      nodes{Device{kFirstNode, to_coprocessor, 1000}, Device{kFirstNode + 1, to_coprocessor, 1300},
            Device{kFirstNode + 2, to_coprocessor, 1700}, Device{kGuarded, to_coprocessor}} {}

void Bench::start() {
  CHECK(board.health(0).reset_cause, static_cast<unsigned>(regmap::ResetCause::kPowerOn));
  board.start(station.modbus());
  reference.start(board.now());
  station.start();
  for (Device& node : nodes)
    node.slave.start(board.now());
}

void Bench::run_until(Time end) {
  while (now_ < end)
    turn(end);
}

void Bench::put(std::span<const std::uint8_t> bytes) {
  const std::uint32_t count = counter_.read();
  for (const std::uint8_t byte : bytes)
    station.modbus().on_byte(byte, count);
}

std::span<const std::uint8_t> Bench::await_response() {
  for (const Time end = board.now() + 2 * kMillisecond; response_.empty(); turn(end))
    check_at_most(now_, end, "Modbus response");
  const auto end = std::copy(response_.begin(), response_.end(), received_response_.begin());
  response_ = {};
  station.modbus().on_sent();
  return {received_response_.begin(), end};
}

/// One turn of the board's loop, and of the nodes.
void Bench::turn(Time end) {
  Time due = station.turn();
  ++turns;
  watch();
  turn_nodes();
  for (Device& node : nodes)
    due = earlier(due, node.slave.poll(now_));
  if (!to_coprocessor.empty()) due = now_;
  if (!response_.empty()) due = now_;
  board.sleep_until(earlier(due, end));
}

void Bench::turn_nodes() {
  constexpr std::uint32_t kSync = 0x080, kOwnHeartbeat = 0x77F;
  Frame frame;
  while (to_nodes.receive(frame)) {
    if (frame.id == kSync) sync.on_message(now_);
    if (frame.id == kOwnHeartbeat && frame.data[0] != 0) own_heartbeat.on_message(now_);
    for (Device& node : nodes)
      node.slave.on_frame(frame, now_);
  }
}

/// What happened in the turn that has just been, by the time that it went by.
void Bench::watch() {
  if (now_ >= next_check_) {
    reference.check(board.now());
    const std::uint32_t count = counter_.read();
    if (count < last_count_) ++wraps;
    last_count_ = count;
    next_check_ = now_ + kCheckInterval;
  }
  const bool executing = station.registers().window[0] == regmap::kExecute;
  if (executing != executing_) (executing ? begun : ended) = now_;
  executing_ = executing;
}

bool Bench::receive(std::size_t /*network*/, Frame& frame) {
  if (!to_coprocessor.receive(frame)) return false;
  ++received;
  const std::uint32_t node = frame.id - 0x700 - kFirstNode;
  if (node < heartbeats.size() && frame.data[0] != 0) heartbeats[node].on_message(now_);
  return true;
}

Health Bench::health(std::size_t network) {
  Health health = board.health(network);
  health.can.received = received;
  health.can.sent = to_nodes.sent();
  health.can.refused = to_nodes.refused();
  return health;
}

}  // namespace cbcan::test
