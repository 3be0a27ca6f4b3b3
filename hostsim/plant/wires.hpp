// SPDX-License-Identifier: MIT
#pragma once

/// The wires of a plant at work: what stands at outputs and objects is given to inputs, also across networks,
/// which then go through time together. Each change is passed on at the time at which it happens, so nothing
/// depends on how time is cut into steps.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "config/config.hpp"
#include "plant/network.hpp"
#include "sim/wire.hpp"

namespace cbcan::plant {

class Wires final : private sim::Timed {
 public:
  /// `networks`: all of `config`'s, in order, which outlive it and have not been started. Their advance() is
  /// that of all from now on, where there are wires.
  Wires(const config::Config& config, std::vector<Network*> networks, const NetworkContext& context);
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  /// All networks, to the context's time.
  void advance();
  Time next_deadline() const;

 private:
  /// What a node of a wire says, see sim::Node::watch().
  struct Watched {
    bool active = true;
    bool fresh = false;  ///< it is being looked at
  };
  struct End {
    sim::Node* node;
    Watched* watched;
    sim::Terminal terminal;
  };
  struct ActiveWire {
    End from;
    End to;
    sim::Wire wire;
    Time sample_period;
    Time sample_due;                   ///< of an object, which may flow; kNever for an output
    std::uint64_t* bits;               ///< of all wires to bits of this object
    Time due = kNever;                 ///< then something comes out at the end
    std::optional<double> given = {};  ///< to the input; none = nothing since it has power
  };

  void poll(Time /*now*/) override { advance(); }
  Time own_deadline() const;
  End end(const config::Config& config, const config::WireEnd& end);
  void begin();
  void advance_to(Time time);
  void sample(ActiveWire& wire);
  bool deliver(ActiveWire& wire);
  bool has_activity() const;

  const Time& now_;
  std::vector<Network*> networks_;
  std::map<sim::Node*, Watched> watched_;
  std::map<std::tuple<sim::Node*, std::uint16_t, std::uint8_t>, std::uint64_t> bits_;
  std::vector<ActiveWire> wires_;
  bool begun_ = false;
  Time at_ = 0;          ///< all networks are there
  unsigned rounds_ = 0;  ///< in which inputs were given something at this time
  Time held_until_ = 0;  ///< what has happened is looked at then: wires and devices go round in a loop
};

}  // namespace cbcan::plant
