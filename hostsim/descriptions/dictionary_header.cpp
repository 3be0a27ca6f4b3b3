// SPDX-License-Identifier: MIT
#include "descriptions/dictionary_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/nmt/nmt.hpp"
#include "cbcan/canopen/pdo/mapping.hpp"
#include "cbcan/canopen/pdo/pdo.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/canopen/sync.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::descriptions {

namespace {

/// An entry, and where its elements begin in the image, with their lengths.
struct EntryRow {
  ObjectEntry entry;
  std::vector<std::size_t> places;
};
using Rows = std::vector<EntryRow>;

bool is_alike(const ObjectEntry& a, const ObjectEntry& b) {
  return a.type == b.type && a.flags == b.flags && a.capacity == b.capacity;
}

/// A string that cannot be written needs no room for a longer one.
EntryRow row_of(const ObjectEntry& entry, const std::vector<std::uint8_t>& values) {
  EntryRow row{entry, {}};
  for (std::uint32_t element = 0; element < entry.count(); ++element)
    row.places.push_back(entry.offset - entry.front() + std::size_t{element} * entry.stride());
  if (entry.has(ObjectFlags::kVariable) && !entry.has(ObjectFlags::kWrite))
    row.entry.capacity = load_word(&values[row.places[0]]);
  return row;
}

void append(std::vector<std::size_t>& places, const EntryRow& more) {
  places.insert(places.end(), more.places.begin(), more.places.end());
}

/// Null: no value with $NODEID begins there.
const NodeIdValue* relative_at(const DictionaryImage& image, std::size_t place) {
  const auto found = std::ranges::find(image.node_id_values, place, &NodeIdValue::offset);
  return found == image.node_id_values.end() ? nullptr : &*found;
}

/// The entries of each index, with alike neighbours in one.
std::vector<Rows> fold_subs(const DictionaryImage& image) {
  std::vector<Rows> objects;
  for (const ObjectEntry& entry : image.entries) {
    if (objects.empty() || objects.back().front().entry.index != entry.index) objects.emplace_back();
    Rows& rows = objects.back();
    const EntryRow row = row_of(entry, image.values);
    if (!rows.empty() && rows.back().entry.last_sub + 1 == entry.first_sub &&
        is_alike(rows.back().entry, row.entry)) {
      rows.back().entry.last_sub = entry.last_sub;
      append(rows.back().places, row);
    } else {
      rows.push_back(row);
    }
  }
  return objects;
}

/// The stack uses the stored sub-index 0 of a mapping and of 1003h.
void fold_count(Rows& rows, const DictionaryImage& image) {
  constexpr std::uint16_t kForbidden = ObjectFlags::kWrite | ObjectFlags::kMapTpdo | ObjectFlags::kLimited;
  const ObjectEntry& count = rows[0].entry;
  if (rows.size() != 2 || is_mapping(count.index) || count.index == object::kErrorHistory) return;
  if (count.last_sub != 0 || count.type != DataType::kUnsigned8 || !count.has(ObjectFlags::kRead) ||
      count.has(kForbidden) || image.values[rows[0].places[0]] != rows[1].entry.last_sub ||
      relative_at(image, rows[0].places[0]) != nullptr)
    return;
  rows[1].entry.flags |= ObjectFlags::kCounted;
  rows.erase(rows.begin());
}

/// The areas that 1010h stores and a reset restores separately.
int area_of(std::uint16_t index) {
  return (index >= object::kFirstManufacturer) + (index >= object::kFirstProfile) +
         (index > object::kLastProfile);
}

bool is_next(const Rows& rows, const Rows& next) {
  const ObjectEntry& last = rows.front().entry;
  const std::uint16_t index = next.front().entry.index;
  return last.last_index() + 1 == index && last.more_indices != 0xFF &&
         area_of(last.index) == area_of(index) &&
         std::ranges::equal(rows, next, [](const EntryRow& a, const EntryRow& b) {
           return is_alike(a.entry, b.entry) && a.entry.first_sub == b.entry.first_sub &&
                  a.entry.last_sub == b.entry.last_sub;
         });
}

Rows fold(const DictionaryImage& image) {
  std::vector<Rows> folded;
  for (Rows& rows : fold_subs(image)) {
    fold_count(rows, image);
    if (folded.empty() || !is_next(folded.back(), rows)) {
      folded.push_back(std::move(rows));
      continue;
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      ++folded.back()[i].entry.more_indices;
      append(folded.back()[i].places, rows[i]);
    }
  }
  Rows all;
  for (Rows& rows : folded)
    std::ranges::move(rows, std::back_inserter(all));
  return all;
}

/// What the application gives: identity, unless it follows the node ID, texts that describe the device, and
/// what the file has no value for.
void mark_asked(DictionaryImage& image) {
  for (ObjectEntry& entry : image.entries) {
    const bool describes = entry.index >= object::kDeviceName && entry.index <= object::kSoftwareVersion;
    const bool identifies = entry.index == object::kIdentity && entry.last_sub != 0 &&
                            relative_at(image, entry.offset) == nullptr;
    if (describes || identifies || entry.has(ObjectFlags::kUnset)) entry.flags |= ObjectFlags::kAsked;
    entry.flags &= static_cast<std::uint16_t>(~ObjectFlags::kUnset);
  }
}

/// Further SDO servers are off, and stay so; limits are for what clients write.
void leave_out_unwritable(DictionaryImage& image) {
  for (ObjectEntry& entry : image.entries) {
    if (object::is_further_sdo_server(entry.index))
      entry.flags &= static_cast<std::uint16_t>(~ObjectFlags::kWrite);
    if (!entry.has(ObjectFlags::kWrite)) entry.flags &= static_cast<std::uint16_t>(~ObjectFlags::kLimited);
  }
  std::erase_if(image.limits, [&](const ObjectLimits& row) {
    return std::ranges::none_of(image.entries, [&](const ObjectEntry& entry) {
      return entry.holds(row.index, row.sub) && entry.has(ObjectFlags::kLimited);
    });
  });
}

std::span<const std::uint8_t> bytes_at(std::size_t place, const EntryRow& row, const DictionaryImage& image) {
  return std::span(image.values).subspan(place, row.entry.stride());
}

bool is_zero(const EntryRow& row, const DictionaryImage& image) {
  return std::ranges::all_of(row.places, [&](std::size_t place) {
    return relative_at(image, place) == nullptr &&
           std::ranges::all_of(bytes_at(place, row, image), [](auto byte) { return byte == 0; });
  });
}

/// Values that are 0 are the last ones.
FirmwareDictionary laid_out(Rows rows, const DictionaryImage& image) {
  FirmwareDictionary made;
  std::vector<std::pair<std::uint16_t, NodeIdValue>> relative;  // with the index of each
  const auto place_row = [&](EntryRow& row, bool zeros) {
    row.entry.offset = static_cast<std::uint32_t>(made.value_bytes) + row.entry.front();
    for (const std::size_t place : row.places) {
      if (const NodeIdValue* const value = relative_at(image, place))
        relative.push_back(
            {row.entry.index, {static_cast<std::uint32_t>(made.value_bytes), value->factor, value->size}});
      const auto bytes = bytes_at(place, row, image);
      if (!zeros) made.power_on.insert(made.power_on.end(), bytes.begin(), bytes.end());
      made.value_bytes += bytes.size();
    }
  };
  for (const bool zeros : {false, true})
    for (EntryRow& row : rows)
      if (is_zero(row, image) == zeros) place_row(row, zeros);
  for (const EntryRow& row : rows)
    made.entries.push_back(row.entry);
  std::stable_partition(relative.begin(), relative.end(),
                        [](const auto& value) { return value.first <= object::kLastCommunication; });
  for (const auto& [index, value] : relative) {
    made.node_id_values.push_back(value);
    made.communication_node_id_values += index <= object::kLastCommunication;
  }
  return made;
}

// ---- What the stack does not have

/// Refuses a file, with the line of the object. `device`: read for node ID 0.
class Check {
 public:
  Check(const DeviceDescription& device, const std::string& name) : device_(device), name_(name) {}

