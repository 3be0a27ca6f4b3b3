// SPDX-License-Identifier: MIT
#pragma once

/// A plant in this process, for tests: a virtual CAN bus, simulated nodes, and the CBCAN module with its
/// registers. Time is virtual and passes when it is told to, so a test is the same every time. No socket, no
/// thread, no clock; of files only the plant's own are read. What the plant file says about Modbus,
/// SocketCAN, SLCAN, logs and files of parameters is left out.
///
///     cbcan::Plant plant = cbcan::Plant::from_file("plant.toml");
///     plant.write(3700, {0xCA0E, 5055, 0x42, 0x6411, 1, 2});
///     REQUIRE(plant.wait("transaction ended"));
///     CHECK(plant.registers(3705, 2) == std::vector<std::uint16_t>{2, 300});
///
/// Commands and conditions are those of docs/reference/commands.md.

#include <chrono>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cbcan {

/// What is wrong with a plant, a command or a condition: lines for people.
class PlantError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Not re-entrant; any number of them. All functions but those that say otherwise throw PlantError.
class Plant {
 public:
  using Duration = std::chrono::microseconds;
  using Words = std::vector<std::uint16_t>;

  /// A plant file, docs/reference/plant-file.md.
  static Plant from_file(const std::string& path);
  /// The text of one; paths in it are relative to `folder`.
  static Plant from_text(std::string_view toml, const std::string& folder = ".");
  /// The plant of `cbcan-sim --demo`.
  static Plant demo();

  Plant(Plant&& other) noexcept;
  Plant& operator=(Plant&& other) noexcept;
  ~Plant();

  /// The PLC writes registers, in one Modbus request. `unit`: the network, from 1. What it brings about at
  /// this time has happened when it returns.
  void write(std::uint16_t first, const Words& words, unsigned unit = 1);
  Words registers(std::uint16_t first, std::size_t count, unsigned unit = 1);

  /// Since the plant was switched on.
  Duration now() const;
  void advance(Duration duration);

  /// A command, "fault 5 response-never count=1"; returns the response without "ok" and without line ends at
  /// its end.
  std::string command(std::string_view line);

  /// Lets time pass until the condition holds: "state 5 operational"; false where it does not in time.
  bool wait(std::string_view condition, Duration within = std::chrono::seconds(60));
  /// Whether it holds now; events do not count.
  bool holds(std::string_view condition);

  /// What has been on the buses since the start or the last call, as candump writes it:
  /// "605#4017100000000000", of network 2 "2/605#...". 100,000 at most; those before are gone.
  std::vector<std::string> frames();

 private:
  struct Inside;
  explicit Plant(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace cbcan
