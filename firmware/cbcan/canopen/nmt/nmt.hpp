// SPDX-License-Identifier: MIT
#pragma once

/// NMT: states, commands and their frames (CiA 301, 7.2.8).

#include <cstdint>

#include "cbcan/frame.hpp"

namespace cbcan::nmt {

/// NMT states as encoded in heartbeat and node guarding messages.
enum class State : std::uint8_t { kInitialising = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

/// Command specifiers.
enum class Command : std::uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kEnterPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};

inline constexpr std::uint32_t kCommandId = 0x000;
inline constexpr std::uint32_t kErrorControlId = 0x700;  ///< + node ID: boot-up, heartbeat, node guarding
inline constexpr std::uint8_t kAllNodes = 0;
inline constexpr std::uint8_t kMaxNode = 127;

/// Bit 7 of a node guarding response alternates; the rest is the state.
inline constexpr std::uint8_t kGuardToggle = 0x80;
inline constexpr std::uint8_t kStateMask = 0x7F;

constexpr bool is_state(std::uint8_t value) {
  switch (static_cast<State>(value)) {
    case State::kInitialising:
    case State::kStopped:
    case State::kOperational:
    case State::kPreOperational: return true;
  }
  return false;
}

/// SDO, SYNC, TIME and EMCY work in Pre-operational and Operational; in the other states only NMT and error
/// control do (CiA 301, table 37). They have the highest numbers.
constexpr bool is_running(State state) {
  return state >= State::kOperational;
}

/// A master's command: specifier, node ID.
constexpr bool is_command(const Frame& frame) {
  if (frame.id != kCommandId || frame.flags != 0 || frame.length < 2) return false;
  const auto command = static_cast<Command>(frame.data[0]);
  return command == Command::kStart || command == Command::kStop ||
         (command >= Command::kEnterPreOperational && command <= Command::kResetCommunication);
}

constexpr Frame command_frame(Command command, std::uint8_t node) {
  return {kCommandId, 2, 0, {static_cast<std::uint8_t>(command), node}};
}

constexpr Frame error_control_frame(std::uint8_t node, std::uint8_t state_and_toggle) {
  return {kErrorControlId + node, 1, 0, {state_and_toggle}};
}

/// Asks a node for its state. The DLC of a remote frame is that of the requested frame (ISO 11898-1).
constexpr Frame guard_request(std::uint8_t node) {
  return {kErrorControlId + node, 1, Frame::kRemote, {}};
}

}  // namespace cbcan::nmt
