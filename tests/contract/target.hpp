// SPDX-License-Identifier: MIT
#pragma once

/// What the suite of the register contract sees of a coprocessor: the registers of a PLC, the far side of its
/// CAN bus, and time. A target may be the core in virtual time, a program behind Modbus TCP or an image on a
/// microcontroller: each has an adapter that defines make_target(), and links the same cases.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cbcan::contract {

using namespace std::chrono_literals;
using Duration = std::chrono::microseconds;
using Words = std::vector<std::uint16_t>;

/// What a target may be unable to do; the cases that need it are then reported as skipped, with its reason.
enum class Ability {
  kBusState,      ///< set_bus_state()
  kRefusal,       ///< refuse_frames()
  kSecondReader,  ///< first_done()
  kChannels,      ///< 16 channels
  kSettings,      ///< Settings other than the defaults, plc_timeout of one second left out
  kBlock,         ///< block transfer: what is looked at in every phase is not in its phases
};

enum class BusState { kActive, kOverflow, kErrorPassive, kBusOff };

struct Settings {
  Duration state_fresh_for = 2s;
  Duration guard_timeout = 100ms;
  unsigned process_first = 3800;  ///< register addresses where process data and the scanner's blocks begin
  unsigned scanner_out_first = 500;
  unsigned scanner_in_first = 600;
  Duration plc_timeout = 0ms;     ///< silence of the PLC that is too long; 0 = none is
  bool plc_lost_stopped = false;  ///< the own node's state then: stopped instead of pre-operational
};

/// A coprocessor with node ID 127 that has just been started: boot-up message sent, all registers 0. Every
/// call returns when the coprocessor has dealt with what it was given. Frames are text as candump writes it:
/// "605#4000200100000000", "705#R1".
struct Target {
  virtual ~Target() = default;

  /// Why this target cannot do it; "" = it can.
  virtual std::string lacks(Ability ability) const = 0;

  /// One request of the PLC: it is applied whole. `first` is a register address, 3700..3769, one of the 128
  /// of process data or one of the scanner window; at most 123 words, the most that a request of Modbus has.
  virtual void write(unsigned first, const Words& words) = 0;
  virtual Words read(unsigned first, std::size_t count) = 0;
  /// FC 23: one request that writes and then reads.
  virtual Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) = 0;

  /// The next frame that the coprocessor has put on the bus; "" when there is none.
  virtual std::string next_frame() = 0;
  /// A frame of somebody else's.
  virtual void arrive(const std::string& frame) = 0;

  virtual void pass(Duration duration) = 0;
  /// How exactly pass() and the target's own clock keep time.
  virtual Duration precision() const = 0;

  virtual void set_bus_state(BusState state) = 0;
  /// The CAN controller takes no more frames, or takes them again.
  virtual void refuse_frames(bool refuse) = 0;
  /// Runs `ending` while a second reader reads the registers without pause: the first 70 words that it saw
  /// with R3700 no longer CA0Eh; none if that did not happen.
  virtual Words first_done(const std::function<void()>& ending) = 0;
};

/// Defined by the adapter.
std::unique_ptr<Target> make_target(const Settings& settings);

}  // namespace cbcan::contract
