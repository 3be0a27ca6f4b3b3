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

#include <array>
#include <cstdint>
#include <vector>

#include "cbcan/time.hpp"
#include "devices/common.hpp"
#include "sim/behaviour.hpp"
#include "sim/number.hpp"

namespace cbcan::devices {

/// A filtered input must be stable for this time before it is shown.
inline constexpr Time kInputFilterTime = milliseconds(3);

/// The main object of each kind: its sub-indices are the channels.
inline constexpr std::uint16_t kReadInput = 0x6000;
inline constexpr std::uint16_t kWriteOutput = 0x6200;
inline constexpr std::uint16_t kReadAnalogueInput = 0x6401;
inline constexpr std::uint16_t kWriteAnalogueOutput = 0x6411;

// The four kinds of channels, each with its objects, which share one sub-index. IoModule reports changes to
// the node.

/// Eight digital inputs: terminals -> filter 6003h -> polarity 6002h -> 6000h.
class DigitalInput {
 public:
  DigitalInput(ObjectDictionary& dictionary, std::uint8_t sub);

  bool exists() const { return value_.exists(); }
  void set_terminals(std::uint8_t levels, Time now);
  std::uint8_t terminals() const { return terminals_; }
  /// Passes inputs that have been stable long enough; returns when to call it again, or kNever.
  Time filter(Time now);
  /// Updates 6000h. True = a change selected by 6006h, 6007h or 6008h.
  bool refresh();

  bool interrupt = false;  ///< not yet reported to the node
  std::int32_t shown = 0;  ///< levels last reported to the node

 private:
  sim::Bound<std::uint8_t> value_, polarity_, filter_, any_change_, low_to_high_, high_to_low_;
  std::uint8_t terminals_;
  std::uint8_t filtered_;
  std::array<Time, 8> changed_at_{};
};

/// Eight digital outputs: 6200h or the error value 6207h -> polarity 6202h -> filter mask 6208h -> terminals.
class DigitalOutput {
 public:
  DigitalOutput(ObjectDictionary& dictionary, std::uint8_t sub);

  void switch_off() { terminals_ = 0; }
  void refresh(bool failed);
  std::uint8_t terminals() const { return terminals_; }

  std::int32_t shown = 0;  ///< as of DigitalInput

 private:
  sim::Bound<std::uint8_t> value_, polarity_, error_mode_, error_value_, filter_mask_;
  std::uint8_t terminals_ = 0;
};

/// One analogue input of 16 bits. Limits and deltas are in the unit of 6401h.
class AnalogueInput {
 public:
  AnalogueInput(ObjectDictionary& dictionary, std::uint8_t sub);

  bool exists() const { return value_.exists(); }
  void set_terminal(double value) { terminal_ = sim::rounded<std::int16_t>(value); }
  /// Updates 6401h. True = a change selected by 6421h with its limits and deltas.
  bool refresh();
  /// Deltas count from the present value from now on.
  void told() { told_ = terminal_; }

  bool interrupt = false;  ///< not yet reported to the node

 private:
  bool beyond_a_limit() const;
  bool far_enough() const;

  sim::Bound<std::int16_t> value_;
  sim::Bound<std::uint8_t> trigger_;
  sim::Bound<std::int32_t> upper_limit_, lower_limit_;
  sim::Bound<std::uint32_t> delta_, negative_delta_, positive_delta_;
  std::int16_t terminal_;
  std::int16_t told_;
};

/// One analogue output of 16 bits: 6411h, or the error value 6444h if 6443h enables it.
class AnalogueOutput {
 public:
  AnalogueOutput(ObjectDictionary& dictionary, std::uint8_t sub);

  void refresh(bool failed);
  std::int16_t terminals() const { return terminal_; }

  std::int32_t shown = 0;  ///< as of DigitalInput

 private:
  sim::Bound<std::int16_t> value_;
  sim::Bound<std::uint8_t> error_mode_;
  sim::Bound<std::int32_t> error_value_;
  std::int16_t terminal_ = 0;
};

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
