// SPDX-License-Identifier: MIT
// Every mapping of up to five objects of each kind that a mapping distinguishes, and every value of one entry:
// what is rejected, and the frame bit by bit, after CiA 301: at most 64 objects and 64 bits, lowest bit first
// (7.5.2.36, 7.5.2.38); only objects that may be mapped in that direction, with their length, and for RPDOs the
// data types (table 44) as dummies with their length.

#include "cbcan/canopen/pdo/mapping.hpp"
#include "support/catch.hpp"

namespace cbcan {
namespace {

using Flags = ObjectFlags;

constexpr std::uint16_t kRpdoMapping = 0x1600, kTpdoMapping = 0x1A00;
constexpr std::uint32_t kNoObject = 0x06020000, kNoSub = 0x06090011, kNotMappable = 0x06040041,
                        kTooLong = 0x06040042;

constexpr std::uint16_t kBoth = Flags::kReadWrite | Flags::kMapRpdo | Flags::kMapTpdo;

/// The objects; the offsets are written by hand.
const std::vector<ObjectEntry> kEntries{
    {0x1600, 1, 64, DataType::kUnsigned32, 0, Flags::kReadWrite, 0, 4},
    {0x1A00, 1, 64, DataType::kUnsigned32, 0, Flags::kReadWrite, 256, 4},
    {0x2000, 1, 2, DataType::kBoolean, 0, kBoth, 512, 1},
    {0x2001, 0, 0, DataType::kUnsigned8, 0, kBoth, 514, 1},
    {0x2002, 0, 0, DataType::kInteger16, 0, kBoth, 515, 2},
    {0x2003, 0, 0, DataType::kUnsigned24, 0, kBoth, 517, 3},
    {0x2004, 0, 0, DataType::kReal64, 0, kBoth, 520, 8},
    {0x2005, 0, 0, DataType::kUnsigned8, 0, Flags::kReadWrite, 528, 1},
    {0x2006, 0, 0, DataType::kUnsigned8, 0, Flags::kReadWrite | Flags::kMapRpdo, 529, 1},
    {0x2007, 0, 0, DataType::kUnsigned8, 0, Flags::kReadWrite | Flags::kMapTpdo, 530, 1},
    {0x2008, 0, 0, DataType::kVisibleString, 0, kBoth | Flags::kVariable, 535, 8},
    {0x2009, 0, 0, DataType::kUnsigned16, 0, kBoth | Flags::kComputed, 0, 2},
    {0x200A, 1, 16, DataType::kBoolean, 0, kBoth | Flags::kProcess | Flags::kPacked, 3, 1},
    {0x200B, 0, 0, DataType::kUnsigned32, 0, kBoth | Flags::kProcess, 3, 4},
};
constexpr std::size_t kValues = 543, kProcess = 8;

/// One object of each kind: its abort codes, and the place of its value.
struct Object {
  std::uint32_t mapped;
  std::uint32_t receive = 0, transmit = 0;  ///< abort codes
  enum { kNowhere, kValue, kByteOfBoolean, kProcessImage } where = kNowhere;
  unsigned bit = 0;  ///< of the values or the process image
  unsigned bits() const { return mapped & 0xFF; }
};
constexpr Object kObjects[] = {
    {0x20000101, 0, 0, Object::kByteOfBoolean, 512 * 8},
    {0x20000201, 0, 0, Object::kByteOfBoolean, 513 * 8},
    {0x200A0501, 0, 0, Object::kProcessImage, 3 + 4},
    {0x20010008, 0, 0, Object::kValue, 514 * 8},
    {0x20020010, 0, 0, Object::kValue, 515 * 8},
    {0x20030018, 0, 0, Object::kValue, 517 * 8},
    {0x200B0020, 0, 0, Object::kProcessImage, 3 * 8},
    {0x20040040, 0, 0, Object::kValue, 520 * 8},
    {0x20060008, 0, kNotMappable, Object::kValue, 529 * 8},
    {0x20070008, kNotMappable, 0, Object::kValue, 530 * 8},
    {0x00010001, 0, kNotMappable},
    {0x00050008, 0, kNotMappable},
    {0x00070020, 0, kNotMappable},
    {0x20050008, kNotMappable, kNotMappable},
    {0x20080040, kNotMappable, kNotMappable},  // of variable length
    {0x20090010, kNotMappable, kNotMappable},  // computed
    {0x20020008, kNotMappable, kNotMappable},  // not its length
    {0x30000008, kNoObject, kNoObject},
    {0x20010108, kNoSub, kNoSub},
};

struct Device {
  explicit Device(std::uint16_t mapping) : mapping_(mapping) { fill(); }

