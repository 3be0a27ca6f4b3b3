// SPDX-License-Identifier: MIT
#include "dictionary/script.hpp"

#include <algorithm>
#include <cstdio>
#include <set>

#include "support/hex.hpp"

namespace cbcan::test {

namespace {

constexpr std::size_t kWholeValue = 256;  ///< longer ones are read in part
constexpr unsigned kMappingDistance = 0x200;

std::string sdo(unsigned node, const std::string& data) {
  char id[5];
  std::snprintf(id, sizeof id, "%03X#", 0x600 + node);
  return id + data + std::string(16 - data.size(), '0');
}

std::string object(unsigned index, unsigned sub) {
  return hex_of(index, 2) + hex_of(sub, 1);
}

/// Sends frames, and writes the transcript.
class Talk {
 public:
  Talk(Bus& bus, unsigned node) : bus_(bus), node_(node) {}

  void send(const std::string& frame) {
    lines_.push_back("> " + frame);
    note(bus_.exchange(frame));
  }
  void request(const std::string& data) { send(sdo(node_, data)); }

  void read(unsigned index, unsigned sub, std::size_t bytes) {
    request("40" + object(index, sub));
    if (bytes > 4)
      for (std::size_t segment = 0; segment <= (std::min(bytes, kWholeValue) - 1) / 7; ++segment)
        request(segment % 2 == 0 ? "60" : "70");
    if (bytes > kWholeValue) request("80" + object(index, sub) + "00000008");
  }

  /// `bytes` low bytes of a number, then zeros.
  void write(unsigned index, unsigned sub, std::uint64_t value, std::size_t bytes) {
    constexpr unsigned kExpedited = 0x23;
    if (bytes >= 1 && bytes <= 4)
      return request(hex_of(kExpedited | static_cast<unsigned>(4 - bytes) << 2, 1) + object(index, sub) +
                     hex_of(value, bytes));
    request("21" + object(index, sub) + hex_of(bytes, 4));
    const std::string data = hex_of(value, 8) + std::string(2 * bytes, '0');
    const std::size_t segments = bytes == 0 ? 1 : (bytes + 6) / 7;
    for (std::size_t segment = 0; segment < segments; ++segment) {
      const bool last = segment + 1 == segments;
      const std::size_t unused = last ? 7 * segments - bytes : 0;
      request(hex_of((segment % 2) << 4 | unused << 1 | (last ? 1u : 0u), 1) +
              data.substr(14 * segment, 2 * (7 - unused)));
    }
  }

  void note(const Frames& frames) { lines_.insert(lines_.end(), frames.begin(), frames.end()); }
  Frames take() { return std::move(lines_); }

 private:
  Bus& bus_;
  unsigned node_;
  Frames lines_;
};

/// Of a long run only its ends.
std::set<unsigned> subs_of(const ObjectEntry& entry) {
  std::set<unsigned> subs;
  for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub)
    if (sub < entry.first_sub + 3u || sub + 2u > entry.last_sub) subs.insert(sub);
  return subs;
}

template <class Visit>
void for_each(const descriptions::DictionaryImage& image, Visit visit) {
  for (const ObjectEntry& entry : image.entries)
    for (const unsigned sub : subs_of(entry))
      visit(entry, sub);
}

/// Of a number; variable ones have none.
ObjectLimits limits_of(const descriptions::DictionaryImage& image, const ObjectEntry& entry, unsigned sub) {
  for (const ObjectLimits& limits : image.limits)
    if (limits.index == entry.index && limits.sub == sub) return limits;
  const std::uint64_t all =
      entry.capacity >= 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * entry.capacity) - 1;
  return {entry.index, 0, 0, static_cast<std::int64_t>(all)};
}

void write_one(Talk& talk, const descriptions::DictionaryImage& image, const ObjectEntry& entry,
               unsigned sub) {
  const std::size_t place = entry.offset + std::size_t{entry.stride()} * (sub - entry.first_sub);
  const std::size_t bytes = entry.capacity;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(bytes, 8); ++i)
    value |= std::uint64_t{image.values[place + i]} << 8 * i;
  const ObjectLimits limits = limits_of(image, entry, sub);
  const auto low = static_cast<std::uint64_t>(limits.low), high = static_cast<std::uint64_t>(limits.high);
  const bool is_long = bytes > 64;
  for (const std::uint64_t each : {value, low - 1, low, high + 1, high})
    if (!is_long) talk.write(entry.index, sub, each, bytes);
  talk.write(entry.index, sub, value, is_long ? 5 : bytes - 1);
  if (!is_long) talk.write(entry.index, sub, value, bytes + 1);
  talk.read(entry.index, sub, bytes);
}

