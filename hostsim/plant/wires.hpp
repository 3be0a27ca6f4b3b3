// SPDX-License-Identifier: MIT
#pragma once

/// The wires of a running plant: values of outputs and objects are passed to inputs, also across networks,
/// which are then advanced together. Each change is passed on at the time at which it happens, so the result
/// does not depend on the steps of time.

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
  /// `networks`: all of `config`'s, in order, which outlive it and have not been started. If there are wires,
  /// the advance() of each advances all from now on.
  Wires(const config::Config& config, std::vector<Network*> networks, const NetworkContext& context);
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  /// All networks, to the context's time.
  void advance();
  Time next_deadline() const;

 private:
  /// Activity of a node with wires, see sim::Node::watch().
  struct Watched {
    bool active = true;
    bool fresh = false;  ///< to be sampled in this step
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
    Time sample_due;                   ///< of an object, which may change continuously; kNever for an output
    std::uint64_t* bits;               ///< shared by all wires to bits of this object
    Time due = kNever;                 ///< next change at the target
    std::optional<double> given = {};  ///< last value of the input; none = none since power-on
  };

  void poll(Time /*now*/) override { advance(); }
  Time own_deadline() const;
  End end(const config::Config& config, const config::WireEnd& end);
  void begin();
  void advance_to(Time time);
  void sample(ActiveWire& wire);
  bool deliver(ActiveWire& wire);
  std::optional<double> total_at(const ActiveWire& wire) const;

  const Time& now_;
  std::vector<Network*> networks_;
  std::map<sim::Node*, Watched> watched_;
  std::map<std::tuple<sim::Node*, std::uint16_t, std::uint8_t>, std::uint64_t> bits_;
  std::vector<ActiveWire> wires_;
  bool begun_ = false;
  Time at_ = 0;          ///< the time of all networks
  unsigned rounds_ = 0;  ///< with a changed input at this time
  Time held_until_ = 0;  ///< no sampling before: wires and devices form a loop
};

}  // namespace cbcan::plant
