// SPDX-License-Identifier: MIT
#pragma once

/// Replaces a part that a Device is built without (cbcan/services.hpp); does nothing.

#include <cstddef>
#include <cstdint>

#include "cbcan/canopen/emcy/emergency.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/canopen/time_stamp.hpp"

namespace cbcan {

class NoPart : public Part {
 public:
  /// Takes the arguments of any part's constructor.
  explicit NoPart(const auto&... /*arguments*/) {}

  // The functions that Device and applications call: of a Sync,
  static constexpr bool take() { return false; }
  static constexpr std::uint8_t counter() { return 0; }
  static constexpr bool misfits() { return false; }
  static constexpr Time window() { return 0; }
  // of an Emergency,
  static void error(std::uint16_t /*code*/, std::uint8_t /*register_bits*/, const Emergency::Info& /*info*/,
                    Time /*now*/) {}
  static void error_over(std::uint16_t /*code*/, Time /*now*/) {}
  static constexpr bool has(std::uint16_t /*code*/) { return false; }
  static void forget(bool /*application*/) {}
  // of a TimeStamp,
  static constexpr TimeOfDay at(Time /*now*/) { return {}; }
  static void set(const TimeOfDay& /*time*/, Time /*now*/) {}
  static void produce(Time /*now*/) {}
  // of a HeartbeatConsumer and a LifeGuard,
  static constexpr std::size_t lost() { return 0; }
  // of a Pdo,
  static void request(std::uint16_t /*number*/, Time /*now*/) {}
  static constexpr bool load_one(std::size_t /*k*/, Time /*now*/) { return false; }
  static constexpr bool on_sync(const auto&... /*arguments*/) { return false; }
  static void changed(const auto&... /*arguments*/) {}
  static void look_for_changes(Time /*now*/) {}
  static constexpr bool has_received(std::size_t /*number*/) { return true; }
  static void forget_received(std::size_t /*number*/) {}
  static void hold_tpdos(bool /*held*/, Time /*now*/) {}
  // and of a DeviceLss.
  static void start(std::uint8_t /*node_id*/, Time /*now*/) {}
  static constexpr std::uint8_t reset_communication(Time /*now*/) { return 0; }
};

}  // namespace cbcan
