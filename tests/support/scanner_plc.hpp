// SPDX-License-Identifier: MIT
#pragma once

/// Both sides of a window for tests of whole programs: a PLC, and a node that counts requests. No two
/// requests are the same, so a request that is executed twice, or reported as done but not executed, is
/// detected.

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

/// What a PLC program asks of node 5, reads and writes alternately, and what became of it.
struct PlcRequests {
  /// R3701 and the words after it: command, node, index, sub-index, size and data.
  std::array<std::uint16_t, 7> next() {
    ++id_;
    write_ = id_ % 2 == 0;
    const auto low = static_cast<std::uint16_t>(id_);
    if (write_) return {5066, kScannedNode, 0x2000, 0, 4, low, static_cast<std::uint16_t>(id_ >> 16)};
    return {5055, kScannedNode, index(), sub(), 4, 0, 0};
  }
  /// The result, and what is in the registers of size and data then; those of a write may have to `stay`.
  void take(std::uint16_t result, std::uint16_t size, std::uint32_t value, bool stay = false) {
    ++results[result];
    ++ended;
    if (result != 0) return;
    done.push_back({write_, id_});
    const std::uint32_t right = write_ ? id_ : scanned_value(index(), static_cast<std::uint8_t>(sub()));
    if ((!write_ || stay) && (size != 4 || value != right)) torn.push_back(id_);
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
  std::vector<Done> done;           ///< ended by result 0
  std::vector<std::uint32_t> torn;  ///< requests of `done` with other data than the node's, or the PLC's own
  std::map<std::uint16_t, unsigned> results;
  unsigned ended = 0;

 private:
  std::uint16_t index() const { return static_cast<std::uint16_t>(id_ >> 8); }
  std::uint16_t sub() const { return static_cast<std::uint16_t>(id_ & 0xFF); }

  std::uint32_t id_ = 0x200000;  ///< of the request; never used twice, not even after a restart
  bool write_ = false;
};

/// The program of docs/how-to/scanner.md with its images of both blocks.
struct ScannerPlc : PlcRequests {
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
      case Phase::kIdle:
        out[0] = number_ = number_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(number_ + 1);
        std::ranges::copy(next(), out.begin() + 1);
        waited_ = 0;
        phase_ = Phase::kWaiting;
        break;
      case Phase::kWaiting:
        if (in[0] == number_) {
          take(in[1], in[3], in[4] | std::uint32_t{in[5]} << 16);
          phase_ = Phase::kIdle;
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

  std::array<std::uint16_t, kOut> out{};
  std::array<std::uint16_t, kIn> in{};

 private:
  enum class Phase { kStarting, kIdle, kWaiting, kCancelling };

  int patience_;
  Phase phase_ = Phase::kStarting;
  std::uint16_t number_ = 0;
  int waited_ = 0;
};

}  // namespace cbcan::test
