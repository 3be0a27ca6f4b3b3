// SPDX-License-Identifier: MIT
#include "devices/lua/script.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "descriptions/object_sections.hpp"
#include "descriptions/values.hpp"

namespace cbcan::devices {

namespace {

using enum DataType;

constexpr std::size_t kMostObjects = 250;
constexpr std::size_t kMostPdos = 4;  ///< with a default COB-ID, in each direction

using TypeName = std::pair<std::string_view, DataType>;
constexpr std::array kTypes{
    TypeName{"bool", kBoolean},   TypeName{"i8", kInteger8},    TypeName{"i16", kInteger16},
    TypeName{"i32", kInteger32},  TypeName{"i64", kInteger64},  TypeName{"u8", kUnsigned8},
    TypeName{"u16", kUnsigned16}, TypeName{"u32", kUnsigned32}, TypeName{"u64", kUnsigned64},
    TypeName{"f32", kReal32},     TypeName{"f64", kReal64},     TypeName{"text", kVisibleString}};
constexpr std::array<std::string_view, 4> kAccesses{"rw", "ro", "wo", "const"};
constexpr std::string_view kNoAccess = "none";  ///< the device has no such object
constexpr std::array<std::string_view, 4> kPdos{"", "tx", "rx", "optional"};

constexpr std::array<std::string_view, 8> kObjectNumbers{"index", "sub",    "default", "low",
                                                         "high",  "target", "level",   "sync"};
constexpr std::array<std::string_view, 9> kObjectTexts{"name", "type", "access", "default", "unit",
                                                       "pdo",  "bits", "alarm",  "show"};
constexpr std::array<std::string_view, 5> kDeviceNumbers{"type", "vendor", "product", "revision",
                                                         "heartbeat_ms"};
constexpr std::array<std::string_view, 1> kDeviceTexts{"name"};

/// One object of the EDS.
struct Entry {
  std::string name;
  DataType type;
  std::string_view access;
  std::string value;
  bool in_pdos = false;
  std::string limits{};  ///< lines of them
};
using Entries = std::map<std::pair<std::uint16_t, std::uint8_t>, Entry>;

/// The fields of one table.
class Fields {
 public:
  Fields(const Script::Record& record, std::string of) : record_(record), of_(std::move(of)) {}

  [[noreturn]] void refuse(std::string_view key, std::string_view why) const {
    throw ScriptError(fmt::format("{}: {}: {}", of_, key, why), 0);
  }
  /// The keys that may have a number, and those that may have a text.
  void check(std::span<const std::string_view> numbers, std::span<const std::string_view> texts) const {
    check(record_.numbers, numbers, texts, "a text");
    check(record_.texts, texts, numbers, "a number");
    for (const auto& [key, all] : record_.texts)
      for (const std::string& text : all)
        if (text.size() > Script::kMostText)
          refuse(key, fmt::format("a text has more than {} letters", Script::kMostText));
  }

