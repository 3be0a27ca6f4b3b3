// SPDX-License-Identifier: MIT
// The store of a coprocessor, apart from parameter_store.cpp: another device links without a coprocessor.
#include "boards/common/parameter_store.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/coprocessor/local_objects.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::boards {

namespace {

struct OfCoprocessor final : PowerOnValues {
  bool is_power_on(const ObjectDictionary& objects, const ObjectEntry& entry, std::uint8_t sub,
                   std::span<const std::uint8_t> bytes) const override {
    const std::uint64_t number = load_little_endian(bytes);
    if (entry.index == object::kConsumerHeartbeatTime) return number == 0;
    if (entry.index == object::kEmergencyCobId) {  // follows the node ID, which may differ next time
      std::array<std::uint8_t, 1> node;
      std::size_t size = 0;
      objects.read(local::kOwnNodeId, 0, node, size, 0);
      return number == 0x80u + node[0];
    }
    return !entry.has(ObjectFlags::kComputed) &&
           local::is_power_on(ObjectDictionary::first_bit(entry, sub) / 8, bytes);
  }
};
constexpr OfCoprocessor kOfCoprocessor;

}  // namespace

ParameterStore::ParameterStore(Flash& flash, Words settings, Valid valid)
    : log_(flash),
      settings_(settings),
      valid_(valid),
      address_(settings.size() == regmap::kBoardWords
                   ? settings.subspan(regmap::kBoardBitRate - regmap::kBoardFirst, kAddressWords)
                   : std::span<std::uint16_t>()),
      power_on_(kOfCoprocessor) {}

}  // namespace cbcan::boards
