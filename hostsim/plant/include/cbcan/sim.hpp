// SPDX-License-Identifier: MIT
#pragma once

/// A plant in this process, for tests: a virtual CAN bus, simulated nodes, and the CBCAN module with its
/// registers. Time is virtual and passes only in advance() and wait(), so a test is the same every time. No
/// socket, thread or clock is used, and only the files of the plant are read. Settings of the plant file for
/// Modbus, SocketCAN, SLCAN and logs are ignored; parameter files are read, not written.
///
///     cbcan::Plant plant = cbcan::Plant::from_file("plant.toml");
///     plant.write(3700, {0xCA0E, 5055, 0x42, 0x6411, 1, 2});
///     REQUIRE(plant.wait("register 3700 = 0"));
///     CHECK(plant.registers(3705, 2) == std::vector<std::uint16_t>{2, 300});
///
/// Commands and conditions are those of docs/reference/commands.md.

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cbcan {

namespace sim {
class Behaviour;
class DeviceNode;
}  // namespace sim

/// What is wrong with a plant, a command or a condition, as readable lines.
class PlantError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Any number of plants can exist; the functions are not re-entrant. All may throw PlantError unless they say
/// otherwise.
class Plant {
 public:
  using Duration = std::chrono::microseconds;
  using Words = std::vector<std::uint16_t>;

  using MakeDevice =
      std::function<std::unique_ptr<sim::Behaviour>(sim::DeviceNode& node, std::uint64_t seed)>;
  /// Devices in C++ of nodes of network 1, by node ID, instead of those of the plant file. Their manual,
  /// hostsim/sim/behaviour.hpp, is in the source tree, not in the package.
  using Devices = std::map<unsigned, MakeDevice>;

  /// A plant file, docs/reference/plant-file.md.
  static Plant from_file(const std::string& path, const Devices& devices = {});
  /// The text of a plant file; paths in it are relative to `folder`.
  static Plant from_text(std::string_view toml, const std::string& folder = ".", const Devices& devices = {});
  /// The plant of `cbcan-sim --demo`.
  static Plant demo();

  Plant(Plant&& other) noexcept;
  Plant& operator=(Plant&& other) noexcept;
  ~Plant();

  /// The PLC writes registers, in one Modbus request. `unit`: the network, from 1. All effects at the present
  /// time have happened when this returns.
  void write(std::uint16_t first, const Words& words, unsigned unit = 1);
  Words registers(std::uint16_t first, std::size_t count, unsigned unit = 1);

  /// Time since the plant was switched on.
  Duration now() const;
  void advance(Duration duration);

  /// A command, "fault 5 response-never count=1". Returns the response without "ok" and final line ends.
  std::string command(std::string_view line);

  /// Lets time pass until the condition holds: "state 5 operational". False = it did not hold in time.
  bool wait(std::string_view condition, Duration within = std::chrono::seconds(60));
  /// Whether it holds now; events do not count.
  bool holds(std::string_view condition);

  /// The frames on the buses since the start or the last call, as candump writes them: "605#4017100000000000", in
  /// network 2 "2/605#...". At most the last 100,000.
  std::vector<std::string> frames();

 private:
  struct Inside;
  explicit Plant(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace cbcan
