// SPDX-License-Identifier: MIT
#pragma once

/// A Modbus RTU server (slave) over holding registers, for bare metal: no timer, no allocation, nothing that
/// blocks. Sources: MODBUS over Serial Line V1.02, section 2; MODBUS Application Protocol V1.1b3, section 6.
///
/// How to run it:
///   on_byte(byte, now) from the UART's receive interrupt, for every byte;
///   poll(now) from the loop, after such an interrupt and when the last poll() requested it: 0 = there is a
///   request, and execute() executes it and returns the response to send;
///   on_sent() when the last byte of the response has been sent: from then on it receives again. A board must
///   call it, or the server stops receiving.
///
/// There is one buffer for both directions. One atomic state hands it over: from the interrupt (receiving) to
/// the loop (a request is complete), to the transmitter (sending) and back. Bytes that arrive in the other
/// states are counted and discarded, including the echo of a two-wire transceiver; if there is an echo, call
/// on_sent() after its last byte.
///
/// Silence: a request is executed, and its response begins, t3.5 after its last byte, or later if a response
/// delay is set. A byte that arrives earlier cancels the request: it is neither executed nor answered.
///
/// Framing: the length of a request for this station, or for all (address 0), follows from its bytes; more
/// than 256 are not a frame. A byte that arrives more than a gap after the previous one always begins a new
/// frame. A request for this station whose function code has no known length ends when its CRC is right and
/// silence follows; one for all is ignored.
///
/// The server is out of step after a broken frame (wrong CRC, too long, no silence after it):
/// * If the gap is the silence, everything up to the next gap is ignored.
/// * If the gap is longer, a master that polls faster leaves none. So after each silence poll() looks for a
///   frame with a right CRC, at any place, that ends with the last byte. That ends at the latest with the
///   first request that a master waits for. A request within a frame of another station is executed then if
///   there is silence after it.
///
/// Frames of other stations are never executed in step, whatever they contain:
/// * If the gap is the silence, because the times of on_byte() are those of the line, a frame ends with a
///   gap, and only a gap begins one. Not covered: a sender that pauses for more than a gap within a frame.
/// * If the gap is longer, because bytes arrive late or in bunches, silence between frames may go undetected.
///   Then a frame also ends at the length of a request or response of its function code, if the CRC is right.
///   Which of the two it is follows from the previous frame: a request is followed by its response, or by a
///   request to another station. After a gap it may also be a repeated request, after a broken frame either;
///   then the longer length is used. A frame of a function code without known length (8, 43, a vendor's) is
///   searched for, as out of step. Not covered: a frame in progress when the server starts; a gap within a
///   frame; a response that arrives after its master has sent a request to another station.
/// So a request for this station with a gap before it and t3.5 after it is always received; if a longer gap
/// is set, also without one, but for those within 256 bytes of noise.
///
/// Several CAN networks: each has its own registers and its own station address, the first the address that
/// is set, the next ones the following addresses. A broadcast, which every station on a line executes (Serial
/// Line V1.02, 2.1), writes to all of them. One request at a time for all networks.
///
/// Functions, exceptions and the order of loads and stores: cbcan/modbus/executor.hpp. A request with address
/// 0 writes and is not answered.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/modbus/executor.hpp"

namespace cbcan {

/// t3.5 in us (Serial Line V1.02, 2.5.1.1): 1750 above 19200 baud, otherwise 3.5 characters of `bits` bits,
/// including start, parity and stop bits: 11, or 10 for 8N1.
constexpr std::uint32_t rtu_silence_us(std::uint32_t baud, std::uint32_t bits = 11) {
  return baud > 19'200 ? 1750 : (3'500'000 * bits + baud - 1) / baud;
}

class RtuServer final {
 public:
  struct Settings {
    std::uint8_t station = 1;         ///< address of the first network; those of all networks are within 1..247
    std::uint32_t silence_us = 1750;  ///< t3.5 of the line: rtu_silence_us()
    /// Longest time from one byte of a frame to the next, as passed to on_byte(), in us, if that is more than
    /// the silence because bytes arrive late or in bunches, as in an emulator or over USB. Causes no delay.
    std::uint32_t gap_us = 0;
    /// Time from a request to its response, in us, if that is more than the silence; at most 50,000. Helps
    /// masters whose transceivers are slow to switch to receiving.
    std::uint32_t response_delay_us = 0;
    /// Such as ModbusBits; null = exception 01 for them. It outlives the server.
    const modbus::MoreFunctions* more = nullptr;
  };

  /// Counts with the numbers of the diagnostic counters of Application Protocol V1.1b3, 6.8, if there is one.
  /// They wrap. Each is an aligned 32-bit word, which a 32-bit MCU reads atomically.
  struct Counters {
    /// 0Bh: frames with a right CRC, for any station.
    std::uint32_t bus_messages() const { return slave_messages + foreign_frames; }
    std::uint32_t bus_communication_errors = 0;  ///< 0Ch: requests with a wrong CRC
    std::uint32_t slave_exceptions = 0;          ///< 0Dh: requests rejected, including those of address 0
    std::uint32_t slave_messages = 0;            ///< 0Eh: requests for this station or all
    std::uint32_t slave_no_responses = 0;        ///< 0Fh: those of them for all
    std::uint32_t foreign_frames = 0;  ///< with a right CRC, of other stations; counted when they end
    std::uint32_t broken_frames = 0;   ///< cut short by a gap, too long, without silence after it, with a
                                       ///< broken byte, or foreign with a wrong CRC
    std::uint32_t ignored_bytes = 0;   ///< received while executing, sending or out of step
  };

