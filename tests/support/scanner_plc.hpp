// SPDX-License-Identifier: MIT
#pragma once

/// Both sides of the scanner window for tests of whole programs: a PLC with the handshake of
/// docs/how-to/scanner.md, and a node that counts requests. No two requests are the same, so a request that is
/// executed twice, or reported as done but not executed, is detected.

#include "support/catch.hpp"

namespace cbcan::test {

inline constexpr std::uint8_t kScannedNode = 5;

/// The value of an object of the node: a number that is unique to its address.
inline std::uint32_t scanned_value(std::uint16_t index, std::uint8_t sub) {
  return (std::uint32_t{index} << 8 | sub) * 2654435761u;
}

/// Node 5: expedited transfers of four bytes. Counts requests by their unique 32-bit number: the value written, or
/// index and sub-index read.
struct CountingNode {
  using Bytes = std::array<std::uint8_t, 8>;  ///< of a frame

  /// A frame on 600h + 5; the response on 580h + 5 is added to `responses`.
  void on_request(const Bytes& bytes) {
    constexpr std::uint8_t kAbort = 0x80, kWrite4 = 0x23;
    if (bytes[0] == kAbort) return;
    const bool write = bytes[0] == kWrite4;
    const auto index = static_cast<std::uint16_t>(bytes[1] | bytes[2] << 8);
    std::uint32_t value = scanned_value(index, bytes[3]);
    ++(write ? written[load32(bytes)] : read[std::uint32_t{index} << 8 | bytes[3]]);
    ++transfers;
    Bytes response{write ? std::uint8_t{0x60} : std::uint8_t{0x43}, bytes[1], bytes[2], bytes[3]};
    for (unsigned i = 4; i < 8 && !write; ++i, value >>= 8)
      response[i] = static_cast<std::uint8_t>(value);
    responses.push_back(response);
  }

  std::map<std::uint32_t, unsigned> written;
  std::map<std::uint32_t, unsigned> read;
  unsigned transfers = 0;
  std::deque<Bytes> responses;

 private:
  static std::uint32_t load32(const Bytes& bytes) {
    return bytes[4] | std::uint32_t{bytes[5]} << 8 | std::uint32_t{bytes[6]} << 16 |
           std::uint32_t{bytes[7]} << 24;
  }
};

/// The program of docs/how-to/scanner.md with its images of both blocks. It reads and writes node 5 alternately.
struct ScannerPlc {
  static constexpr std::size_t kOut = 8;
  static constexpr std::size_t kIn = 6;

  /// Abandons a request after `patience` scans.
  explicit ScannerPlc(int patience) : patience_(patience) {}

  /// The PLC has been switched off and on.
  void restart() {
    in.fill(0);
    out.fill(0);
    phase_ = Phase::kStarting;
  }

  void scan() {
    switch (phase_) {
      case Phase::kStarting:
        out[0] = 0;
        if (in[1] == 0 && in[2] == 0) break;
        number_ = in[2];
        phase_ = Phase::kIdle;
        break;
      case Phase::kIdle: request(); break;
      case Phase::kWaiting:
        if (in[0] == number_) {
          take_result();
        } else if (++waited_ > patience_) {
          out[0] = 0;
          phase_ = Phase::kCancelling;
        }
        break;
      case Phase::kCancelling:
        if (in[0] == number_ || in[1] == 5) phase_ = Phase::kIdle;
        break;
    }
  }

  /// The node has executed no request twice and all requests that are reported as done, with its own values.
  void check(const CountingNode& node) const {
    std::vector<std::uint32_t> twice;
    for (const auto* counts : {&node.written, &node.read})
      for (const auto& [id, times] : *counts)
        if (times != 1) twice.push_back(id);
    CHECK(twice.empty());
    std::vector<std::uint32_t> not_executed;
    for (const Done& one : done)
      if (!(one.write ? node.written : node.read).contains(one.id)) not_executed.push_back(one.id);
    CHECK(not_executed.empty());
    CHECK(torn.empty());
  }

  struct Done {
    bool write;
    std::uint32_t id;
  };
  std::array<std::uint16_t, kOut> out{};
  std::array<std::uint16_t, kIn> in{};
  std::vector<Done> done;           ///< ended by result 0
  std::vector<std::uint32_t> torn;  ///< requests of `done` with data that the node did not send
  std::map<std::uint16_t, unsigned> results;
  unsigned ended = 0;

 private:
  enum class Phase { kStarting, kIdle, kWaiting, kCancelling };

  void request() {
    number_ = number_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(number_ + 1);
    ++id_;
    write_ = id_ % 2 == 0;
    const auto low = static_cast<std::uint16_t>(id_);
    const auto high = static_cast<std::uint16_t>(id_ >> 16);
    if (write_)
      out = {number_, 5066, kScannedNode, 0x2000, 0, 4, low, high};
    else
      out = {number_, 5055, kScannedNode, read_index(), static_cast<std::uint16_t>(id_ & 0xFF), 4, 0, 0};
    waited_ = 0;
    phase_ = Phase::kWaiting;
  }

  void take_result() {
    ++results[in[1]];
    ++ended;
    phase_ = Phase::kIdle;
    if (in[1] != 0) return;
    done.push_back({write_, id_});
    if (write_) return;
    const std::uint32_t value = in[4] | std::uint32_t{in[5]} << 16;
    if (in[3] != 4 || value != scanned_value(read_index(), static_cast<std::uint8_t>(id_)))
      torn.push_back(id_);
  }

  std::uint16_t read_index() const { return static_cast<std::uint16_t>(id_ >> 8); }

  int patience_;
  Phase phase_ = Phase::kStarting;
  std::uint16_t number_ = 0;
  std::uint32_t id_ = 0x200000;  ///< of the request; never used twice, not even after a restart
  bool write_ = false;
  int waited_ = 0;
};

}  // namespace cbcan::test