  /// `last`: the device read for the last node ID. Values follow the node ID, and nothing else does.
  void node_ids(const DeviceDescription& last) const {
    for (std::size_t i = 0; i != device_.objects.size(); ++i) {
      Object expected = device_.objects[i];
      const std::uint64_t added = std::uint64_t{expected.node_ids} * nmt::kMaxNode;
      if (added != 0) store_little_endian(expected.value, load_little_endian(expected.value) + added);
      if (i < last.objects.size() && expected == last.objects[i]) continue;
      const bool one_fits = i < last.objects.size() && expected.has_value != last.objects[i].has_value;
      refuse(expected, one_fits ? "its value with $NODEID does not fit each node ID 1..127"
                                : "$NODEID is used for something other than its value");
    }
  }

  void objects() const {
    for (const Object& object : device_.objects) {
      if (object::is_further_sdo_server(object.index) && (object.first_sub == 1 || object.first_sub == 2) &&
          is_on(object))
        refuse(object, "the stack has one SDO server, 1200h");
      if (is_mapping(object.index) && object.node_ids != 0) refuse(object, "$NODEID cannot be in a mapping");
      if (is_cob_id(object)) cob_id(object);
      for (std::uint32_t node = 1; object.has_value && node <= nmt::kMaxNode; ++node)
        if (const std::string why = problem_of(
                object, load_little_endian(object.value) + std::uint64_t{object.node_ids} * node, node);
            !why.empty())
          refuse(object, why);
    }
  }

