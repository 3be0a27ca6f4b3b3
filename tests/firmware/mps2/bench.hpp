// SPDX-License-Identifier: MIT
#pragma once

/// The board's own image with what is around it in memory: a CAN bus with four nodes behind the coprocessor,
/// and the wire of a Modbus client in front of it. Time, sleep, interrupts and the watchdog are the board's;
/// its two UARTs lead nowhere.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/common/ring.hpp"
#include "boards/mps2_an385/board.hpp"
#include "support/device.hpp"

namespace cbcan::test {

/// Ends the emulator with exit code 1 and says why, unless found == expected.
void check(std::uint64_t found, std::uint64_t expected, const char* what);
void check_at_most(std::uint64_t found, std::uint64_t most, const char* what);
#define CHECK(found, expected) check(static_cast<std::uint64_t>(found), expected, #found)

void print(const char* text);
void print(std::uint32_t number);

/// Messages that have to come at a steady beat for ever.
struct Beat {
  explicit constexpr Beat(Time period) : period_(period) {}

  void on_message(Time now);
  std::uint32_t count() const { return count_; }
  /// Farthest that one was from where the first one and the period put it, in us.
  std::uint32_t farthest() const { return farthest_; }

 private:
  Time period_;
  Time expected_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t farthest_ = 0;
};

/// One direction of the bus.
struct Line final : CanPort {
  bool try_send(const Frame& frame) override;
  bool receive(Frame& frame) { return frames_.pop(frame); }
  bool empty() const { return frames_.empty(); }
  std::uint32_t sent() const { return sent_; }
  std::uint32_t refused() const { return frames_.overflows(); }

 private:
  boards::Ring<Frame, 64> frames_;
  std::uint32_t sent_ = 0;
};

/// The board's microseconds against ticks of the system clock, counted by a timer that nothing else uses.
struct Reference {
  void start(Time now);
  /// At least every 171 s: the timer has 32 bits.
  void check(Time now);
  /// Apart at most, in ticks.
  std::uint32_t farthest() const { return farthest_; }

 private:
  boards::Mmio timer_{0x40001000};  // TIMER1
  std::uint32_t last_ = 0;
  std::uint64_t ticks_ = 0;
  Time started_ = 0;
  std::uint32_t farthest_ = 0;
};

struct Bench final : boards::Hardware {
  static constexpr std::uint8_t kFirstNode = 2;  ///< a heartbeat every 1 s; 3: 1.3 s; 4: 1.7 s
  static constexpr std::uint8_t kGuarded = 5;    ///< none
  static constexpr std::uint8_t kAbsent = 6;

  Bench();

  void start();
  /// Of the last turn.
  Time time() const { return now_; }
  /// Turns of the loop until then.
  void run_until(Time end);
  /// Bytes on the wire to the server, as fast as it takes them.
  void put(std::span<const std::uint8_t> bytes);
  /// Turns of the loop until the response is there; valid until the next request.
  std::span<const std::uint8_t> await_response();

  // Hardware.
  Time now() override { return now_ = board.now(); }
  bool receive(std::size_t network, Frame& frame) override;
  BusState bus_state(std::size_t /*network*/) override { return BusState::kActive; }
  void respond(std::span<const std::uint8_t> response) override { response_ = response; }
  boards::Health health(std::size_t network) override;

  boards::mps2::Board board;
  Line to_nodes;
  Line to_coprocessor;
  boards::Station<> station;
  std::array<Device, 4> nodes;
  Reference reference;

  std::array<Beat, 3> heartbeats{Beat(1000 * kMillisecond), Beat(1300 * kMillisecond),
                                 Beat(1700 * kMillisecond)};  ///< of the first nodes
  Beat own_heartbeat{2 * kSecond};
  Beat sync{kSecond};
  std::uint32_t turns = 0;
  std::uint32_t wraps = 0;  ///< of the board's counter
  std::uint32_t received = 0;

  // When the coprocessor began the last transaction and when it ended it, as the turns' time.
  Time begun = 0;
  Time ended = 0;

 private:
  void turn(Time end);
  void turn_nodes();
  void watch();

  boards::mps2::MicrosecondCounter<boards::Mmio> counter_{boards::Mmio(0x40028000)};
  std::span<const std::uint8_t> response_;
  std::array<std::uint8_t, RtuServer::kMaxFrame> received_response_{};
  Time now_ = 0;
  Time next_check_ = 0;
  std::uint32_t last_count_ = 0;
  bool executing_ = false;
};

extern Bench bench;

}  // namespace cbcan::test
