// SPDX-License-Identifier: MIT
#pragma once

/// The interface of the contract suite to a coprocessor: the registers of a PLC, the other nodes on its CAN
/// bus, and time. A target may be the core in virtual time, a program with Modbus TCP or an image on a
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

/// Abilities that a target may lack; the cases that need them are then reported as skipped, with its reason.
enum class Ability {
  kBusState,      ///< set_bus_state()
  kRefusal,       ///< refuse_frames()
  kSecondReader,  ///< first_done()
  kChannels,      ///< 16 channels
  kSecondClient,  ///< read_as_another()
  kSettings,      ///< Settings other than the defaults, except a plc_timeout of one second
  kMorePdos,      ///< 64 PDOs each way, and further registers of a network file
  kBlock,         ///< block transfer: cases that check every phase skip its phases
};

enum class BusState { kActive, kOverflow, kErrorPassive, kBusOff };

struct Settings {
  Duration state_fresh_for = 2s;
  Duration guard_timeout = 100ms;
  unsigned process_first = 3800;  ///< first registers of process data and of the scanner's blocks
  unsigned scanner_out_first = 500;
  unsigned scanner_in_first = 600;
  Duration plc_timeout = 0ms;     ///< longest silence of the PLC; 0 = no limit
  unsigned further_first = 0;     ///< of a network file without nodes; 0 = there is no such file
  bool plc_lost_stopped = false;  ///< the own node's state then: stopped instead of pre-operational
};

/// A newly started coprocessor with node ID 127: boot-up message sent, all registers 0. Every call returns
/// when the coprocessor has handled it. Frames are text in candump's format: "605#4000200100000000",
/// "705#R1".
struct Target {
  virtual ~Target() noexcept(false) {}  // one in this process checks at its end

  /// The reason why this target lacks the ability; "" = it has it.
  virtual std::string lacks(Ability ability) const = 0;

  /// One request of the PLC, applied as a whole. `first` is a register address, 3700..3769, one of the 128 of
  /// process data or one of the scanner window; at most 123 words, the limit of a Modbus request.
  virtual void write(unsigned first, const Words& words) = 0;
  virtual Words read(unsigned first, std::size_t count) = 0;
  /// A read by another client of Modbus than the PLC.
  virtual Words read_as_another(unsigned /*first*/, std::size_t /*count*/) { return {}; }
  /// FC 23: one request that writes and then reads.
  virtual Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) = 0;

  /// The next frame that the coprocessor has sent; "" = none.
  virtual std::string next_frame() = 0;
  /// A frame of another node.
  virtual void arrive(const std::string& frame) = 0;

  virtual void pass(Duration duration) = 0;
  /// Precision of pass() and of the target's own clock.
  virtual Duration precision() const = 0;

  virtual void set_bus_state(BusState state) = 0;
  /// The CAN controller refuses frames, or accepts them again.
  virtual void refuse_frames(bool /*refuse*/) {}
  /// Runs `ending` while a second reader reads the registers continuously: the first 70 words that it read
  /// with R3700 no longer CA0Eh; none if that did not happen.
  virtual Words first_done(const std::function<void()>& ending) = 0;
};

/// Defined by the adapter.
std::unique_ptr<Target> make_target(const Settings& settings);

}  // namespace cbcan::contract