  /// Checks mappings of PDOs by the stack itself.
  void mappings(FirmwareDictionary& made) const {
    std::vector<std::uint8_t> values = made.power_on;
    values.resize(made.value_bytes);
    const ObjectDictionary dictionary(made.entries, values, nullptr);
    for (const Object& object : device_.objects)
      if (is_mapping(object.index) && object.first_sub == 0) mapping(dictionary, object);
  }

 private:
  [[noreturn]] void refuse(const Object& object, std::string_view why) const {
    throw UsageError(
        fmt::format("{}:{}: {:04X}h:{:02X}: {}", name_, object.line, object.index, object.first_sub, why));
  }

  static bool is_pdo_parameter(std::uint16_t index) {
    return index >= object::kRpdoParameter && index <= object::kLastPdo && !is_mapping(index);
  }

  static bool is_cob_id(const Object& object) {
    return (is_pdo_parameter(object.index) && object.first_sub == kCobId) ||
           ((object.index == object::kSyncCobId || object.index == object::kTimeCobId ||
             object.index == object::kEmergencyCobId) &&
            object.first_sub == 0);
  }

  /// The bits say that there is no such message.
  static bool is_unused(std::uint16_t index, std::uint32_t cob_id) {
    if (index == object::kTimeCobId) return (cob_id & (cob::kConsumes | cob::kProduces)) == 0;
    return index != object::kSyncCobId && (cob_id & cob::kInvalid) != 0;
  }

  static bool is_on(const Object& object) {
    const std::uint64_t cob_id = load_little_endian(object.value);
    return object.node_ids != 0 || (cob_id != 0 && (cob_id & cob::kInvalid) == 0);
  }

  /// 0 is the default, 080h, of SYNC. A PDO that maps nothing is not sent or received.
  bool needs_no_id(const Object& object, std::uint32_t value) const {
    if (object.index == object::kSyncCobId) return value == 0 && object.node_ids == 0;
    if (!is_pdo_parameter(object.index)) return false;
    const Object* const count = device_.find(
        static_cast<std::uint16_t>(object.index + (object::kRpdoMapping - object::kRpdoParameter)), 0);
    return count == nullptr || load_little_endian(count->value) == 0;
  }

  void cob_id(const Object& object) const {
    const auto value = static_cast<std::uint32_t>(load_little_endian(object.value));
    if (!object.has_value || is_unused(object.index, value) || needs_no_id(object, value)) return;
    if ((value & cob::kReserved) != 0) refuse(object, "the stack has no 29-bit identifiers");
    for (std::uint32_t node = 1; node <= nmt::kMaxNode; ++node)
      if (cob::is_restricted(cob::id_of(value + object.node_ids * node)))
        refuse(object, fmt::format("CiA 301 restricts CAN-ID {:03X}h (of node {})",
                                   cob::id_of(value + object.node_ids * node), node));
  }

  /// What the stack would not accept as this value of a node; empty = nothing.
  std::string problem_of(const Object& object, std::uint64_t value, std::uint32_t node) const {
    const std::uint8_t sub = object.first_sub;
    if (object.index == object::kSdoServerParameter && (sub == 1 || sub == 2)) {
      const std::uint32_t id = sub == 1 ? sdo::kRequestId : sdo::kResponseId;
      return value == id + node ? "" : fmt::format("the stack's SDO server has $NODEID+{:#x}", id);
    }
    if (object.index == object::kSyncCounterOverflow && (value == 1 || value > Sync::kHighestCounter))
      return "the counter of SYNC is 0 or 2..240";
    if (object.index == object::kConsumerHeartbeatTime && sub != 0 && (value & 0xFFFF) != 0 &&
        (value >> 16 & 0xFF) > nmt::kMaxNode)
      return "node IDs are 1..127";
    if (!is_pdo_parameter(object.index) || sub != kType ||
        Pdo::is_type(object.index, static_cast<std::uint32_t>(value)))
      return {};
    const Object* const cob_id = device_.find(object.index, kCobId);
    const bool used = cob_id != nullptr && cob_id->has_value &&
                      !is_unused(object.index, static_cast<std::uint32_t>(load_little_endian(cob_id->value)));
    return used ? fmt::format("transmission type {} is reserved", value) : "";
  }

