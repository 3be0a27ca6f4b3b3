// SPDX-License-Identifier: MIT
#pragma once

/// The rules that apply to each run: docs/how-to/explore.md, "Conditions of a run". Faults that change values
/// beyond detection suspend those about values.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/time.hpp"
#include "plant/command_words.hpp"
#include "plant/control.hpp"
#include "scenario/search/search_settings.hpp"
#include "scenario/search/trial.hpp"

namespace cbcan::search {

/// The last values of an object, and when it had them: a read that began then may give one of them.
class ValuesSeen {
 public:
  void add(Time at, std::span<const std::uint8_t> value) {
    values_.push_back({at, {value.begin(), value.end()}});
    if (values_.size() > kMost) values_.pop_front();
  }
  bool has_since(Time begun, std::span<const std::uint8_t> value) const {
    return std::ranges::any_of(
        values_, [&](const Seen& seen) { return seen.at >= begun && std::ranges::equal(seen.value, value); });
  }

 private:
  static constexpr std::size_t kMost = 16;
  struct Seen {
    Time at;
    std::vector<std::uint8_t> value;
  };
  std::deque<Seen> values_;
};

/// A run while it is judged. What it refers to outlives it.
struct JudgedRun {
  /// Ends the run with what is wrong; only the first call counts.
  void broken(std::string_view what, std::string seen);

  /// Modbus requests so far.
  std::uint64_t requests() const;
  /// Whether the object is not among these of the baseline; in the run without faults, adds it to them and
  /// returns false.
  bool is_new(std::set<Object> Record::*objects, const Object& object);
  /// Null: no simulated node has this ID and power.
  sim::Node* node_of(const Object& object) const;
  /// The value at present; empty without the object, nullopt without the node.
  std::optional<std::vector<std::uint8_t>> value_of(const Object& object) const;

  plant::Control& control;
  const Settings& settings;
  const Trial& trial;
  std::function<void(Time)> pass;               ///< lets this time pass in the plant
  static constexpr std::size_t kEvents = 2048;  ///< in the journal
  journal::Journal& journal = control.journal(kEvents, 128 * kEvents);
  plant::LastFrames last_frames{control};
  std::string during{};    ///< the present transaction, or the last one
  std::string request{};   ///< the last Modbus request
  bool has_ended = false;  ///< the program, or the scenario
  unsigned transactions = 0;  ///< in progress
  Time fault_at = 0;          ///< when a fault has acted last
  /// How long its effects may last.
  static constexpr Time kSettle = 5 * kSecond;
  /// Something is in progress that may still break a rule.
  bool is_open() const {
    return transactions != 0 || !trial.faults_pass || (result.happened && control.now() < fault_at + kSettle);
  }
  Result result{};
  Record record{};
};

/// Network and node ID.
using NodePlace = std::pair<std::uint8_t, std::uint8_t>;

/// A frame on a bus, before the nodes get it.
struct BusFrame {
  std::uint8_t node() const { return static_cast<std::uint8_t>(frame.id & nmt::kMaxNode); }
  /// `function`: the CAN-ID without the node.
  bool is(std::uint32_t function) const { return frame.id - node() == function; }
  bool is_boot_up() const { return is(nmt::kErrorControlId) && frame.flags == 0 && frame.data[0] == 0; }
  NodePlace place() const { return {network, node()}; }
  /// Object of an SDO frame with a multiplexer.
  Object object() const { return {network, node(), sdo::load16(frame, 1), frame.data[3]}; }

  std::uint8_t network;
  const Frame& frame;
  Time at;
};

/// Calls JudgedRun::broken() if it does not hold.
struct Rule {
  virtual ~Rule() = default;
  virtual void on_frame(JudgedRun& /*run*/, const BusFrame& /*seen*/) {}
  virtual void on_fault(JudgedRun& /*run*/, const journal::Event& /*fault*/) {}
  virtual void on_begun(JudgedRun& /*run*/, const journal::Event& /*transaction*/) {}
  virtual void on_ended(JudgedRun& /*run*/, const journal::Event& /*transaction*/) {}
  /// Time has passed, or a request has been answered.
  virtual void on_look(JudgedRun& /*run*/) {}
  /// The plant has settled after the end.
  virtual void on_settled(JudgedRun& /*run*/) {}
};

/// All of them; of several that are broken at a time, the first is reported.
std::vector<std::unique_ptr<Rule>> make_rules();

}  // namespace cbcan::search
