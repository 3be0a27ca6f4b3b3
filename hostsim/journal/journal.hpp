// SPDX-License-Identifier: MIT
#pragma once

/// Everything that happens in a plant, once, in bus order: a ring of records of one size. Views read it by
/// number and make the text themselves (event_text.hpp). Nothing is allocated for an event.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan::journal {

enum class Kind : std::uint8_t {
  kModbus,     ///< a request has been answered
  kBegun,      ///< the PLC has requested a transaction
  kEnded,      ///< a transaction has its result
  kFrame,      ///< on the bus
  kEmergency,  ///< the frame before is an EMCY message
  kState,      ///< the NMT state of a node has changed
  kTerminals,  ///< the value at the terminals of a node has changed
  kFault,      ///< an injected fault has acted
  kCommand,    ///< of docs/reference/commands.md: inputs, incidents, power, faults, NMT; before its effects
  kClient,     ///< a Modbus TCP client has connected or disconnected
  kAdvice,     ///< a mistake of the PLC program, seen for the first time
  kBoot,       ///< the module could not boot a node, or has lost it
};
inline constexpr std::size_t kKinds = 12;
/// Names in the order of Kind.
inline constexpr std::array<std::string_view, kKinds> kKindNames{"modbus",  "begun",  "ended",     "frame",
                                                                 "emcy",    "state",  "terminals", "fault",
                                                                 "command", "client", "advice",    "boot"};

/// A set of kinds: bits by Kind.
using Kinds = std::uint32_t;
inline constexpr Kinds kAllKinds = (1U << kKinds) - 1;
constexpr Kinds kinds_of(std::initializer_list<Kind> list) {
  Kinds kinds = 0;
  for (const Kind kind : list)
    kinds |= 1U << static_cast<unsigned>(kind);
  return kinds;
}

/// What a transaction does.
enum class Service : std::uint8_t { kNone, kRead, kWrite, kNmt, kState };
/// Names in the order of Service.
inline constexpr std::array<std::string_view, 5> kServiceNames{"none", "read", "write", "nmt", "state"};
constexpr std::string_view name_of(Service service) {
  return kServiceNames[static_cast<std::size_t>(service)];
}

/// Value of an NMT state if the node has no power.
inline constexpr std::uint8_t kOff = 0xFF;
/// Value of a result if the PLC has cancelled its request.
inline constexpr std::uint16_t kCancelled = 0xFFFF;
/// The same, before the first frame of its SDO transfer.
inline constexpr std::uint16_t kNeverSent = 0xFFFE;
/// Value of a state if the command was rejected.
inline constexpr std::uint8_t kRefused = 1;

struct Event {
  Kind kind = Kind::kFrame;
  std::uint8_t network = 1;  ///< 0 = none
  std::uint8_t node = 0;     ///< 0 = none; kModbus: unit ID
  std::uint8_t sub = 0;
  std::uint16_t index = 0;  ///< object; kModbus: size of the request's PDU, which the response's follows
  Service service{};        ///< of a transaction
  std::uint8_t state = 0;   ///< kState: as in a heartbeat, or kOff; kClient: 1 = connected; kModbus:
                            ///< exception; kTerminals: the bits that have changed; kCommand: 0 or kRefused;
                            ///< kAdvice: the Mistake; kBegun, kEnded: 0 = through R3700, else the channel of
                            ///< the scanner window
  std::uint16_t result = 0;  ///< kEnded: as in R3700, kCancelled or kNeverSent; kModbus: MBAP transaction ID
  std::uint16_t size = 0;    ///< of what bytes() gives
  std::uint32_t transaction = 0;  ///< that the event belongs to; 0 = none
  std::uint32_t code = 0;   ///< kEnded: SDO abort code; kModbus, kClient, kAdvice: number of the client;
                            ///< kTerminals: the signed value
  Time at = 0;              ///< since the plant's start
  Time took = 0;            ///< kEnded
  std::uint64_t bytes = 0;  ///< where they begin; only for Journal
  Frame frame{};  ///< kFrame, kEmergency; for a transaction of a scanner window, `id` is the request's number
};

