// SPDX-License-Identifier: MIT
#include "web/mapped.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/boot_failure.hpp"

namespace cbcan::web {

namespace {

constexpr std::uint16_t kPdos = 512;
constexpr std::uint16_t kToMapping = object::kRpdoMapping - object::kRpdoParameter;

/// One object of a PDO by its mapping parameter, and the bit where it begins in the frame.
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

/// The register in which a network variable begins, if those of its direction begin at `first` and `further`.
std::size_t place_of(const Mapped& variable, std::size_t first, std::size_t further) {
  using namespace local::table;
  const unsigned index = unsigned{variable.index} % kIndicesOfType;
  const unsigned element = (index < kFurther ? index : index - kFurther) * kMostSubs + variable.sub - 1u;
  return (index < kFurther ? first : further) + element * variable.bits / 16;
}

struct FarPdo {
  const Device* device;
  std::uint16_t parameter;
};
using FarPdos = std::multimap<std::uint32_t, FarPdo>;

/// The simulated nodes' valid PDOs of one direction by their identifiers.
FarPdos far_pdos(plant::Network& network, std::uint16_t first) {
  FarPdos found;
  for (const auto& node : network.world().nodes()) {
    const Device& device = node->device();
    for (const ObjectEntry& entry : device.dictionary().entries()) {
      if (!entry.holds(entry.index, 1) || entry.last_index() < first || entry.index >= first + kPdos)
        continue;
      for (unsigned pdo = entry.index; pdo <= entry.last_index(); ++pdo) {
        const auto parameter = static_cast<std::uint16_t>(pdo);
        const std::uint64_t cob_id = device.dictionary().get(parameter, 1);
        if ((cob_id & cob::kInvalid) == 0)
          found.emplace(cob::id_of(static_cast<std::uint32_t>(cob_id)), FarPdo{&device, parameter});
      }
    }
  }
  return found;
}

/// What is at this bit of the frame, by the PDO of a simulated node with the same identifier.
std::string far_side(std::uint8_t number, const FarPdos& pdos, std::uint32_t can_id, unsigned at,
                     const journal::FindName& find) {
  const auto [begin, end] = pdos.equal_range(can_id);
  for (auto pdo = begin; pdo != end; ++pdo) {
    for (const Mapped& object : mapping_of(pdo->second.device->dictionary(), pdo->second.parameter)) {
      if (at < object.at || at >= object.at + object.bits) continue;
      const std::uint8_t id = pdo->second.device->node_id();
      const descriptions::Object* const name = find(number, id, object.index, object.sub);
      return fmt::format("node {} {:04X}h:{:02X} {}", id, object.index, object.sub,
                         name == nullptr ? "" : name->name);
    }
  }
  return fmt::format("PDO {:03X}h", can_id);
}

}  // namespace

MappedRegisters mapped_registers(std::uint8_t number, plant::Network& network,
                                 const journal::FindName& find) {
  MappedRegisters found;
  if (network.module() == nullptr) return found;
  const ObjectDictionary& own = network.module()->coprocessor().own_objects();
  const std::size_t first_register = network.module_config().process_first;
  const std::size_t further_first = network.module()->further_first();
  const auto add = [&](std::uint16_t own_first, std::uint16_t far_first, std::uint16_t variables,
                       std::size_t first, std::size_t further) {
    std::optional<FarPdos> pdos;
    ObjectEntry entry{};
    for (std::uint16_t pdo = own_first; own.find(pdo, 1, entry) == AbortCode::kNone; ++pdo) {
      const auto cob_id = static_cast<std::uint32_t>(own.get(pdo, 1));
      if ((cob_id & cob::kInvalid) != 0) continue;
      if (!pdos) pdos = far_pdos(network, far_first);
      for (const Mapped& variable : mapping_of(own, pdo)) {
        if (variable.index < variables || variable.sub == 0) continue;
        std::string& text = found[place_of(variable, first, further)];
        const std::string far = far_side(number, *pdos, cob::id_of(cob_id), variable.at, find);
        if (!text.ends_with(far))
          text += (text.empty() ? "" : ", ") + far;  // one object may be two variables
      }
    }
  };
  add(object::kRpdoParameter, object::kTpdoParameter, local::kInputs, first_register, further_first);
  add(object::kTpdoParameter, object::kRpdoParameter, local::kOutputs, first_register + regmap::kInputWords,
      further_first + regmap::kFurtherWords);
  return found;
}

Json boots_of(plant::Network& network) {
  const std::size_t first = network.module_config().status_first + regmap::kStatusNodes;
  Json list = Json::array();
  for (std::uint8_t node = 1; network.module() != nullptr && node <= nmt::kMaxNode; ++node) {
    const unsigned step = network.registers()[first + node] >> 8;
    const std::string& failure = network.watch()->boot_failure(node);
    const bool failed = step >= 'A';
    const std::string words = failed && !failure.empty()
                                  ? failure
                                  : descriptions::boot_step_text(network.registers()[first + node]);
    if (step != 0) list.push_back({{"node", node}, {"failed", failed}, {"words", base::to_utf8(words)}});
  }
  return list;
}

}  // namespace cbcan::web
