// SPDX-License-Identifier: MIT
// The tables of cbcan-eds: the same objects as the file, in fewer entries.

#include "dictionary/host_buses.hpp"
#include "io_module.hpp"

namespace cbcan::test {

namespace {

std::vector<std::uint8_t> values_of(const EdsDictionary& made) {
  std::vector<std::uint8_t> values(made.power_on.begin(), made.power_on.end());
  values.resize(made.value_bytes);
  change_node_id(values, made.node_id_values, 0, kNode);
  return values;
}

/// What a client can see of an object.
std::string seen(const ObjectDictionary& dictionary, std::uint16_t index, std::uint8_t sub) {
  ObjectEntry entry{};
  const AbortCode missing = dictionary.find(index, sub, entry);
  if (missing != AbortCode::kNone) return std::to_string(static_cast<std::uint32_t>(missing));
  constexpr std::uint16_t kAccess =
      ObjectFlags::kReadWrite | ObjectFlags::kLimited | ObjectFlags::kMapRpdo | ObjectFlags::kMapTpdo;
  static std::array<std::uint8_t, 1024> bytes;
  std::size_t size = 0;
  if (!entry.has(ObjectFlags::kComputed) || sub == 0)
    static_cast<void>(dictionary.read(index, sub, bytes, size, 0));
  return std::to_string(entry.flags & kAccess) + " " + std::to_string(static_cast<int>(entry.type)) + " " +
         std::string(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
}

}  // namespace

TEST_CASE("Each index and sub-index of a dictionary is that of its file") {
  for (std::size_t file = 0; file < std::size(dictionaries::kFiles); ++file) {
    INFO(dictionaries::kFiles[file].path);
    const EdsDictionary& made = *dictionaries::kFiles[file].dictionary;
    std::vector<std::uint8_t> values = values_of(made);
    descriptions::DictionaryImage image = descriptions::prepared(image_of(file));
    struct Handler final : ObjectHandler {
    } handler;
    const ObjectDictionary folded(made.entries, values, &handler, made.limits);
    const ObjectDictionary plain(image.entries, image.values, nullptr, image.limits);
    std::vector<bool> used(0x10000);
    for (const ObjectEntry& entry : image.entries)
      used[entry.index] = true;
    std::size_t different = 0;
    for (unsigned index = 0; index <= 0xFFFF; ++index) {
      const bool near = used[index] || used[(index + 1) & 0xFFFF] || used[(index - 1) & 0xFFFF];
      for (unsigned sub = 0; sub <= 0xFF; sub += near ? 1 : 0xFF) {
        const auto i = static_cast<std::uint16_t>(index);
        const auto s = static_cast<std::uint8_t>(sub);
        different += seen(folded, i, s) != seen(plain, i, s);
      }
    }
    CHECK(different == 0);
  }
}

TEST_CASE("The dictionary of the demo plant's I/O module is folded, and its zeros take no flash") {
  const EdsDictionary& made = io_module::kDictionary;
  CHECK(image_of(0).entries.size() > 0);
  CHECK(made.entries.size() == 48);
  CHECK(made.power_on.size() < made.value_bytes);
  CHECK(made.rpdos == 4);
  CHECK(made.tpdos == 4);
  CHECK(made.objects_of_pdo == 8);
  CHECK(made.watched_nodes == 2);
  CHECK(io_module::od::kProducerHeartbeatTime.index == 0x1017);
  CHECK(io_module::od::kVendorID.sub == 1);
}

TEST_CASE("What the stack does not have, and mistakes, are refused with their line") {
  const std::vector<std::string> refused(std::begin(dictionaries::kRefused),
                                         std::end(dictionaries::kRefused));
  const std::vector<std::string> expected{
      "binary.eds:1: there is no object in it, no section like [1000]: is this an EDS or DCF?",
      "empty.eds:1: there is no object in it, no section like [1000]: is this an EDS or DCF?",
      "main_without_subs.eds:5: [2000] should have sub-objects, but has none",
      "no_objects.eds:1: there is no object in it, no section like [1000]: is this an EDS or DCF?",
      "node_id_formula_mistakes.dcf:36: 2005h:00: its value with $NODEID does not fit each node ID 1..127",
      "node_id_formulas.dcf:55: 2008h:00: its value with $NODEID does not fit each node ID 1..127",
      "parameter_values.dcf:24: ParameterValue=\"x\" is no number of up to 64 bits",
      "places_out_of_range.eds:9: [0000]: an index is 1..FFFFh",
      "utf16.eds:1: this is UTF-16: save the file as ASCII or UTF-8",
  };
  CHECK(refused == expected);
}

}  // namespace cbcan::test
