// SPDX-License-Identifier: MIT
#include "app/mapped.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::app {

namespace {

// CiA 301: communication parameters; the mapping is 200h behind them.
constexpr std::uint16_t kReceive = 0x1400;
constexpr std::uint16_t kTransmit = 0x1800;
constexpr std::uint16_t kToMapping = 0x200;
constexpr std::uint16_t kPdos = 512;
constexpr std::uint32_t kNotValid = 0x80000000;
constexpr std::uint32_t kCanId = 0x1FFFFFFF;
constexpr unsigned kBooleans = 254;  ///< of an index

/// One object of a PDO, as its mapping parameter says, and the bit where it begins in the frame.
struct Mapped {
  std::uint16_t index;
  std::uint8_t sub;
  unsigned bits;
  unsigned at;
};

std::vector<Mapped> mapping_of(const ObjectDictionary& dictionary, std::uint16_t pdo) {
  std::vector<Mapped> list;
  unsigned at = 0;
  const auto parameter = static_cast<std::uint16_t>(pdo + kToMapping);
  const auto count = std::min<std::uint64_t>(dictionary.get(parameter, 0), 64);
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const auto entry = static_cast<std::uint32_t>(dictionary.get(parameter, sub));
    list.push_back(
        {static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8), entry & 0xFF, at});
    at += entry & 0xFF;
  }
  return list;
}

/// The bit among the 2048 of inputs, or of outputs, where a network variable begins.
unsigned place_of(const Mapped& variable, std::uint16_t first_index) {
  const unsigned booleans = first_index + 0x80u;
  if (variable.bits == 1) return (variable.index - booleans) * kBooleans + variable.sub - 1u;
  return (variable.sub - 1u) * variable.bits;
}

/// What stands at this bit of the frame, by the PDO of a simulated node with the same COB-ID.
std::string far_side(std::uint8_t number, scenario::Network& network, std::uint16_t first,
                     std::uint32_t cob_id, unsigned at, const journal::FindName& find) {
  for (const auto& node : network.world().nodes()) {
    const ObjectDictionary& dictionary = node->device().dictionary();
    ObjectEntry entry{};
    for (std::uint16_t pdo = first; pdo < first + kPdos; ++pdo) {
      if (dictionary.find(pdo, 1, entry) != AbortCode::kNone || dictionary.get(pdo, 1) != cob_id) continue;
      for (const Mapped& object : mapping_of(dictionary, pdo)) {
        if (at < object.at || at >= object.at + object.bits) continue;
        const std::uint8_t id = node->device().node_id();
        const eds::ObjectName* const name = find(number, id, object.index, object.sub);
        return fmt::format("node {} {:04X}h:{:02X} {}", id, object.index, object.sub,
                           name == nullptr ? "" : name->name);
      }
    }
  }
  return fmt::format("PDO {:03X}h", cob_id);
}

}  // namespace

std::map<std::size_t, std::string> mapped_registers(std::uint8_t number, scenario::Network& network,
                                                    const journal::FindName& find) {
  std::map<std::size_t, std::string> found;
  if (network.module() == nullptr) return found;
  const ObjectDictionary& own = network.module()->coprocessor().own_objects();
  const std::size_t first_register = network.module_config().process_first;
  const auto add = [&](std::uint16_t own_first, std::uint16_t far_first, std::uint16_t variables,
                       std::size_t first) {
    ObjectEntry entry{};
    for (std::uint16_t pdo = own_first; own.find(pdo, 1, entry) == AbortCode::kNone; ++pdo) {
      const auto cob_id = static_cast<std::uint32_t>(own.get(pdo, 1));
      if ((cob_id & kNotValid) != 0) continue;
      for (const Mapped& variable : mapping_of(own, pdo)) {
        if (variable.index < variables || variable.sub == 0) continue;
        std::string& text = found[first + place_of(variable, variables) / 16];
        text += (text.empty() ? "" : ", ") +
                far_side(number, network, far_first, cob_id & kCanId, variable.at, find);
      }
    }
  };
  add(kReceive, kTransmit, local::kInputs, first_register);
  add(kTransmit, kReceive, local::kOutputs, first_register + regmap::kInputWords);
  return found;
}

}  // namespace cbcan::app
