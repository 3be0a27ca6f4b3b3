// SPDX-License-Identifier: MIT
#include "devices/drive/drive.hpp"

#include <cmath>
#include <utility>

#include "sim/number.hpp"

namespace cbcan::devices {

namespace {

constexpr std::size_t kPositiveEdge = 0;
constexpr std::size_t kNegativeEdge = 1;

// Bits of a probe's byte in 60B8h.
constexpr std::uint8_t kOn = 0x01;
constexpr std::uint8_t kContinuous = 0x02;
constexpr std::uint8_t kAtIndexPulse = 0x04;
constexpr std::uint8_t kPositiveEdgeBit = 0x10;  ///< then the negative edge

// Bits of a probe's byte in 60B9h.
constexpr std::uint8_t kIsOn = 0x01;
constexpr std::uint8_t kPositiveStored = 0x02;  ///< then the negative edge

/// Increments: clearly beyond a pulse.
constexpr double kBesidePulse = 1e-3;

}  // namespace

std::uint8_t TouchProbes::function(std::size_t probe) const {
  return static_cast<std::uint8_t>(objects_.probe_function.get() >> 8 * probe);
}

bool TouchProbes::update(Time now) {
  const double before = std::exchange(place_, axis_.place(now));
  unsigned status = 0;
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    Probe& probe = probes_[i];
    const std::uint8_t bits = function(i);
    const bool at_pulse = (bits & kAtIndexPulse) != 0;
    const bool was_on = probe.on;
    const bool is_edge = std::exchange(probe.level_before, probe.level) != probe.level;
    switch_on(i, bits);
    if (was_on && probe.on && at_pulse) note_pulse(i, before, place_);
    if (is_edge && probe.on && !at_pulse)
      store(i, probe.level ? kPositiveEdge : kNegativeEdge, axis_.actual(now).position);
    status |= (probe.on ? probe.stored | kIsOn : 0u) << 8 * i;
  }
  const bool changed = status != objects_.probe_status.get();
  objects_.probe_status.set(static_cast<std::uint16_t>(status));
  return changed;
}

void TouchProbes::switch_on(std::size_t probe, std::uint8_t function) {
  probes_[probe].on = (function & kOn) != 0;
  for (const std::size_t edge : {kPositiveEdge, kNegativeEdge})
    if ((function & kOn) == 0 || (function & kPositiveEdgeBit << edge) == 0)
      probes_[probe].stored &= static_cast<std::uint8_t>(~(kPositiveStored << edge));
}

/// The first between two places, the last of them included.
void TouchProbes::note_pulse(std::size_t probe, double before, double now) {
  const double pitch = axis_.index_pitch();
  const bool up = now > before;
  const double pulse = up ? std::floor(before / pitch) + 1 : std::ceil(before / pitch) - 1;
  if (up ? now / pitch < pulse : now / pitch > pulse) return;
  for (const std::size_t edge : {kPositiveEdge, kNegativeEdge})
    store(probe, edge, axis_.from_machine(pulse * pitch));
}

void TouchProbes::store(std::size_t probe, std::size_t edge, double position) {
  const std::uint8_t bits = function(probe);
  const auto stored = static_cast<std::uint8_t>(kPositiveStored << edge);
  const bool each = (bits & (kContinuous | kAtIndexPulse)) == kContinuous;
  const bool is_wanted = (bits & kPositiveEdgeBit << edge) != 0;
  if (!is_wanted || (!each && (probes_[probe].stored & stored) != 0)) return;
  probes_[probe].stored |= stored;
  objects_.probe_positions[2 * probe + edge].set(sim::rounded<std::int32_t>(axis_.user(position)));
}

Time TouchProbes::deadline(Time now) const {
  bool waits = false;
  for (std::size_t i = 0; i < probes_.size(); ++i)
    waits |= probes_[i].on && (function(i) & kAtIndexPulse) != 0;
  if (!waits || axis_.blocked() || axis_.load().exists() || axis_.at_rest(now)) return kNever;
  const double pitch = axis_.index_pitch();
  const double below = std::ceil(place_ / pitch) - 1;
  const double above = std::floor(place_ / pitch) + 1;
  return earlier(axis_.passes(axis_.from_machine(below * pitch - kBesidePulse), now),
                 axis_.passes(axis_.from_machine(above * pitch + kBesidePulse), now));
}

}  // namespace cbcan::devices