  void mapping(const ObjectDictionary& dictionary, const Object& count) const {
    const std::uint64_t most = load_little_endian(count.value);
    for (std::uint8_t sub = 1; sub <= std::min<std::uint64_t>(most, PdoMapping::kMostObjects); ++sub) {
      const auto mapped = static_cast<std::uint32_t>(dictionary.get(count.index, sub));
      const Object* const entry = device_.find(count.index, sub);
      const AbortCode wrong = PdoMapping::check(dictionary, count.index, mapped);
      if (wrong == AbortCode::kNone) continue;
      refuse(entry == nullptr ? count : *entry,
             fmt::format("{:08X}h {}", mapped,
                         wrong == AbortCode::kNotMappable ? "cannot be mapped, or has another length"
                                                          : "maps no object"));
    }
    if (PdoMapping().resolve(dictionary, count.index, static_cast<std::uint32_t>(most), {}) !=
        AbortCode::kNone)
      refuse(count, "maps more than 64 objects or 64 bits");
  }

  const DeviceDescription& device_;
  const std::string& name_;
};

// ---- Names

/// Keywords of C++20, and macros of compilers and of the C library.
constexpr std::string_view kTaken =
    " alignas alignof and and_eq asm auto bitand bitor bool break case catch char class co_await co_return "
    "co_yield "
    "compl concept const const_cast consteval constexpr constinit continue decltype default delete do double "
    "dynamic_cast else enum explicit export extern false float for friend goto if inline int linux long "
    "mutable "
    "namespace new noexcept not not_eq nullptr operator or or_eq private protected public register "
    "reinterpret_cast requires return short signed sizeof static static_assert static_cast struct switch "
    "template "
    "this throw true try typedef typeid typename union unix unsigned using virtual void volatile while xor "
    "xor_eq "
    "EOF NULL assert errno i386 offsetof stderr stdin stdout ";

bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

/// Standard types, such as uint8_t, end with _t; compilers' macros, such as __arm__, have names that C++
/// reserves.
void check_space(const std::string& name) {
  const bool reserved =
      name.find("__") != std::string::npos || (name.size() > 1 && name[0] == '_' && is_upper(name[1]));
  bool good = !name.empty() && std::isdigit(static_cast<unsigned char>(name.front())) == 0 && !reserved &&
              !name.ends_with("_t") && kTaken.find(" " + name + " ") == std::string_view::npos;
  for (const char c : name)
    good = good && (c == '_' || (static_cast<unsigned char>(c) < 0x80 && std::isalnum(c) != 0));
  if (!good) throw UsageError(name + ": no name of a C++ namespace; write --name NAME");
}

/// "Read input 8-bit" is ReadInput8Bit.
std::string camel(std::string_view text) {
  std::string name;
  bool begins = true;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || is_upper(c);
    if (!letter && (c < '0' || c > '9')) {
      begins = true;
      continue;
    }
    name += begins && c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c;
    begins = false;
  }
  return name.empty() ? "Object" : name;
}

/// A name that several objects have is followed by index and sub-index.
std::string names_of(const DeviceDescription& device) {
  std::map<std::string, int> count;
  for (const Object& object : device.objects)
    ++count[camel(object.name)];
  std::string text;
  for (const Object& object : device.objects) {
    std::string name = camel(object.name);
    if (count[name] != 1 || name == "Object")
      name += fmt::format("_{:04X}_{:02X}", object.index, object.first_sub);
    text += fmt::format("inline constexpr cbcan::ObjectAddress k{}{{0x{:04X}, 0x{:02X}}};\n", name,
                        object.index, object.first_sub);
  }
  return text;
}

// ---- Tables

std::string number_of(std::int64_t value) {
  return value == std::numeric_limits<std::int64_t>::min() ? fmt::format("{} - 1", value + 1)
                                                           : fmt::format("{}", value);
}

