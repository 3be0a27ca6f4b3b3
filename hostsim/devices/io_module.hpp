// SPDX-License-Identifier: MIT
#pragma once

/// An I/O module (CiA 401): one block of eight digital inputs or outputs for each sub-index of 6000h and 6200h,
/// one analogue input or output of 16 bits for each of 6401h and 6411h. docs/reference/devices.md lists the
/// objects. An object that is missing, or has another size, has the profile's default.
///
/// Interrupts are reported by DeviceNode::changed() of 6000h or 6401h. An analogue interrupt needs 6423h, a
/// change of the value, one of the limits selected in 6421h (if any) and one of the deltas (if any); deltas
/// count from the value at the last interrupt. 6422h shows all channels with an interrupt at the latest time at
/// which there was one.
///
/// Outputs have their error values from a network failure or NMT Stopped until the node is Operational again;
/// 6200h and 6411h keep the written values.
///
/// Incidents: "output-short-circuit" (EMCY 2320h) and "input-voltage-low" (3120h).

#include <cstdint>
#include <vector>

#include "devices/incidents.hpp"
#include "devices/io_channels.hpp"
#include "sim/behaviour.hpp"

namespace cbcan::devices {

class IoModule final : public DeviceWithIncidents {
 public:
  explicit IoModule(sim::DeviceNode& node);

  void reset(bool application, Time now) override;
  Time update(Time now) override;
  void on_state(nmt::State state, Time now) override;
  void on_network_failure(sim::NetworkFailure /*failure*/, Time /*now*/) override { failed_ = true; }
  bool is_set_point(std::uint16_t index) const override;
  /// 6200h: the levels at eight terminals, bit 0 is the first. 6411h: in the object's unit. After polarity,
  /// filter mask and error values.
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override;
  /// 6000h: levels at eight terminals, 0..255. 6401h: the number to show. Both are rounded.
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override;
  std::vector<sim::Point> points() const override;

 private:
  struct InterruptSource : sim::Bound<std::uint32_t> {
    InterruptSource(ObjectDictionary& dictionary, std::uint8_t sub) : Bound(dictionary, 0x6422, sub) {}
  };

  void note_source(std::size_t channel, Time now);
  void tell(Time now);
  template <class Channel>
  void tell_terminals(std::vector<Channel>& channels, std::uint16_t index, Time now);

  sim::Bound<std::uint8_t> digital_interrupts_;
  sim::Bound<std::uint8_t> analogue_interrupts_;
  std::vector<DigitalInput> digital_inputs_;
  std::vector<DigitalOutput> digital_outputs_;
  std::vector<AnalogueInput> analogue_inputs_;
  std::vector<AnalogueOutput> analogue_outputs_;
  std::vector<InterruptSource> interrupt_sources_;
  Time interrupt_at_ = kNever;
  bool failed_ = false;
  bool begun_ = false;        ///< before the first reset, terminals are not reported
  bool interrupted_ = false;  ///< an interrupt is to be reported
};

}  // namespace cbcan::devices