  /// The longest frame (Serial Line V1.02, 2.5.1), in bytes.
  static constexpr std::size_t kMaxFrame = 256;
  /// Returned by poll(): no request is waiting.
  static constexpr std::uint32_t kNoRequest = 0xFFFFFFFF;

  /// `networks`: the registers of each, at the same addresses in all of them. The caller owns the maps, which
  /// must outlive the server.
  RtuServer(std::span<const RegisterMap> networks, const Settings& settings);
  RtuServer(const RtuServer&) = delete;
  RtuServer& operator=(const RtuServer&) = delete;

  /// Interrupt: one byte has arrived. `now_us` is a free-running microsecond counter that wraps at 2^32; only
  /// differences are used, but it should have started at 0 when the line was switched on.
  void on_byte(std::uint8_t byte, std::uint32_t now_us);

  /// Interrupt, instead of on_byte() if the byte has a parity or framing error, or the next one was lost: the
  /// frame in progress, or the request that waits, is invalid. Harmless before a frame, as when a transceiver is
  /// switched on.
  void on_broken_byte(std::uint32_t now_us);

  /// Loop: the remaining silence for the waiting request, or for what may contain one, in microseconds: the
  /// loop may sleep that long, or until the next byte. 0 = the request is taken, no byte cancels it any more,
  /// and execute() must follow. kNoRequest = none waits. `now_us` is the counter of on_byte(); call it at
  /// least every 35 minutes.
  std::uint32_t poll(std::uint32_t now_us);

  /// Loop, between poll() and execute(): the network of the request, from 0; the first for a broadcast.
  std::size_t request_network() const;

  /// Loop, between poll() and execute(): the request is for all networks.
  bool is_broadcast() const { return buffer_[0] == 0; }

  /// Loop, between poll() and execute(): the request's frame without its CRC.
  std::span<const std::uint8_t> request() const { return std::span(buffer_).first(size_ - 2); }

  /// Loop, between poll() and execute(): the request reads one of these registers, so they can be updated first.
  bool request_reads(std::uint16_t first, std::size_t count) const {
    return access().read.overlaps({first, count});
  }

  /// Loop: executes the request that poll() has taken, and returns the frame to send; empty = nothing to send.
  /// The bytes stay valid until on_sent(). Poll the coprocessor after each request, so that it misses no cancel.
  std::span<const std::uint8_t> execute();

  /// Loop, instead of execute(): the response, or exception, is this PDU. Returns the frame to send.
  std::span<const std::uint8_t> respond_with(std::span<const std::uint8_t> pdu);

  /// Loop: what the last execute() has done in the network of the request; of a broadcast in each network.
  const modbus::Access& executed() const { return executed_; }

  /// Interrupt or loop: the response has been sent, and the driver of the line is off. Without a response in
  /// progress it has no effect.
  void on_sent();

  const Counters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { kReceiving, kRequest, kSearching, kExecuting, kSending };

  static bool awaits_silence(State state) { return state == State::kRequest || state == State::kSearching; }
  bool times_are_exact() const { return settings_.gap_us <= settings_.silence_us; }
  bool is_for_us() const { return request_network() < networks_.size(); }
  bool listens(bool after_gap);
  bool takes(std::uint32_t now_us);
  void end_by_gap();
  void look_for_end();
  void on_foreign_frame();
  void skip(std::uint32_t& reason);
  void lose_step();
  void search();
  void begin_frame();
  void drop(std::size_t count);
  bool find_request();
  bool find_frame();
  bool is_request() const;
  void listen(std::size_t echo);
  std::size_t frame_size() const;
  std::size_t foreign_size() const;
  std::size_t request_size() const;
  std::size_t response_size() const;
  std::size_t size_by(std::uint8_t rule) const;
  std::uint16_t station_and_function() const;
  bool may_be_response() const;
  bool may_be_request() const;
  bool fits_request() const;
  modbus::Pdu pdu() const { return request().subspan(1); }
  modbus::Access access() const { return check(pdu(), networks_[request_network()], settings_.more); }
  std::span<const std::uint8_t> finish(std::size_t size);
  std::span<const std::uint8_t> sealed();

  std::span<const RegisterMap> networks_;
  Settings settings_;
  modbus::Access executed_{};
  std::atomic<State> state_{State::kReceiving};
  bool skipping_;          ///< until the next gap, or until a frame is found
  bool after_gap_ = true;  ///< the current frame began after one, or may have
  std::uint16_t asked_;    ///< the expected response, if silence may go undetected
  std::uint16_t crc_;
  std::atomic<std::uint32_t> last_us_ = 0;  ///< when the last byte came
  std::size_t size_ = 0;     ///< bytes of the frame so far, received or to be sent, without its CRC
  std::size_t unheard_ = 0;  ///< bytes received while executing and sending
  std::array<std::uint8_t, kMaxFrame> buffer_{};
  Counters counters_;
};

}  // namespace cbcan