  std::optional<double> number(const char* key) const {
    const auto found = record_.numbers.find(key);
    return found == record_.numbers.end() ? std::nullopt : std::optional(found->second.value);
  }
  const std::vector<std::string>& texts(const char* key) const {
    static const std::vector<std::string> kNone;
    const auto found = record_.texts.find(key);
    return found == record_.texts.end() ? kNone : found->second;
  }
  std::optional<lua_Integer> whole(const char* key) const {
    const auto found = record_.numbers.find(key);
    return found == record_.numbers.end() ? std::nullopt : found->second.whole;
  }
  /// Text without line ends.
  std::string text(const char* key) const {
    const auto& all = texts(key);
    std::string text = all.empty() ? "" : all.front();
    std::ranges::replace_if(
        text, [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
    return text;
  }
  template <class Integer>
  Integer integer(const char* key, double least, double most, std::optional<double> standard = {}) const {
    const std::optional<double> value = number(key) ? number(key) : standard;
    if (value && *value >= least && *value <= most && *value == std::floor(*value))
      return static_cast<Integer>(*value);
    refuse(key, fmt::format("must be {:.0f}..{:.0f}", least, most));
  }
  /// The place of its text in `choices`.
  template <class Choices>
  std::size_t choice(const char* key, const Choices& choices, std::string_view value) const {
    const auto found = std::ranges::find(choices, value);
    if (found == std::end(choices)) {
      std::vector<std::string_view> all(std::begin(choices), std::end(choices));
      std::erase(all, "");
      refuse(key, fmt::format("\"{}\" is none; write {}", value, base::listed(all)));
    }
    return static_cast<std::size_t>(found - std::begin(choices));
  }
  void name_in_errors(std::string of) { of_ = std::move(of); }

 private:
  void check(const auto& fields, const auto& keys, const auto& others, std::string_view kind) const {
    for (const auto& [key, value] : fields) {
      if (std::ranges::find(keys, key) != keys.end()) continue;
      if (std::ranges::find(others, key) != others.end()) refuse(key, fmt::format("must be {}", kind));
      std::vector<std::string_view> all(keys.begin(), keys.end());
      all.insert(all.end(), others.begin(), others.end());
      refuse(key, "there is no such field; remove it" + base::did_you_mean(key, all));
    }
  }

  const Script::Record& record_;
  std::string of_;
};

struct Declared {
  std::uint16_t index;
  std::uint8_t sub;
  Fields fields;
};

std::vector<Declared> declared(const Script& script, const std::vector<Script::Record>& records) {
  std::vector<Declared> all;
  for (const Script::Record& record : records) {
    Fields fields(record, script.name() + ": objects");
    const auto index = fields.integer<std::uint16_t>("index", 1, 0xFFFF);
    fields.name_in_errors(fmt::format("{}: objects: {:04X}h", script.name(), index));
    const auto sub = fields.integer<std::uint8_t>("sub", 0, 0xFE, 0);
    if (sub != 0)
      fields.name_in_errors(fmt::format("{}: objects: {:04X}h:{:02X}", script.name(), index, sub));
    fields.check(kObjectNumbers, kObjectTexts);
    const auto same = [&](const Declared& other) { return other.index == index && other.sub == sub; };
    if (std::ranges::any_of(all, same)) fields.refuse("sub", "is there twice; remove one, or give another");
    const auto low = fields.number("low"), high = fields.number("high");
    if (low && high && *low > *high) fields.refuse("low", "is above high");
    all.push_back({index, sub, fields});
  }
  return all;
}

DataType type_of(const Fields& fields) {
  return kTypes[fields.choice("type", base::column(kTypes, &TypeName::first), fields.text("type"))].second;
}

/// Text of a value of an integer type.
std::string integer_text(const Fields& fields, const char* key, DataType type) {
  const auto whole = fields.whole(key);
  const std::string text =
      whole ? std::to_string(*whole) : fmt::format("{:.0f}", std::round(fields.number(key).value_or(0)));
  const auto number = descriptions::parse_number(text, 0);
  if (number && descriptions::to_bits(*number, type)) return text;
  fields.refuse(key, "must be " + descriptions::range_of(type));
}

std::string value_text(const Fields& fields, DataType type) {
  if (type == kVisibleString) return fields.text("default");
  if (type != kReal32 && type != kReal64) return integer_text(fields, "default", type);
  const double most = type == kReal32 ? static_cast<double>(std::numeric_limits<float>::max())
                                      : std::numeric_limits<double>::max();
  const double value = fields.number("default").value_or(0);
  if (!(std::abs(value) <= most)) fields.refuse("default", fmt::format("must be {}..{}", -most, most));
  return fmt::format("{}", value);
}

void check_default(const Fields& fields) {
  const auto value = fields.number("default"), low = fields.number("low"), high = fields.number("high");
  if (value && low && *value < *low) fields.refuse("default", "is below low");
  if (value && high && *value > *high) fields.refuse("default", "is above high");
}

/// Lines of the EDS, for integers that SDO can write.
std::string limits(const Fields& fields, DataType type, std::string_view access) {
  std::string lines;
  if (type < kInteger8 || type > kUnsigned32 || (access != "rw" && access != "wo")) return lines;
  if (fields.number("low")) lines += fmt::format("LowLimit={}\n", integer_text(fields, "low", type));
  if (fields.number("high")) lines += fmt::format("HighLimit={}\n", integer_text(fields, "high", type));
  return lines;
}

// ---- The communication part

void put(Entries& entries, std::uint16_t index, std::uint8_t sub, std::string name, DataType type,
         std::string_view access, std::string value) {
  entries.insert_or_assign({index, sub}, Entry{std::move(name), type, access, std::move(value)});
}

void add_communication(Entries& entries, const Fields& device) {
  const auto number = [&](const char* key) {
    return fmt::format("0x{:08X}", device.integer<std::uint32_t>(key, 0, 0xFFFFFFFF, 0));
  };
  const std::string name = device.text("name");
  const std::string heartbeat = std::to_string(device.integer<std::uint16_t>("heartbeat_ms", 0, 0xFFFF, 0));
  put(entries, object::kDeviceType, 0, "Device type", kUnsigned32, "ro", number("type"));
  put(entries, object::kErrorRegister, 0, "Error register", kUnsigned8, "ro", "0");
  put(entries, object::kErrorHistory, 0, "Pre-defined error field: number of errors", kUnsigned8, "rw", "0");
  for (std::uint8_t sub = 1; sub <= 4; ++sub)
    put(entries, object::kErrorHistory, sub, fmt::format("Pre-defined error field: {}", sub), kUnsigned32,
        "ro", "0");
  put(entries, object::kSyncCobId, 0, "COB-ID SYNC", kUnsigned32, "rw", "0x80");
  put(entries, object::kDeviceName, 0, "Manufacturer device name", kVisibleString, "const", name);
  put(entries, object::kStore, 1, "Store parameters: all", kUnsigned32, "rw", "1");
  put(entries, object::kRestore, 1, "Restore default parameters: all", kUnsigned32, "rw", "1");
  put(entries, object::kEmergencyCobId, 0, "COB-ID EMCY", kUnsigned32, "rw", "$NODEID+0x80");
  put(entries, object::kConsumerHeartbeatTime, 1, "Consumer heartbeat time: 1", kUnsigned32, "rw", "0");
  put(entries, object::kProducerHeartbeatTime, 0, "Producer heartbeat time", kUnsigned16, "rw", heartbeat);
  put(entries, object::kIdentity, 1, "Identity: vendor-ID", kUnsigned32, "ro", number("vendor"));
  put(entries, object::kIdentity, 2, "Identity: product code", kUnsigned32, "ro", number("product"));
  put(entries, object::kIdentity, 3, "Identity: revision number", kUnsigned32, "ro", number("revision"));
  put(entries, object::kIdentity, 4, "Identity: serial number", kUnsigned32, "ro", "0");
}

constexpr std::string_view kAtEachSync = "1";  ///< transmission type

void check_pdo(const Fields& fields, std::string_view pdo, std::string_view access) {
  if (pdo == "rx" && access != "rw" && access != "wo") fields.refuse("pdo", "\"rx\" is for access rw or wo");
  if (pdo == "tx" && access == "wo") fields.refuse("pdo", "\"tx\" is not for access wo");
  if (fields.number("sync") && pdo != "tx") fields.refuse("sync", "is for pdo = \"tx\"");
}

/// PDOs of one direction, filled in the order of the objects.
class PdoWriter {
 public:
  PdoWriter(Entries& entries, bool sends) : entries_(entries), sends_(sends) {}

  void add(const Declared& object, DataType type) {
    const unsigned bits = type == kBoolean ? 1 : static_cast<unsigned>(8 * size_of(type));
    if (bits == 0) object.fields.refuse("pdo", "its type is not for PDOs");
    if (mapped_ == 0 || bits_ + bits > 64 || mapped_ == 8) begin(object.fields);
    bits_ += bits;
    ++mapped_;
    const std::string value = fmt::format("0x{:04X}{:02X}{:02X}", object.index, object.sub, bits);
    put(entries_, mapping(), mapped_, name("mapping: object {}", mapped_), kUnsigned32, "rw", value);
    put(entries_, mapping(), 0, name("mapping: number of objects", 0), kUnsigned8, "rw",
        std::to_string(mapped_));
  }

  /// The next object begins a PDO of this transmission type.
  void end(std::string_view transmission) {
    transmission_ = transmission;
    mapped_ = 0;
  }

  std::size_t count() const { return count_; }

 private:
  std::uint16_t at(std::uint16_t first) const { return static_cast<std::uint16_t>(first + count_ - 1); }
  std::uint16_t mapping() const { return at(sends_ ? object::kTpdoMapping : object::kRpdoMapping); }
  std::string name(std::string_view what, unsigned number) const {
    return fmt::format("{}PDO {} {}", sends_ ? 'T' : 'R', count_, fmt::format(fmt::runtime(what), number));
  }

  void begin(const Fields& fields) {
    if (++count_ > kMostPdos)
      fields.refuse("pdo", "at most four PDOs in each direction have a default COB-ID");
    bits_ = mapped_ = 0;
    const std::uint16_t index = at(sends_ ? object::kTpdoParameter : object::kRpdoParameter);
    const std::size_t id = (sends_ ? 0x80 : 0x100) + 0x100 * count_;
    put(entries_, index, 1, name("parameter: COB-ID", 0), kUnsigned32, "rw",
        fmt::format("$NODEID+0x{:X}", id));
    put(entries_, index, 2, name("parameter: transmission type", 0), kUnsigned8, "rw",
        std::string(transmission_));
    if (sends_) put(entries_, index, 3, name("parameter: inhibit time", 0), kUnsigned16, "rw", "0");
    if (sends_) put(entries_, index, 5, name("parameter: event timer", 0), kUnsigned16, "rw", "0");
    for (std::uint8_t sub = 1; sub <= 8; ++sub)
      put(entries_, mapping(), sub, name("mapping: object {}", sub), kUnsigned32, "rw", "0x00000000");
  }

  Entries& entries_;
  bool sends_;
  std::string_view transmission_ = "255";
  std::size_t count_ = 0;
  unsigned bits_ = 0;
  std::uint8_t mapped_ = 0;
};

// ---- The text

/// Sub-index 0 of records that do not declare it.
void add_counts(Entries& entries) {
  std::map<std::uint16_t, std::uint8_t> highest;
  for (const auto& [place, entry] : entries)
    highest[place.first] = place.second;
  for (const auto& [index, sub] : highest)
    if (sub != 0)
      entries.try_emplace({index, std::uint8_t{0}},
                          Entry{"Highest sub-index supported", kUnsigned8, "const", std::to_string(sub)});
}

/// The name of a sub-index follows that of its object.
std::string_view own_name(std::string_view name, bool is_sub) {
  const std::size_t colon = is_sub ? name.find(": ") : name.npos;
  return colon == name.npos ? name : name.substr(colon + 2);
}

void write(std::string& text, const std::string& section, const Entry& entry, bool is_sub) {
  text += fmt::format(
      "[{}]\nParameterName={}\nObjectType=0x7\nDataType=0x{:04X}\nAccessType={}\n{}DefaultValue={}\n"
      "PDOMapping={}\n\n",
      section, own_name(entry.name, is_sub), static_cast<unsigned>(entry.type), entry.access, entry.limits,
      entry.value, entry.in_pdos ? 1 : 0);
}

bool is_array(std::uint16_t index) {
  return index == object::kErrorHistory || index == object::kStore || index == object::kRestore ||
         index == object::kConsumerHeartbeatTime;
}

void write_objects(std::string& text, const Entries& entries) {
  for (auto first = entries.begin(); first != entries.end();) {
    const std::uint16_t index = first->first.first;
    const auto last = entries.upper_bound({index, std::uint8_t{0xFF}});
    const std::string section = fmt::format("{:04X}", index);
    const auto count = std::distance(first, last);
    if (count == 1) {
      write(text, section, first->second, false);
    } else {
      const std::string& name = std::next(first)->second.name;
      text += fmt::format("[{}]\nParameterName={}\nObjectType=0x{}\nSubNumber={}\n\n", section,
                          name.substr(0, name.find(": ")), is_array(index) ? 8 : 9, count);
      for (auto each = first; each != last; ++each)
        write(text, fmt::format("{}sub{:X}", section, each->first.second), each->second, true);
    }
    first = last;
  }
}

void write_head(std::string& text, std::string_view file, const Entries& entries, std::size_t rpdos,
                std::size_t tpdos) {
  const std::string_view leaf = file.substr(file.rfind('/') + 1);  // npos + 1 = 0
  const auto value = [&](std::uint16_t index, std::uint8_t sub) { return entries.at({index, sub}).value; };
  text += fmt::format(
      "[FileInfo]\nFileName={}.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\nDescription={}\n"
      "CreationTime=12:00AM\nCreationDate=01-01-2026\nCreatedBy=cbcan\n"
      "ModificationTime=12:00AM\nModificationDate=01-01-2026\nModifiedBy=cbcan\n\n",
      leaf.substr(0, leaf.rfind('.')), value(object::kDeviceName, 0));
  text += fmt::format(
      "[DeviceInfo]\nVendorName=\nVendorNumber={}\nProductName={}\nProductNumber={}\nRevisionNumber={}\n"
      "OrderCode=\n",
      value(object::kIdentity, 1), value(object::kDeviceName, 0), value(object::kIdentity, 2),
      value(object::kIdentity, 3));
  for (const int rate : {10, 20, 50, 125, 250, 500, 800, 1000})
    text += fmt::format("BaudRate_{}=1\n", rate);
  text += fmt::format(
      "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=8\nDynamicChannelsSupported=0\nCompactPDO=0\n"
      "GroupMessaging=0\nNrOfRXPDO={}\nNrOfTXPDO={}\nLSS_Supported=0\n\n[DummyUsage]\n",
      rpdos, tpdos);
  for (int type = 1; type <= 7; ++type)
    text += fmt::format("Dummy000{}=0\n", type);
  text += "\n[Comments]\nLines=0\n\n";
  std::vector<std::uint64_t> indices;
  for (const auto& [place, entry] : entries)
    if (indices.empty() || indices.back() != place.first) indices.push_back(place.first);
  text += descriptions::object_lists(indices);
}

/// The bits with these names.
std::uint64_t alarm_of(const Fields& fields) {
  std::uint64_t bits = 0;
  for (const std::string& name : fields.texts("alarm"))
    bits |= std::uint64_t{1} << fields.choice("alarm", fields.texts("bits"), name);
  return bits;
}

}  // namespace

std::vector<sim::Point> declared_points(Script& script) {
  const std::vector<Script::Record> records = script.records("objects", kMostObjects);
  std::vector<sim::Point> points;
  const std::vector<Declared> all = declared(script, records);
  for (std::size_t kind = 0; kind < sim::kPointKinds.size(); ++kind)
    for (const auto& [index, sub, fields] : all)
      if (std::ranges::count_if(fields.texts("show"), [&own = fields, kind](const std::string& shown) {
            return own.choice("show", sim::kPointKinds, shown) == kind;
          }) != 0)
        points.push_back({.kind = static_cast<sim::Point::Kind>(kind),
                          .index = index,
                          .sub = sub,
                          .name = fields.text("name"),
                          .unit = fields.text("unit"),
                          .low = fields.number("low"),
                          .high = fields.number("high"),
                          .bits = fields.texts("bits"),
                          .target = fields.integer<std::uint16_t>("target", 0, 0xFFFF, 0),
                          .level = fields.number("level").value_or(0) != 0,
                          .alarm = alarm_of(fields)});
  return points;
}

std::vector<std::uint16_t> removed_objects(Script& script) {
  const std::vector<Script::Record> records = script.records("objects", kMostObjects);
  std::vector<std::uint16_t> indices;
  for (const auto& [index, sub, fields] : declared(script, records))
    if (fields.text("access") == kNoAccess) indices.push_back(index);
  return indices;
}

std::string declared_eds(Script& script, std::string_view file, bool is_beside) {
  const std::vector<Script::Record> records = script.records("objects", kMostObjects);
  if (records.empty() && !is_beside)
    throw ScriptError(
        fmt::format("{}: has no table objects; add it, or eds = \"FILE.eds\" to the node", file), 0);
  std::vector<Script::Record> described = script.records("device", 1);
  described.resize(1);
  const Fields device(described.front(), script.name() + ": device");
  device.check(kDeviceNumbers, kDeviceTexts);
  Entries entries;
  add_communication(entries, device);
  PdoWriter rpdos(entries, false), tpdos(entries, true);
  std::vector<std::pair<Declared, DataType>> at_sync;
  for (const Declared& object : declared(script, records)) {
    const Fields& fields = object.fields;
    if (is_beside && fields.text("type").empty()) continue;
    const DataType type = type_of(fields);
    check_default(fields);
    const std::string access = fields.text("access"), pdo = fields.text("pdo");
    const std::string_view given =
        kAccesses[fields.choice("access", kAccesses, access.empty() ? "rw" : access)];
    const std::size_t direction = fields.choice("pdo", kPdos, pdo);
    check_pdo(fields, kPdos[direction], given);
    if (kPdos[direction] == "tx") tpdos.add(object, type);
    if (kPdos[direction] == "rx") rpdos.add(object, type);
    if (fields.number("sync")) at_sync.emplace_back(object, type);
    entries.insert_or_assign({object.index, object.sub},
                             Entry{fields.text("name"), type, given, value_text(fields, type), direction != 0,
                                   limits(fields, type, given)});
  }
  tpdos.end(kAtEachSync);
  for (const auto& [object, type] : at_sync)
    tpdos.add(object, type);
  add_counts(entries);
  std::string text;
  write_head(text, file, entries, rpdos.count(), tpdos.count());
  write_objects(text, entries);
  return text;
}

}  // namespace cbcan::devices
