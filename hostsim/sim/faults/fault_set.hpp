// SPDX-License-Identifier: MIT
#pragma once

/// The faults that are set for one node or for the bus, and which of them act now. Deterministic: the same
/// seed, the same faults and the same frames at the same times give the same result. Each fault has its own
/// random sequence, made from the seed of the set, its own seed and its number, so that setting one fault
/// does not change what another does.

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

/// Gets what injected faults do, the states of nodes, and the values at their terminals.
class FaultListener {
 public:
  /// One line with the node or bus, the number of the fault, the fault, and the frame as it was before:
  /// "node 5: fault 1: response-late delay_ms=50: 585#4B17100000000000". A state fault is reported when it
  /// begins and when it ends. Must not change the faults.
  virtual void on_fault(std::string_view text, Time now) = 0;
  /// The NMT state of a node may have changed; `state` is as in a heartbeat, FFh = the node has no power.
  virtual void on_node_state(std::uint8_t /*node*/, std::uint8_t /*state*/, Time /*now*/) {}
  /// See DeviceNode::terminals().
  virtual void on_terminals(std::uint8_t /*node*/, std::uint16_t /*index*/, std::uint8_t /*sub*/,
                            std::int32_t /*before*/, std::int32_t /*after*/, Time /*now*/) {}

 protected:
  ~FaultListener() = default;
};

/// A fault that has been set, and what it has done.
struct SetFault {
  unsigned number;  ///< from 1, never used twice in one set
  Fault fault;
  std::string text;  ///< text_of(fault)
  Time begins;
  Time ends;                    ///< kNever = when it is removed
  std::uint64_t occasions = 0;  ///< matching frames so far
  std::uint64_t fired = 0;      ///< how often it has acted
  bool open = false;            ///< a state that holds now
  bool waits = false;           ///< a state that begins with a matching frame
  Time due;                     ///< the next frame of a storm or a load
  Random random;
};

class FaultSet {
 public:
  /// Called when faults have been added or removed.
  using OnChange = std::function<void(Time now)>;

  /// `subject` is for messages: "node 5". `listener` may be null.
  FaultSet(FaultPlace place, std::string subject, std::uint64_t seed, FaultListener* listener,
           OnChange on_change)
      : place_(place),
        subject_(std::move(subject)),
        seed_(seed),
        listener_(listener),
        on_change_(std::move(on_change)) {}

  /// What may be added.
  FaultPlace place() const { return place_; }

  /// Returns the number for remove().
  unsigned add(const Fault& fault, Time now);
  /// False: there is none with this number. Frames that the fault has delayed are still sent, also after
  /// clear().
  bool remove(unsigned number, Time now);
  void clear(Time now);
  /// Removes faults that will not act again.
  void remove_ended(Time now);

  bool empty() const { return set_.empty(); }
  /// All in the order of their numbers, including those that will not act again.
  std::span<const SetFault> list() const { return set_; }

  /// Reports `text` to the listener, with the subject in front.
  void say(std::string_view text, Time now);
  void tell(const SetFault& set, std::string_view what, Time now);

  // Functions for the classes that carry out the faults.
  std::span<SetFault> all() { return set_; }

  /// This frame matches. True: the fault acts now, which is counted and reported.
  bool happens(SetFault& set, const Frame& frame, Time now);
  /// The same for something that is no frame; it is not reported.
  bool acts(SetFault& set, Time now);

  /// The same for a state that waits for it: it begins.
  bool begins(SetFault& set, const Frame& frame, Time now);

  /// True: the next frame of a storm or a load is due, and the one after it follows in `interval`. False =
  /// not yet, or there are no more.
  bool beat_due(SetFault& set, Time interval, Time now);

  /// Begins and ends the state faults that are due, and returns the worst bus state of those that hold.
  BusState follow_states(Time now);
  /// The longest delay of commands among those that hold.
  Time command_delay() const;

  /// When follow_states() or beat_due() has something to do next.
  Time deadline() const;

 private:
  void close(SetFault& set, Time now);

  FaultPlace place_;
  std::string subject_;
  std::uint64_t seed_;
  FaultListener* listener_;
  OnChange on_change_;
  unsigned last_number_ = 0;
  std::vector<SetFault> set_;
};

/// It is a state, which holds from its beginning to its end.
constexpr bool is_state(FaultKind kind) {
  return kind >= FaultKind::kBusOff;
}
/// It sends frames of its own.
constexpr bool is_storm(FaultKind kind) {
  return kind == FaultKind::kBootUpStorm || kind == FaultKind::kEmcyStorm;
}
/// It alters SDO responses.
constexpr bool is_of_responses(FaultKind kind) {
  return kind <= FaultKind::kShortFrame;
}
/// It alters frames on the bus.
constexpr bool is_of_frames(FaultKind kind) {
  return kind >= FaultKind::kFrameLoss && kind <= FaultKind::kFrameCorrupt;
}

}  // namespace cbcan::sim
