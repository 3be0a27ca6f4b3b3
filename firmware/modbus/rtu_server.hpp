// SPDX-License-Identifier: MIT
#pragma once

/// A Modbus RTU server (slave) over holding registers, for bare metal: no timer, no allocation, nothing that
/// blocks. Sources: MODBUS over Serial Line V1.02, section 2; MODBUS Application Protocol V1.1b3, section 6.
///
/// How to run it:
///   on_byte(byte, now) from the UART's receive interrupt, for every byte;
///   poll() from the loop: executes at most one request and gives the response to send;
///   on_sent() when the last byte of the response has left the wire: from then on it listens again. A board
///   must call it, or the server stays deaf.
///
/// There is one buffer for both directions. One atomic state hands it over: from the interrupt (receiving) to
/// the loop (a request is complete), to the transmitter (sending) and back. What arrives while it does not
/// receive is counted and thrown away, the echo of a two-wire transceiver too; where that has an echo,
/// on_sent() comes after the echo's last byte.
///
/// Framing: the length of a request for this station, or for all (address 0), follows from its bytes, so the
/// answer waits for no silence. A frame with another function code, or of another station (a request or an
/// answer, which differ in length), ends where its CRC comes out right. A byte that comes more than a gap
/// after the one before it begins a new frame whatever went before; after a wrong CRC nothing else does.
///
/// Several CAN networks: each has registers of its own and is a station of its own, the first at the address
/// that is set, the next ones behind it. So a broadcast, which every station on a line executes (Serial Line
/// V1.02, 2.1), writes to all of them. One request at a time, whichever of them it is for.
///
/// FC 3, 6, 16, 22, 23. Exceptions: 01 another function; 03 a quantity or byte count that is not allowed; 02
/// an address that does not exist, or a write to a read-only one. Lengths and quantities are checked before
/// addresses, and a request that is refused changes nothing. Address 0 writes and is not answered.
///
/// Ordering, where the words are shared with another context: a write stores the highest address first, and
/// the lowest after a release fence, so CA0Eh in R3700 is seen last of one FC 16 or FC 23; a read loads the
/// lowest address first, and the others after an acquire fence, so results are whole where R3700 shows one
/// (docs/contract.md). FC 22 is one atomic change.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

namespace cbcan {

class RtuServer final {
 public:
  struct Settings {
    std::uint8_t station = 1;   ///< own address, of the first network; of all of them within 1..247
    std::uint8_t networks = 1;  ///< at least 1; each with an equal part of the registers
    /// Longest time from one byte of a frame to the next, as on_byte() is told it, in us. The specification's
    /// 3.5 characters are 1750 above 19200 baud, else 38.5 s / baud (4010 at 9600). More where interrupts
    /// come late, as in an emulator: nothing waits for it, but a frame after a broken one must keep off it.
    std::uint32_t gap_us = 1750;
    std::uint16_t read_only_first = 0;  ///< registers whose writes are answered with exception 02
    std::uint16_t read_only_count = 0;  ///< 0 = none
  };

  /// After the diagnostic counters of Application Protocol V1.1b3, 6.8, where there is one. They wrap. Each
  /// has one writer, the interrupt or the loop: an aligned 32-bit word, read whole on a 32-bit MCU.
  struct Counters {
    std::uint32_t bus_messages = 0;              ///< 0Bh: frames with a right CRC, for whomever
    std::uint32_t bus_communication_errors = 0;  ///< 0Ch: requests with a wrong CRC
    std::uint32_t slave_exceptions = 0;          ///< 0Dh: requests refused, those of address 0 too
    std::uint32_t slave_messages = 0;            ///< 0Eh: requests for this station or all, looked at
    std::uint32_t slave_no_responses = 0;        ///< 0Fh: those among them that went to all
    std::uint32_t foreign_frames = 0;            ///< with a right CRC, of other stations
    std::uint32_t broken_frames = 0;             ///< ended by a gap, or too long
    std::uint32_t ignored_bytes = 0;             ///< came while executing or sending, or after a wrong CRC
  };

  /// The longest frame (Serial Line V1.02, 2.5.1), in bytes.
  static constexpr std::size_t kMaxFrame = 256;

  /// `registers` are holding registers 0, 1, ..., at most 65536, in host byte order; behind those of the
  /// first network are those of the second. The memory is the caller's and must outlive the server.
  RtuServer(std::span<std::uint16_t> registers, const Settings& settings)
      : registers_(registers), network_size_(registers.size() / settings.networks), settings_(settings) {}
  RtuServer(const RtuServer&) = delete;
  RtuServer& operator=(const RtuServer&) = delete;

  /// Interrupt: one byte has arrived. `now_us` is a free-running microsecond counter that wraps at 2^32; only
  /// differences count. A byte received with a framing or parity error may be left out: the CRC notices.
  void on_byte(std::uint8_t byte, std::uint32_t now_us);

  /// Loop, or an interrupt with masked interrupts: a request waits for poll(), so this is no time to sleep.
  bool request_waiting() const { return state_.load(std::memory_order_acquire) == State::kRequest; }

  /// Loop: which network the request that waits is for, from 0; of a broadcast the first.
  std::size_t request_network() const;

  /// Loop: a request waits that reads one of these registers: the moment to make them fresh.
  bool request_reads(std::uint16_t first, std::size_t count) const;

  /// Loop: executes the request that waits, if one does, and gives the frame to send; empty = nothing to
  /// send. The bytes stay valid until on_sent(). At most one request: poll the coprocessor after each, so
  /// that it misses no cancel.
  std::span<const std::uint8_t> poll();

  /// Interrupt or loop: the response has left, the driver of the line is off. Without a response under way
  /// nothing happens.
  void on_sent();

  const Counters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { kReceiving, kRequest, kSending };
  enum class Exception : std::uint8_t { kNone = 0, kFunction = 1, kAddress = 2, kValue = 3 };

  bool is_broadcast() const;
  bool is_for_us() const;
  std::size_t request_size() const;
  void look_for_end();
  void on_frame();
  void skip_to_gap(std::uint32_t& reason);
  void begin_frame();
  void listen();
  std::uint16_t word(std::size_t offset) const;
  void put_word(std::size_t offset, std::uint16_t value);
  bool exist(std::uint16_t address, std::size_t count) const;
  bool writable(std::uint16_t address, std::size_t count) const;
  bool values_allowed(std::size_t offset, std::size_t most) const;
  Exception execute();
  Exception read_registers();
  Exception write_register();
  Exception write_registers();
  Exception mask_register();
  Exception read_write_registers();
  void load(std::uint16_t address, std::size_t count);
  void store(std::uint16_t address, std::size_t count, std::size_t offset);
  std::span<const std::uint8_t> sealed();

  std::span<std::uint16_t> registers_;  ///< of all networks
  std::size_t network_size_;            ///< registers of each
  std::size_t base_ = 0;                ///< where those begin that the request is executed on
  Settings settings_;
  std::atomic<State> state_{State::kReceiving};
  bool skipping_ = false;  ///< until the next gap
  std::uint16_t crc_ = 0xFFFF;
  std::uint32_t last_us_ = 0;  ///< when the last byte came
  std::size_t size_ = 0;       ///< bytes of the frame so far, received or to be sent, without its CRC
  std::array<std::uint8_t, kMaxFrame> buffer_{};
  Counters counters_;
};

}  // namespace cbcan
