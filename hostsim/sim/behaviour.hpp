// SPDX-License-Identifier: MIT
#pragma once

/// What makes a simulated node a device: behaviour on its dictionary. The node does all the communication; a
/// behaviour reads and writes values. docs/how-to/lua-device.md shows how to write one.
///
/// The node calls update() before anybody looks at a value (an SDO upload, a TPDO that is sampled) and after
/// anybody has written one (SDO, RPDO, a signal), and at the time that the last update() named. So a
/// behaviour looks at what its values are now; nobody tells it which one has changed. Time is the argument
/// and never goes back; a behaviour reads no clock and no random numbers but seeded ones, opens nothing, and
/// never calls back into the bus.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/time.hpp"

namespace cbcan::sim {

/// The five bytes of an EMCY message that are the manufacturer's.
using EmergencyInfo = Emergency::Info;

using cbcan::NetworkFailure;

/// What a behaviour may ask of its node.
class DeviceNode {
 public:
  virtual ObjectDictionary& dictionary() = 0;

  /// An error has occurred: EMCY with this code, once, and `register_bits` set in 1001h until it is over (CiA
  /// 301, 7.2.7). An error that is there already is not told again.
  virtual void error(std::uint16_t code, std::uint8_t register_bits, const EmergencyInfo& info, Time now) = 0;
  /// The error with this code is over: EMCY 0000h goes out, with what is left in 1001h.
  virtual void error_over(std::uint16_t code, Time now) = 0;

  /// The event that event-driven TPDOs with this object in them wait for: they are sent, when the inhibit
  /// time allows.
  virtual void changed(std::uint16_t index, std::uint8_t sub, Time now) = 0;

  /// What stands at these terminals of the device has become another value.
  virtual void terminals(std::uint16_t /*index*/, std::uint8_t /*sub*/, std::int32_t /*before*/,
                         std::int32_t /*after*/, Time /*now*/) {}

  /// For people, where injected faults are told too.
  virtual void tell(std::string_view /*text*/, Time /*now*/) {}
  /// Injects a fault of the node, written as in commands; returns what is wrong with it, or nothing.
  virtual std::string inject(std::string_view /*fault*/, Time /*now*/) { return {}; }

 protected:
  ~DeviceNode() = default;
};

/// As it stands: values that stay as they were written. What its constructor writes into the dictionary is
/// the power-on value there: the defaults of objects that the file gives no value (Bound does that).
class Behaviour {
 public:
  virtual ~Behaviour() = default;

  /// After power-on, reset node and reset communication, when the values have been restored. Whatever the
  /// device was doing is over when `application`; a reset of the communication alone leaves it be.
  virtual void reset(bool /*application*/, Time /*now*/) {}

  /// Brings all values up to `now`, acts on what has been written, and says when to be called next; kNever =
  /// only after a change.
  virtual Time update(Time /*now*/) { return kNever; }

  /// Before a value is stored by SDO: kNone, or why the device refuses it. Length, access and limits have
  /// been checked; update() follows if it is stored.
  virtual AbortCode check(const ObjectEntry& /*entry*/, std::uint8_t /*sub*/,
                          std::span<const std::uint8_t> /*value*/, Time /*now*/) {
    return AbortCode::kNone;
  }

  /// A SYNC: synchronous RPDOs have been applied, synchronous TPDOs are sampled after it. update() follows.
  virtual void on_sync(Time /*now*/) {}

  /// This state has been entered, perhaps anew. update() follows.
  virtual void on_state(nmt::State /*state*/, Time /*now*/) {}

  /// The network has failed or the node has left Operational because of it: outputs to their error values,
  /// drives as their option codes say. update() follows. Starting the node again ends it.
  virtual void on_network_failure(NetworkFailure /*failure*/, Time /*now*/) {}

  /// Commands and set points of the master's: 1010h stores them as little as it does measured values.
  virtual bool is_set_point(std::uint16_t /*index*/) const { return false; }

  /// The world outside gives an input this value (a signal of the plant file, a command at run time). False =
  /// this device has no such input: the node then stores the value itself, where the dictionary has it.
  /// update() follows.
  virtual bool set_input(std::uint16_t /*index*/, std::uint8_t /*sub*/, double /*value*/, Time /*now*/) {
    return false;
  }

  /// What stands at the terminals of an output, after all that the device does with what is written to this
  /// object; none = the device has no such terminals. As it was at the last update().
  virtual std::optional<double> output(std::uint16_t /*index*/, std::uint8_t /*sub*/) const {
    return std::nullopt;
  }

  /// What can be done to this device from outside, by name: "overtemperature", "limit-switch-positive".
  virtual std::span<const std::string_view> incidents() const { return {}; }
  /// One of them begins, or ends. update() follows.
  virtual void set_incident(std::string_view /*incident*/, bool /*present*/, Time /*now*/) {}
};

/// Why there can be no such behaviour: "tank.lua:12: ...".
class BehaviourProblem : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes the behaviour of a node; both live as long as the node. `seed` is the node's own, for noise. May
/// throw BehaviourProblem.
using BehaviourMaker = std::function<std::unique_ptr<Behaviour>(DeviceNode& node, std::uint64_t seed)>;

}  // namespace cbcan::sim
