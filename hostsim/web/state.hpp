// SPDX-License-Identifier: MIT
#pragma once

/// The state of a plant as JSON: program, nodes and registers, and their changes (docs/reference/http.md).

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "cbcan/regmap.hpp"
#include "journal/event_text.hpp"
#include "plant/network.hpp"
#include "web/api.hpp"

namespace cbcan::web {

using MappedRegisters = std::map<std::size_t, std::string>;

/// Maps a register to "node 16 6041h:00 Statusword", by the module's valid PDOs: the node has a PDO with the
/// same COB-ID, which maps the object at the same place. "PDO 385h" if there is no such node.
MappedRegisters mapped_registers(std::uint8_t number, plant::Network& network, const journal::FindName& find);

/// The nodes that the module boots, also those that are not simulated: the step of the boot, or what is
/// wrong.
Json boots_of(plant::Network& network);

struct NamedRegister {
  const regmap::RegisterRow* row = nullptr;  ///< null: without a name
  unsigned channel = 1;                      ///< whose scanner window it is in
  std::int32_t said = -1;                    ///< last value that a stream has sent
};

/// Names by address. Takes account of the ranges that the configuration has moved.
std::vector<NamedRegister> names_in(const config::ModuleConfig& module);

void append_register(base::Buffer& to, std::size_t address, const NamedRegister& named, std::uint16_t value,
                     const MappedRegisters& mapped);

/// `place` counts from 0.
void append_node(base::Buffer& to, plant::Control& control, std::size_t network, std::size_t place);

/// The program, its clock and its buses, as members of an object.
void append_about(base::Buffer& to, const ApiParts& parts);

/// Nodes and registers of a network: at first all, then those that have changed, in messages of bounded size.
class StateChanges {
 public:
  static constexpr Time kInterval = 50 * kMillisecond;

  StateChanges(const ApiParts& parts, std::size_t network);
  /// Is to be called at about this interval.
  void append(base::Buffer& to);

 private:
  // Each item begins with a comma. What has no room comes with the next message.
  void append_nodes(base::Buffer& to);
  void append_registers(base::Buffer& to);
  void look_at_mapping();

  const ApiParts& parts_;
  std::size_t number_;
  plant::Network& network_;
  std::vector<NamedRegister> names_;
  std::vector<std::string> nodes_;  ///< as they have been sent
  std::size_t next_node_ = 0;
  MappedRegisters mapped_;
  unsigned calls_ = 0;
};

}  // namespace cbcan::web