template <class Row, class Print>
std::string table(std::string_view type, std::string_view name, const std::vector<Row>& rows, Print print) {
  std::string text =
      fmt::format("inline constexpr std::array<cbcan::{}, {}> {}{{{{\n", type, rows.size(), name);
  for (const Row& row : rows)
    text += fmt::format("    {{{}}},\n", print(row));
  return rows.empty() ? fmt::format("inline constexpr std::array<cbcan::{}, 0> {}{{}};\n", type, name)
                      : text + "}};\n";
}

std::string tables(const FirmwareDictionary& made) {
  return table("ObjectEntry", "kEntries", made.entries,
               [](const ObjectEntry& entry) {
                 return fmt::format("0x{:04X}, {}, {}, cbcan::DataType{{0x{:02X}}}, {}, 0x{:04X}, {}, {}",
                                    entry.index, entry.first_sub, entry.last_sub,
                                    static_cast<unsigned>(entry.type), entry.more_indices, entry.flags,
                                    entry.offset, entry.capacity);
               }) +
         table("ObjectLimits", "kLimits", made.limits,
               [](const ObjectLimits& row) {
                 return fmt::format("0x{:04X}, {}, {}, {}", row.index, row.sub, number_of(row.low),
                                    number_of(row.high));
               }) +
         table("NodeIdValue", "kNodeIdValues", made.node_id_values,
               [](const NodeIdValue& row) {
                 return fmt::format("{}, {}, {}", row.offset, row.factor, row.size);
               }) +
         array_of("kPowerOn", made.power_on);
}

std::string sizes_of(const FirmwareDictionary& made) {
  const std::size_t flash = made.entries.size() * sizeof(ObjectEntry) +
                            made.limits.size() * sizeof(ObjectLimits) +
                            made.node_id_values.size() * sizeof(NodeIdValue) + made.power_on.size();
  return fmt::format(
      "// Flash: {} bytes, of {} entries, {} limits, {} values with $NODEID, {} bytes of values.\n"
      "// RAM: {} bytes of values, {} for SDO, {} RPDOs and {} TPDOs of {} objects, {} watched nodes.\n",
      flash, made.entries.size(), made.limits.size(), made.node_id_values.size(), made.power_on.size(),
      made.value_bytes, made.memory.largest_value, made.memory.rpdos, made.memory.tpdos,
      made.memory.objects_of_pdo, made.memory.watched_nodes);
}

}  // namespace

FirmwareDictionary firmware_dictionary(DictionaryImage image) {
  image = prepared(std::move(image));
  leave_out_unwritable(image);
  mark_mapped(image.entries, ObjectDictionary(image.entries, image.values, nullptr));
  mark_asked(image);
  FirmwareDictionary made = laid_out(fold(image), image);
  made.limits = image.limits;
  made.memory = memory_of(made.entries);
  return made;
}

std::string dictionary_header(std::string_view text, const std::string& name, const std::string& space,
                              std::vector<std::string>& remarks) {
  check_space(space);
  std::vector<std::string> same_remarks;  // but also of limits that the value for node ID 0 breaks
  const DeviceDescription device = parse_device(text, name, std::uint8_t{0}, same_remarks);
  const Check check(device, name);
  check.node_ids(parse_device(text, name, nmt::kMaxNode, remarks));
  check.objects();
  FirmwareDictionary made = firmware_dictionary(dictionary_image(device));
  check.mappings(made);
  const DeviceMemory& memory = made.memory;
  return made_by("cbcan-eds", name) + sizes_of(made) +
         "#pragma once\n\n#include <array>\n#include <cstdint>\n\n#include "
         "\"cbcan/canopen/dictionary/eds_dictionary.hpp\"\n\n" +
         fmt::format("#ifdef {0}\n#error \"{0} is a macro here: write cbcan-eds --name NAME\"\n#endif\n\n",
                     space) +
         fmt::format("namespace {} {{\n\nnamespace tables {{\n{}}}\n\n", space, tables(made)) +
         fmt::format(
             "inline constexpr cbcan::EdsDictionary kDictionary{{tables::kEntries, tables::kLimits, "
             "tables::kPowerOn, "
             "tables::kNodeIdValues, {}, {}, {}, {}, {}, {}, {}}};\n\n",
             made.communication_node_id_values, made.value_bytes, memory.largest_value, memory.rpdos,
             memory.tpdos, memory.objects_of_pdo, memory.watched_nodes) +
         fmt::format("namespace od {{\n{}}}\n\n}}\n", names_of(device));
}

}  // namespace cbcan::descriptions
