// SPDX-License-Identifier: MIT
#pragma once

/// The two touch probes (60B8h..60BDh). A probe's event is an edge of its input, or the index pulse of the
/// encoder (60B8h bit 2), which is both edges at its exact position. An edge is stored once until its bit (4,
/// 5) or the probe (0) is switched off; one of the input may also be stored each time (bit 1).

#include <array>
#include <cstddef>
#include <cstdint>

#include "devices/drive/axis.hpp"

namespace cbcan::devices {

class TouchProbes {
 public:
  TouchProbes(DriveObjects& objects, Axis& axis) : objects_(objects), axis_(axis) {}

  bool exist() const { return objects_.probe_function.exists(); }
  /// Input of the first (0) or the second probe (1); seen by the next update().
  void set_level(std::size_t probe, bool level) { probes_[probe].level = level; }
  bool level(std::size_t probe) const { return probes_[probe].level; }
  /// True = 60B9h has changed.
  bool update(Time now);
  /// The next index pulse that would be stored.
  Time deadline(Time now) const;

 private:
  struct Probe {
    bool level = false;
    bool level_before = false;
    bool on = false;
    std::uint8_t stored = 0;  ///< bits of 60B9h
  };
  std::uint8_t function(std::size_t probe) const;
  void switch_on(std::size_t probe, std::uint8_t function);
  void note_pulse(std::size_t probe, double before, double now);
  void store(std::size_t probe, std::size_t edge, double position);

  DriveObjects& objects_;
  Axis& axis_;
  std::array<Probe, 2> probes_{};
  double place_ = 0;  ///< at the last update
};

}  // namespace cbcan::devices
