// SPDX-License-Identifier: MIT
#pragma once

/// The faults that are set for one node or for the bus: which of them happens now. Deterministic: the same
/// seed, the same faults and the same occasions at the same times give the same result. Each fault has a
/// random sequence of its own, made from the seed of the set, its own seed and its number, so that setting
/// one does not change what another does.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"
#include "sim/faults/fault.hpp"
#include "sim/random.hpp"

namespace cbcan::sim {

/// Is told what injected faults do, what states nodes are in, and what stands at their terminals.
class FaultListener {
 public:
  /// One line: whose fault, its number, the fault, and the frame as it was before:
  /// "node 5: fault 1: response-late delay_ms=50: 585#4B17100000000000". States are told when they begin and
  /// end. Must not change the faults.
  virtual void on_fault(std::string_view text, Time now) = 0;
  /// A node's NMT state, as in a heartbeat, may be another one; FFh: it has no power.
  virtual void on_node_state(std::uint8_t /*node*/, std::uint8_t /*state*/, Time /*now*/) {}
  /// See DeviceNode::terminals().
  virtual void on_terminals(std::uint8_t /*node*/, std::uint16_t /*index*/, std::uint8_t /*sub*/,
                            std::int32_t /*before*/, std::int32_t /*after*/, Time /*now*/) {}

 protected:
  ~FaultListener() = default;
};

/// A fault that has been set, and what has become of it.
struct SetFault {
  unsigned number;  ///< from 1 up, never used twice in one set
  Fault fault;
  std::string text;  ///< text_of(fault)
  Time begins;
  Time ends;                    ///< kNever = when it is removed
  std::uint64_t occasions = 0;  ///< how often it could have happened
  std::uint64_t fired = 0;      ///< how often it has
  bool open = false;            ///< of a state: it holds now
  Time due;                     ///< of a storm or a load: the next beat
  Random random;
};

class FaultSet {
 public:
  /// Called when faults have been added or removed.
  using OnChange = std::function<void(Time now)>;

  /// The faults of `subject`, for messages: "node 5". A null listener is not told.
  FaultSet(FaultPlace place, std::string subject, std::uint64_t seed, FaultListener* listener,
           OnChange on_change)
      : place_(place),
        subject_(std::move(subject)),
        seed_(seed),
        listener_(listener),
        on_change_(std::move(on_change)) {}

  /// kNode or kBus: what may be added.
  FaultPlace place() const { return place_; }

  /// The number by which it can be removed.
  unsigned add(const Fault& fault, Time now);
  /// False: there is none with this number. Frames that it has held back still come, also after clear().
  bool remove(unsigned number, Time now);
  void clear(Time now);
  /// All that will not happen any more.
  void remove_ended(Time now);

  bool empty() const { return set_.empty(); }
  /// In the order of their numbers; also those that will not happen any more.
  std::span<const SetFault> list() const { return set_; }

  /// To whoever is told of faults, with whose they are in front.
  void say(std::string_view text, Time now);

  // For those who make the faults happen.
  std::span<SetFault> all() { return set_; }

  /// This frame is an occasion; true: it happens, counted and told.
  bool happens(SetFault& set, const Frame& frame, Time now);

  /// Of a storm or a load: the time is over until its next beat, and the one behind it comes after
  /// `interval`. False = not yet, or no more of them.
  bool beat_due(SetFault& set, Time interval, Time now);

  /// Opens and closes the states that begin or end now, and returns the worst bus state of those that hold.
  BusState follow_states(Time now);

  /// When follow_states() or beat_due() has something to do next.
  Time deadline() const;

 private:
  void close(SetFault& set, Time now);
  void tell(const SetFault& set, std::string_view what, Time now);

  FaultPlace place_;
  std::string subject_;
  std::uint64_t seed_;
  FaultListener* listener_;
  OnChange on_change_;
  unsigned last_number_ = 0;
  std::vector<SetFault> set_;
};

/// Is it a state, which holds from its beginning to its end?
constexpr bool is_state(FaultKind kind) {
  return kind >= FaultKind::kBusOff;
}
/// Does it send by itself?
constexpr bool is_storm(FaultKind kind) {
  return kind == FaultKind::kBootUpStorm || kind == FaultKind::kEmcyStorm;
}
/// Is it about SDO responses?
constexpr bool is_of_responses(FaultKind kind) {
  return kind <= FaultKind::kShortFrame;
}
/// Is it about frames on the bus?
constexpr bool is_of_frames(FaultKind kind) {
  return kind >= FaultKind::kFrameLoss && kind <= FaultKind::kFrameCorrupt;
}

}  // namespace cbcan::sim