constexpr bool is_transaction(const Event& event) {
  return event.kind == Kind::kBegun || event.kind == Kind::kEnded;
}

constexpr bool is_cancelled(const Event& ended) {
  return ended.result == kCancelled || ended.result == kNeverSent;
}

/// Whether a transaction (kEnded) failed. Result 5 is the handshake of a scanner window after a start.
constexpr bool failed(const Event& ended) {
  return ended.result != 0 && ended.result != static_cast<std::uint16_t>(regmap::Result::kRestarted);
}

class Journal {
 public:
  static constexpr std::size_t kEvents = 100'000;
  static constexpr std::size_t kBytes = 8 * 1024 * 1024;

  /// Allocates all memory, and does not touch it: a plant starts faster.
  explicit Journal(std::size_t events = kEvents, std::size_t bytes = kBytes)
      : size_(events), bytes_size_(bytes), bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(bytes)) {
    ring_.reserve(events);
    ring_.resize(1);
  }

  /// Appends an event with the concatenated `parts`, at most 64 KiB, as its bytes. The reference is valid
  /// until the next call.
  Event& add(Event event, std::initializer_list<std::span<const std::uint8_t>> parts = {});
  Event& add(const Event& event, std::string_view text);

  /// Events first()..end()-1 are kept; the first event of all has number 1.
  std::uint64_t first() const { return end_ > size_ ? end_ - size_ : 1; }
  std::uint64_t end() const { return end_; }
  const Event& operator[](std::uint64_t number) const { return ring_[number % size_]; }
  Event& latest() { return ring_[(end_ - 1) % size_]; }
  /// Number of the latest event of these kinds; 0 = there has been none.
  std::uint64_t latest_of(Kinds kinds) const;
  /// Empty when they have been overwritten.
  std::span<const std::uint8_t> bytes(const Event& event) const {
    if (event.bytes + bytes_size_ < used_) return {};
    return {bytes_.get() + event.bytes % bytes_size_, event.size};
  }
  std::string_view text(const Event& event) const;

  std::uint32_t new_transaction() { return ++transactions_; }

  /// Called whenever another half of the ring has been filled, so that views can read before events are lost.
  std::function<void()> on_filled = [] {};

 private:
  std::size_t size_;
  std::vector<Event> ring_;  ///< by number modulo size_; grows up to that
  std::size_t bytes_size_;
  std::unique_ptr<std::uint8_t[]> bytes_;       ///< a ring of those of the latest events
  std::uint64_t used_ = 0;                      ///< of bytes_ so far, as if they had no end
  std::array<std::uint64_t, kKinds> latest_{};  ///< number by Kind; 0 = none
  std::uint64_t end_ = 1;
  std::uint32_t transactions_ = 0;
};

/// The position of a view in a journal. Events of other kinds cost it nothing.
class Cursor {
 public:
  /// Sees events from now on.
  explicit Cursor(const Journal& journal, Kinds kinds = kAllKinds) : Cursor(journal, journal.end(), kinds) {}
  /// Sees events from `number` on.
  Cursor(const Journal& journal, std::uint64_t number, Kinds kinds)
      : journal_(journal), next_(number), kinds_(kinds) {}

  /// Events of all kinds since.
  std::uint64_t unread() const { return journal_.end() - next_; }
  bool has_news() const { return journal_.latest_of(kinds_) >= next_; }
  /// Calls `visit(number, event)` for each new event, until it returns false. Returns how many events of all
  /// kinds were overwritten unseen.
  template <class Visit>
  std::uint64_t look(Visit visit) {
    if (!has_news()) {
      next_ = journal_.end();
      return 0;
    }
    const std::uint64_t missed = next_ < journal_.first() ? journal_.first() - next_ : 0;
    const Journal& journal = journal_;
    std::uint64_t number = next_ + missed;
    for (bool goes_on = true; goes_on && number < journal.end(); ++number) {
      const Event& event = journal[number];
      goes_on = (kinds_ >> static_cast<unsigned>(event.kind) & 1) == 0 || visit(number, event);
    }
    next_ = number;
    return missed;
  }

 private:
  const Journal& journal_;
  std::uint64_t next_;
  Kinds kinds_;
};

}  // namespace cbcan::journal