  void map(std::size_t entry, const Object& object) {
    dictionary.set(mapping_, static_cast<std::uint8_t>(entry), object.mapped);
  }
  bool receives() const { return mapping_ == kRpdoMapping; }
  std::uint32_t resolve(std::size_t count) {
    return static_cast<std::uint32_t>(
        pdo.resolve(dictionary, mapping_, static_cast<std::uint32_t>(count), pieces_));
  }
  /// Makes all bytes of the objects different.
  void fill() {
    for (std::size_t i = 512; i < kValues; ++i)
      values[i] = static_cast<std::uint8_t>(0xA3 + 29 * i);
    for (std::size_t i = 0; i < kProcess; ++i)
      process[i] = static_cast<std::uint8_t>(0x5C + 37 * i);
  }

  std::array<std::uint8_t, kValues> values{};
  std::array<std::uint8_t, kProcess> process{};
  ObjectDictionary dictionary{kEntries, values, nullptr, {}, process};
  PdoMapping pdo;

 private:
  std::uint16_t mapping_;
  std::array<PdoMapping::Piece, PdoMapping::kMostObjects> pieces_{};
};

bool bit_at(const std::uint8_t* bytes, unsigned bit) {
  return (bytes[bit / 8] >> bit % 8 & 1) != 0;
}
void put_bit(std::uint8_t* bytes, unsigned bit, bool value) {
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] & ~(1 << bit % 8));
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] | (value ? 1 << bit % 8 : 0));
}

using Mapped = std::vector<const Object*>;

/// The expected frame, bit by bit.
std::array<std::uint8_t, 8> frame_of(const Device& device, const Mapped& mapped) {
  std::array<std::uint8_t, 8> frame{};
  unsigned place = 0;
  for (const Object* object : mapped) {
    const bool in_process = object->where == Object::kProcessImage;
    const std::uint8_t* const from = in_process ? device.process.data() : device.values.data();
    for (unsigned i = 0; i < object->bits(); ++i)
      put_bit(frame.data(), place++, bit_at(from, object->bit + i));
  }
  return frame;
}

/// Expected values and process image after `frame`.
void take(const std::uint8_t* frame, const Mapped& mapped, std::uint8_t* values, std::uint8_t* process) {
  unsigned place = 0;
  for (const Object* object : mapped) {
    std::uint8_t* const to = object->where == Object::kProcessImage ? process : values;
    if (object->where == Object::kByteOfBoolean) to[object->bit / 8] = 0;
    for (unsigned i = 0; i < object->bits(); ++i, ++place)
      if (object->where != Object::kNowhere) put_bit(to, object->bit + i, bit_at(frame, place));
  }
}

void check_transmit(const Device& device, const Mapped& mapped) {
  std::array<std::uint8_t, 8> frame{};
  device.pdo.sample(device.dictionary, frame);
  if (frame != frame_of(device, mapped)) FAIL("sample of " << mapped.size());
}

void check_receive(Device& device, const Mapped& mapped) {
  for (const int turned : {0x00, 0xFF}) {
    std::array<std::uint8_t, 8> frame{0x96, 0x3C, 0x5A, 0xE1, 0x0F, 0xB2, 0x78, 0xC5};
    for (std::uint8_t& byte : frame)
      byte = static_cast<std::uint8_t>(byte ^ turned);
    device.fill();
    auto values = device.values;
    auto process = device.process;
    take(frame.data(), mapped, values.data(), process.data());
    device.pdo.apply(device.dictionary, frame);
    if (device.values != values || device.process != process) FAIL("apply of " << mapped.size());
  }
}

// ---- Mappings

struct Sweep {
  Device device;
  std::size_t most;
  Mapped mapped{};
  std::size_t mappings = 0, usable = 0;

  /// Checks all continuations of this mapping; `bits` are mapped already.
  void go_on(unsigned bits) {
    for (const Object& object : kObjects) {
      mapped.push_back(&object);
      device.map(mapped.size(), object);
      std::uint32_t expected = device.receives() ? object.receive : object.transmit;
      if (expected == 0 && bits + object.bits() > 64) expected = kTooLong;
      if (device.resolve(mapped.size()) != expected) FAIL("object " << object.mapped << " behind " << bits);
      ++mappings;
      if (expected == 0) check(bits + object.bits());
      mapped.pop_back();
    }
  }
  void check(unsigned bits) {
    ++usable;
    if (device.pdo.bytes() != (bits + 7) / 8) FAIL("bytes of " << bits << " bits");
    device.receives() ? check_receive(device, mapped) : check_transmit(device, mapped);
    if (mapped.size() < most) go_on(bits);
  }
};