bool has(const descriptions::DictionaryImage& image, unsigned index, unsigned sub) {
  return std::ranges::any_of(image.entries, [&](const ObjectEntry& entry) {
    return entry.index == index && entry.first_sub <= sub && sub <= entry.last_sub;
  });
}

/// Makes one object the mapping of the PDO, which gets `cob_id`, and starts the node.
void map_one(Talk& talk, unsigned pdo, std::uint32_t cob_id, unsigned index, unsigned sub, unsigned bits) {
  talk.write(pdo, 1, 0x80000000 | cob_id, 4);
  talk.write(pdo + kMappingDistance, 0, 0, 1);
  talk.write(pdo + kMappingDistance, 1, std::uint64_t{index} << 16 | sub << 8 | (bits + 8), 4);
  talk.write(pdo + kMappingDistance, 1, std::uint64_t{index} << 16 | sub << 8 | bits, 4);
  talk.write(pdo + kMappingDistance, 0, 1, 1);
  talk.write(pdo, 2, 255, 1);
  talk.write(pdo, 1, cob_id, 4);
  talk.send("000#0105");
}

void command(Talk& talk, Bus& bus, const std::string& frame) {
  talk.send(frame);
  talk.note(bus.pass(0));
}

}  // namespace

Frames read_all(Bus& bus, const descriptions::DictionaryImage& image, unsigned node) {
  Talk talk(bus, node);
  for_each(image,
           [&](const ObjectEntry& entry, unsigned sub) { talk.read(entry.index, sub, entry.capacity); });
  for (const ObjectEntry& entry : image.entries)
    for (const unsigned sub : {entry.first_sub - 1u, entry.last_sub + 1u, 0xFFu})
      if (!has(image, entry.index, sub & 0xFF)) talk.read(entry.index, sub & 0xFF, 1);
  for (const ObjectEntry& entry : image.entries)
    for (const unsigned index : {entry.index - 1u, entry.index + 1u})
      if (!has(image, index, 0)) talk.read(index & 0xFFFF, 0, 1);
  return talk.take();
}

Frames write_all(Bus& bus, const descriptions::DictionaryImage& image) {
  Talk talk(bus, 5);
  for_each(image, [&](const ObjectEntry& entry, unsigned sub) { write_one(talk, image, entry, sub); });
  return talk.take();
}

Frames map_all(Bus& bus, const descriptions::DictionaryImage& image) {
  Talk talk(bus, 5);
  for_each(image, [&](const ObjectEntry& entry, unsigned sub) {
    const unsigned bits = entry.type == DataType::kBoolean ? 1 : 8 * entry.capacity;
    if (has(image, 0x1400, 1)) {
      map_one(talk, 0x1400, 0x205, entry.index, sub, bits & 0xFF);
      talk.send("205#0100000000000000");
      talk.read(entry.index, sub, entry.capacity);
    }
    if (has(image, 0x1800, 1)) map_one(talk, 0x1800, 0x185, entry.index, sub, bits & 0xFF);
    command(talk, bus, "000#8005");
  });
  return talk.take();
}

Frames store_all(Bus& bus, const descriptions::DictionaryImage& image) {
  constexpr std::uint64_t kSave = 0x65766173, kLoad = 0x64616F6C;
  Frames lines;
  const auto play = [&](unsigned index, unsigned sub, std::uint64_t value, const char* reset) {
    Talk talk(bus, 5);
    talk.write(index, sub, value, 4);
    command(talk, bus, reset);
    talk.note(read_all(bus, image));
    const Frames more = talk.take();
    lines.insert(lines.end(), more.begin(), more.end());
  };
  play(0x1010, 1, kSave, "000#8105");
  play(0x1011, 2, kLoad, "000#8205");
  play(0x1011, 1, kLoad, "000#8105");
  return lines;
}

Frames change_node_id(Bus& bus, const descriptions::DictionaryImage& image) {
  Talk talk(bus, 5);
  for (const char* frame : {"7E5#0401000000000000", "7E5#5A00000000000000", "7E5#5E00000000000000",
                            "7E5#1106000000000000", "7E5#1700000000000000", "7E5#0400000000000000"})
    talk.send(frame);
  command(talk, bus, "000#8205");
  talk.note(read_all(bus, image, 6));
  command(talk, bus, "000#8106");
  talk.note(bus.power_cycle());
  talk.note(read_all(bus, image, 6));
  return talk.take();
}

}  // namespace cbcan::test
