// SPDX-License-Identifier: MIT
#pragma once

/// The objects of CiA 402 that an axis reads and writes, looked up once. An object without value, or missing
/// from the dictionary, has the default given here. A limit of 0 is no limit. All modes are supported, but 2
/// and 7 only with 6042h and 60C1h, if 6502h is missing or has no value, or 0: EDS files leave that to the
/// drive.

#include <array>
#include <cstdint>

#include "sim/number.hpp"

namespace cbcan::devices {

/// Axis n of a node, from 0 on, has the objects of the first at this times n after them.
inline constexpr std::uint16_t kAxisStride = 0x800;

struct DriveObjects {
  struct Place {
    ObjectDictionary& dictionary;
    std::uint16_t offset;
  };
  template <class Number>
  struct Bound : sim::Bound<Number> {
    Bound(const Place& place, unsigned index, std::uint8_t sub, Number standard = {})
        : sim::Bound<Number>(place.dictionary, static_cast<std::uint16_t>(index + place.offset), sub,
                             standard) {}
  };
  /// A ramp of velocity mode: a change of velocity in a time in s.
  struct Slope {
    Slope(const Place& place, unsigned index) : speed(place, index, 1), time(place, index, 2, 1) {}
    Bound<std::uint32_t> speed;
    Bound<std::uint16_t> time;
  };
  /// A ratio: sub-indices 1 and 2.
  template <class Number>
  struct Quotient {
    Quotient(const Place& place, unsigned index, Number standard = {})
        : up(place, index, 1, standard), down(place, index, 2, standard) {}
    /// 1 if the file leaves one of them out or at 0.
    double value() const {
      const bool counts = up.get() != 0 && down.get() != 0;
      return counts ? double{1} * up.get() / down.get() : 1;
    }
    Bound<Number> up, down;
  };
  static constexpr std::uint32_t kNoLimit = 0xFFFFFFFF;
  // Bits of 6502h.
  static constexpr std::uint32_t kVelocityMode = 0x00000002;
  static constexpr std::uint32_t kInterpolatedMode = 0x00000040;
  static constexpr std::uint32_t kAllModes = 0x000003EF;

  explicit DriveObjects(ObjectDictionary& dictionary, std::uint16_t offset = 0) : d{dictionary, offset} {}

  /// Leaves out those for which the dictionary has no set-point.
  std::uint32_t modes() const {
    return kAllModes & ~(vl_target.exists() ? 0 : kVelocityMode) &
           ~(interpolation_data.exists() ? 0 : kInterpolatedMode);
  }
  bool supports(std::int8_t number) const {
    const std::uint32_t named = supported_modes.get();
    return ((named != 0 ? named : modes()) >> (number - 1) & 1) != 0;
  }

  Place d;
  std::uint16_t command = 0;  ///< the controlword that the drive acts on

  Bound<std::int16_t> abort_connection_option{d, 0x6007, 0, 1};
  Bound<std::uint16_t> error_code{d, 0x603F, 0};
  Bound<std::uint16_t> controlword{d, 0x6040, 0};
  Bound<std::uint16_t> statusword{d, 0x6041, 0};
  Bound<std::int16_t> vl_target{d, 0x6042, 0};
  Bound<std::int16_t> vl_demand{d, 0x6043, 0};
  Bound<std::int16_t> vl_actual{d, 0x6044, 0};
  Bound<std::uint32_t> vl_min{d, 0x6046, 1};
  Bound<std::uint32_t> vl_max{d, 0x6046, 2};
  Slope vl_acceleration{d, 0x6048};
  Slope vl_deceleration{d, 0x6049};
  Slope vl_quick_stop{d, 0x604A};
  Quotient<std::int16_t> vl_set_point_factor{d, 0x604B, 1};
  Quotient<std::int32_t> vl_dimension_factor{d, 0x604C, 1};
  Bound<std::int16_t> quick_stop_option{d, 0x605A, 0, 2};
  Bound<std::int16_t> shutdown_option{d, 0x605B, 0, 0};
  Bound<std::int16_t> disable_operation_option{d, 0x605C, 0, 1};
  Bound<std::int16_t> halt_option{d, 0x605D, 0, 1};
  Bound<std::int16_t> fault_reaction_option{d, 0x605E, 0, 2};
  Bound<std::int8_t> mode{d, 0x6060, 0};
  Bound<std::int8_t> mode_display{d, 0x6061, 0};

