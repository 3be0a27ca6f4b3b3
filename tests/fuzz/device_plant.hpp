// SPDX-License-Identifier: MIT
#pragma once

/// Three simulated nodes in virtual time, and promises that they keep whatever happens. The promises are checked
/// for every sent frame, and after every step of time.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/kept_parameters.hpp"
#include "support/bare_network.hpp"

namespace cbcan::fuzz {

struct PlantOptions {
  std::uint32_t bit_rate = 0;  ///< see Bus; not 0: less is known of waiting frames
  bool signals = false;        ///< the I/O module's inputs move
  bool stores = true;          ///< parameters can be stored
  bool by_deadlines = true;    ///< false: time passes in one step, without intermediate checks
};

struct DevicePlant final : private sim::Observer, private sim::FrameModifier {
  static constexpr std::size_t kNodes = 3;
  enum Place : std::uint8_t { kIoModule, kDrive, kWithoutId };

  explicit DevicePlant(const PlantOptions& options);

  sim::Node& node(std::size_t place) { return *nodes_[place].node; }
  std::uint8_t id(std::size_t place) const { return nodes_[place].node->device().node_id(); }

  /// A frame from a master. Checks that an SDO request gets one response, if that is certain.
  void receive(const Frame& frame);

  /// Lets time pass until `end`, or until the limit of a run; returns that time.
  Time advance_to(Time end);

  void add_fault(std::size_t place, const sim::Fault& fault);
  void add_bus_fault(const sim::Fault& fault);

  /// Completes the effects of outside changes, and checks the promises.
  void settle();

  struct Seen {
    Time at;
    Frame frame;
    friend bool operator==(const Seen&, const Seen&) = default;
  };
  const std::vector<Seen>& seen() const { return seen_; }

  test::BareNetwork bare;
  plant::Network& network = bare.network;
  sim::World& world = network.world();
  Time& now = bare.now;

 private:
  struct Watched {
    sim::Node* node = nullptr;
    test::KeptParameters store;
    unsigned states = 0;     ///< the states in which waiting frames may have been sent
    unsigned responses = 0;  ///< number of SDO responses
    bool harmed = false;     ///< has had a fault: delayed frames may still arrive
    bool in_block = false;   ///< an SDO block transfer may be in progress
  };

  void add(std::size_t place, std::uint8_t id, const char* eds, sim::NodeParts parts);
  void on_bus_frame(const Frame& frame, Time at) override;
  void on_arrival(const Frame& frame, const sim::Port* sender, Time at) override;
  void check_frame(Watched& sender, const Frame& frame);
  void check_configured_frame(Watched& sender, const Frame& frame);
  void check_states();
  bool is_heard(Watched& node);
  bool is_answered_once(Watched& node, const Frame& request);
  void note_states();
  void forget_states();
  void advance(Time time);

  PlantOptions options_;
  std::array<Watched, kNodes> nodes_;
  std::vector<Seen> seen_;
  unsigned steps_left_ = 800;
  unsigned frames_at_once_ = 0;
};

}  // namespace cbcan::fuzz
