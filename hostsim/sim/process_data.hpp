// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "cbcan/coprocessor/local_node.hpp"

namespace cbcan::sim {

/// The memory of a module's own node with kPdos RPDOs and TPDOs. Its objects are those of every coprocessor,
/// and the network variables of further registers.
class ProcessData {
 public:
  static constexpr std::size_t kPdos = 64;

  /// `block`: registers, which outlive it. `process`, `further`: places in it of the usual process data, and
  /// of further inputs and outputs; 0 = there are no further ones.
  ProcessData(std::span<std::uint16_t> block, std::size_t process, std::size_t further);

  /// The memory as after power on; valid until the next call.
  const OwnNodeMemory& fresh();

 private:
  std::vector<ObjectEntry> entries_;
  std::vector<std::uint8_t> power_on_, values_;
  std::span<std::uint16_t> block_;
  std::vector<Pdo::Rpdo> rpdos_;
  std::vector<Pdo::Tpdo> tpdos_;
  std::vector<PdoMapping::Piece> pieces_;
  OwnNodeMemory memory_;
};

}  // namespace cbcan::sim