  Bound<std::int32_t> position_demand{d, 0x6062, 0};
  Bound<std::int32_t> position_actual_increments{d, 0x6063, 0};
  Bound<std::int32_t> position_actual{d, 0x6064, 0};
  Bound<std::uint32_t> following_error_window{d, 0x6065, 0, kNoLimit};
  Bound<std::uint16_t> following_error_time_out{d, 0x6066, 0};
  Bound<std::uint32_t> position_window{d, 0x6067, 0, kNoLimit};
  Bound<std::uint16_t> position_window_time{d, 0x6068, 0};
  Bound<std::int32_t> velocity_demand{d, 0x606B, 0};
  Bound<std::int32_t> velocity_actual{d, 0x606C, 0};
  Bound<std::uint16_t> velocity_window{d, 0x606D, 0};
  Bound<std::uint16_t> velocity_window_time{d, 0x606E, 0};
  Bound<std::uint16_t> velocity_threshold{d, 0x606F, 0};
  Bound<std::uint16_t> velocity_threshold_time{d, 0x6070, 0};
  Bound<std::int16_t> target_torque{d, 0x6071, 0};
  Bound<std::uint16_t> max_torque{d, 0x6072, 0, 1000};
  Bound<std::uint16_t> max_current{d, 0x6073, 0};
  Bound<std::int16_t> torque_demand{d, 0x6074, 0};
  Bound<std::uint32_t> rated_torque{d, 0x6076, 0};  ///< mNm
  Bound<std::int16_t> torque_actual{d, 0x6077, 0};
  Bound<std::int16_t> current_actual{d, 0x6078, 0};
  Bound<std::uint32_t> link_voltage{d, 0x6079, 0, 48'000};  ///< mV
  Bound<std::int32_t> target_position{d, 0x607A, 0};
  Bound<std::int32_t> range_min{d, 0x607B, 1};
  Bound<std::int32_t> range_max{d, 0x607B, 2};
  Bound<std::int32_t> home_offset{d, 0x607C, 0};
  Bound<std::int32_t> limit_min{d, 0x607D, 1};
  Bound<std::int32_t> limit_max{d, 0x607D, 2};
  Bound<std::uint32_t> max_profile_velocity{d, 0x607F, 0};
  Bound<std::uint32_t> max_motor_speed{d, 0x6080, 0};
  Bound<std::uint32_t> profile_velocity{d, 0x6081, 0, 1000};
  Bound<std::uint32_t> profile_acceleration{d, 0x6083, 0};
  Bound<std::uint32_t> profile_deceleration{d, 0x6084, 0};
  Bound<std::uint32_t> quick_stop_deceleration{d, 0x6085, 0};
  Bound<std::uint32_t> torque_slope{d, 0x6087, 0};
  Bound<std::int8_t> position_notation{d, 0x6089, 0};
  Bound<std::uint8_t> position_dimension{d, 0x608A, 0};
  Bound<std::int8_t> velocity_notation{d, 0x608B, 0};
  Bound<std::uint8_t> velocity_dimension{d, 0x608C, 0};
  Quotient<std::uint32_t> encoder{d, 0x608F, 1};  ///< increments / motor revolutions
  Quotient<std::uint32_t> gear{d, 0x6091, 1};     ///< motor revolutions / shaft revolutions
  Quotient<std::uint32_t> feed{d, 0x6092, 1};     ///< feed / shaft revolutions
  Quotient<std::uint32_t> position_factor{d, 0x6093};
  Quotient<std::uint32_t> velocity_encoder_factor{d, 0x6094};
  Quotient<std::uint32_t> velocity_factor{d, 0x6096, 1};
  Bound<std::int8_t> homing_method{d, 0x6098, 0};
  Bound<std::uint32_t> homing_speed_switch{d, 0x6099, 1, 1000};
  Bound<std::uint32_t> homing_speed_zero{d, 0x6099, 2, 100};
  Bound<std::uint32_t> homing_acceleration{d, 0x609A, 0};
  Bound<std::uint32_t> si_unit_position{d, 0x60A8, 0};
  Bound<std::uint32_t> si_unit_velocity{d, 0x60A9, 0};
  Bound<std::int32_t> position_offset{d, 0x60B0, 0};
  Bound<std::int32_t> velocity_offset{d, 0x60B1, 0};
  Bound<std::int16_t> torque_offset{d, 0x60B2, 0};
  Bound<std::uint16_t> probe_function{d, 0x60B8, 0};
  Bound<std::uint16_t> probe_status{d, 0x60B9, 0};
  /// Positive and negative edge of the first probe, then of the second.
  std::array<Bound<std::int32_t>, 4> probe_positions{
      {{d, 0x60BA, 0}, {d, 0x60BB, 0}, {d, 0x60BC, 0}, {d, 0x60BD, 0}}};
  Bound<std::int32_t> interpolation_data{d, 0x60C1, 1};
  Bound<std::uint32_t> interpolation_buffer{d, 0x60C4, 2, 1};
  Bound<std::uint16_t> interpolation_points{d, 0x60C4, 4};  ///< in the buffer
  Bound<std::uint8_t> interpolation_time{d, 0x60C2, 1, 1};
  Bound<std::int8_t> interpolation_exponent{d, 0x60C2, 2, -3};
  Bound<std::uint16_t> positioning_option{d, 0x60F2, 0};
  Bound<std::int32_t> following_error{d, 0x60F4, 0};
  Bound<std::int32_t> position_demand_increments{d, 0x60FC, 0};
  Bound<std::uint32_t> digital_inputs{d, 0x60FD, 0};
  Bound<std::uint32_t> digital_outputs{d, 0x60FE, 1};
  Bound<std::uint32_t> digital_outputs_mask{d, 0x60FE, 2, 0xFFFFFFFF};
  Bound<std::int32_t> target_velocity{d, 0x60FF, 0};
  Bound<std::uint32_t> supported_modes{d, 0x6502, 0, modes()};
};

}  // namespace cbcan::devices