TEST_CASE("PDO mapping: every one of up to five objects of nineteen kinds, received and transmitted") {
  for (const std::uint16_t mapping : {kRpdoMapping, kTpdoMapping}) {
    Sweep sweep{Device(mapping), 5};
    sweep.go_on(0);
    CHECK(sweep.mappings > 60000);
    CHECK(sweep.usable > 15000);
  }
}

TEST_CASE("PDO mapping: every one of up to seven objects of nineteen kinds", "[.long]") {
  for (const std::uint16_t mapping : {kRpdoMapping, kTpdoMapping}) {
    Sweep sweep{Device(mapping), 7};
    sweep.go_on(0);
    CHECK(sweep.usable > 500'000);
  }
}

TEST_CASE("PDO mapping: 0 to 255 BOOLEANs, followed by up to nine bytes") {
  for (const std::uint16_t mapping : {kRpdoMapping, kTpdoMapping})
    for (std::size_t booleans = 0; booleans <= 64; ++booleans) {
      Device device(mapping);
      Mapped mapped;
      for (std::size_t i = 1; i <= 64; ++i) {
        mapped.push_back(&kObjects[i > booleans ? 3 : i % 3]);
        device.map(i, *mapped.back());
      }
      for (std::size_t count = 0; count <= 255; ++count) {
        const std::size_t bits = std::min(count, booleans) + 8 * (count - std::min(count, booleans));
        CHECK(device.resolve(count) == (count > 64 || bits > 64 ? kTooLong : 0));
        if (count > 64 || bits > 64) continue;
        const Mapped some(mapped.begin(), mapped.begin() + static_cast<std::ptrdiff_t>(count));
        device.receives() ? check_receive(device, some) : check_transmit(device, some);
      }
    }
}

// ---- One entry

/// Bits of the data types (CiA 301, table 44); 0 = of variable length, or not a type.
unsigned bits_of_type(std::uint32_t index) {
  constexpr unsigned char kBits[] = {0, 1, 8,  16, 32, 8,  16, 32, 32, 0, 0,  0,  48, 48,
                                     0, 0, 24, 64, 40, 48, 56, 64, 24, 0, 40, 48, 56, 64};
  return index < sizeof kBits ? kBits[index] : 0;
}

/// The expected code for one entry of a mapping.
std::uint32_t expected_code(std::uint32_t mapped, bool receives) {
  const std::uint32_t index = mapped >> 16, sub = mapped >> 8 & 0xFF, bits = mapped & 0xFF;
  if (index < 0x20) {
    if (bits_of_type(index) == 0) return kNoObject;
    if (sub != 0) return kNoSub;
    return receives && bits == bits_of_type(index) ? 0 : kNotMappable;
  }
  for (const ObjectEntry& entry : kEntries) {
    if (entry.index != index) continue;
    if (sub < entry.first_sub || sub > entry.last_sub) return kNoSub;
    for (const Object& object : kObjects)
      if (object.mapped >> 16 == index && object.bits() == bits)
        return receives ? object.receive : object.transmit;
    return kNotMappable;
  }
  return kNoObject;
}

void check_entry(const Device& device, std::uint32_t mapped) {
  const std::uint16_t mapping = device.receives() ? kRpdoMapping : kTpdoMapping;
  const auto code = static_cast<std::uint32_t>(PdoMapping::check(device.dictionary, mapping, mapped));
  if (code != expected_code(mapped, device.receives())) FAIL("entry " << mapped << ": " << code);
}

TEST_CASE("PDO mapping: an entry of every value, for the data types and all around the objects") {
  for (const std::uint16_t mapping : {kRpdoMapping, kTpdoMapping}) {
    const Device device(mapping);
    for (std::uint32_t low = 0; low <= 0xFFFF; ++low) {
      for (std::uint32_t index = 0; index <= 0x21; ++index)
        check_entry(device, index << 16 | low);
      for (std::uint32_t index = 0x1FFF; index <= 0x200C; ++index)
        check_entry(device, index << 16 | low);
    }
  }
}

}  // namespace
}  // namespace cbcan
