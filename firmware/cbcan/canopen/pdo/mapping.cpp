// SPDX-License-Identifier: MIT
#include "cbcan/canopen/pdo/mapping.hpp"

#include <algorithm>

#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/copy_bytes.hpp"

namespace cbcan {

namespace {

using Piece = PdoMapping::Piece;

constexpr std::uint32_t kMostBits = 8 * PdoMapping::kMostBytes;
constexpr std::uint32_t kMoreBits = kMostBits - 1;
constexpr std::uint16_t kLastDataType = 0x1F;

std::uint32_t bits_of(DataType type, std::size_t bytes) {
  return type == DataType::kBoolean ? 1 : static_cast<std::uint32_t>(8 * bytes);
}

/// Copies one bit, whole bytes, or as many bits at a time as are in one byte on both sides.
void copy_bits(const std::uint8_t* from, std::uint32_t from_bit, std::uint8_t* to, std::uint32_t to_bit,
               std::uint32_t count) {
  if (count == 1) {
    std::uint8_t& byte = to[to_bit / 8];
    const std::uint32_t on = from[from_bit / 8] >> from_bit % 8 & 1;
    byte = static_cast<std::uint8_t>((byte & ~(1u << to_bit % 8)) | on << to_bit % 8);
    return;
  }
  if (count % 8 == 0 && (from_bit | to_bit) % 8 == 0)
    return copy_bytes(from + from_bit / 8, to + to_bit / 8, count / 8);
  while (count != 0) {
    const std::uint32_t many = std::min(count, 8 - std::max(from_bit % 8, to_bit % 8));
    const std::uint32_t ones = (1u << many) - 1;
    const std::uint32_t bits = from[from_bit / 8] >> from_bit % 8 & ones;
    std::uint8_t& byte = to[to_bit / 8];
    byte = static_cast<std::uint8_t>((byte & ~(ones << to_bit % 8)) | bits << to_bit % 8);
    from_bit += many;
    to_bit += many;
    count -= many;
  }
}

AbortCode find_data_type(bool receive, std::uint16_t index, std::uint8_t sub, Piece& object) {
  const auto type = static_cast<DataType>(index);
  const std::uint32_t bits = bits_of(type, size_of(type));
  if (bits == 0) return AbortCode::kNoObject;
  if (sub != 0) return AbortCode::kNoSubIndex;
  object = {PdoMapping::kPassedOver, 0, (bits - 1) & kMoreBits};
  return receive ? AbortCode::kNone : AbortCode::kNotMappable;
}

/// `entry`: the entry of the previous object, which may also contain this one.
AbortCode find_object(const ObjectDictionary& dictionary, bool receive, std::uint16_t index, std::uint8_t sub,
                      ObjectEntry& entry, Piece& object) {
  if (!entry.holds(index, sub)) {
    const AbortCode missing = dictionary.find(index, sub, entry);
    if (missing != AbortCode::kNone) return missing;
  }
  const bool mappable = entry.has(receive ? ObjectFlags::kMapRpdo : ObjectFlags::kMapTpdo);
  const std::size_t first_bit = ObjectDictionary::first_bit(entry, sub);
  const std::uint32_t bits = bits_of(entry.type, entry.capacity);
  if (!mappable || entry.has(ObjectFlags::kVariable) || entry.has(ObjectFlags::kComputed) ||
      first_bit >= PdoMapping::kPassedOver || bits - 1 > kMoreBits)
    return AbortCode::kNotMappable;
  object = {static_cast<std::uint32_t>(first_bit) & PdoMapping::kPassedOver, entry.has(ObjectFlags::kProcess),
            (bits - 1) & kMoreBits};
  return AbortCode::kNone;
}

AbortCode find_mapped(const ObjectDictionary& dictionary, std::uint16_t mapping_index, std::uint32_t mapped,
                      ObjectEntry& entry, Piece& object) {
  const bool receive = mapping_index < object::kTpdoParameter;
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  const AbortCode wrong = index <= kLastDataType
                              ? find_data_type(receive, index, sub, object)
                              : find_object(dictionary, receive, index, sub, entry, object);
  if (wrong != AbortCode::kNone) return wrong;
  return (mapped & 0xFF) == object.more_bits + 1u ? AbortCode::kNone : AbortCode::kNotMappable;
}

/// A BOOLEAN that takes a whole byte, 0 or 1, instead of one of its bits.
constexpr bool is_whole_byte(const Piece& piece) {
  return piece.more_bits == 0 && piece.process == 0;
}

constexpr bool follows(const Piece& before, const Piece& piece) {
  if (before.process != piece.process || is_whole_byte(piece)) return false;
  if (before.first_bit == PdoMapping::kPassedOver || piece.first_bit == PdoMapping::kPassedOver)
    return before.first_bit == piece.first_bit;
  return before.first_bit + before.more_bits + 1u == piece.first_bit;
}

}  // namespace

AbortCode PdoMapping::check(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t mapped) {
  ObjectEntry entry{};
  Piece object;
  return find_mapped(dictionary, index, mapped, entry, object);
}

AbortCode PdoMapping::resolve(const ObjectDictionary& dictionary, std::uint16_t index, std::uint32_t count,
                              std::span<Piece> pieces) {
  if (count > (pieces.empty() ? kMostObjects : pieces.size())) return AbortCode::kMappingLength;
  *this = {};
  pieces_ = pieces.data();
  std::uint32_t bits = 0;
  ObjectEntry
      entries{};  // of the mapping, as `entry` of the mapped object: found once for consecutive sub-indices
  ObjectEntry entry{};
  for (std::uint8_t k = 1; k <= count; ++k) {
    if (!entries.holds(index, k)) dictionary.find(index, k, entries);
    const std::uint64_t mapped = entries.holds(index, k) ? dictionary.number(entries, k) : 0;
    Piece object;
    const AbortCode wrong = find_mapped(dictionary, index, static_cast<std::uint32_t>(mapped), entry, object);
    if (wrong != AbortCode::kNone) return wrong;
    bits += object.more_bits + 1u;
    if (bits > kMostBits) return AbortCode::kMappingLength;
    if (pieces_ != nullptr) add(object);
  }
  bytes_ = static_cast<std::uint8_t>((bits + 7) / 8);
  whole_bytes_ = true;
  for (const Piece& piece : std::span(pieces_, count_))
    whole_bytes_ &= piece.first_bit % 8 == 0 && piece.more_bits % 8 == 7;
  one_copy_ = count_ == 1 && whole_bytes_;
  return AbortCode::kNone;
}

/// Extends the last piece if the object follows it.
void PdoMapping::add(const Piece& object) {
  Piece& last = pieces_[count_ == 0 ? 0 : count_ - 1];
  if (count_ != 0 && follows(last, object))
    last.more_bits = (last.more_bits + object.more_bits + 1u) & kMoreBits;
  else
    pieces_[count_++] = object;
}

void PdoMapping::sample_pieces(const ObjectDictionary& dictionary,
                               std::array<std::uint8_t, kMostBytes>& data) const {
  if (whole_bytes_) {
    std::uint8_t* to = data.data();
    for (const Piece& piece : std::span(pieces_, count_)) {
      const std::uint32_t bytes = piece.more_bits / 8u + 1;
      copy(place(dictionary, piece), to, bytes);
      to += bytes;
    }
    return;
  }
  data = {};
  std::uint32_t bit = 0;
  for (const Piece& piece : std::span(pieces_, count_)) {
    const std::uint32_t count = piece.more_bits + 1u;
    if (piece.first_bit != kPassedOver)
      copy_bits(dictionary.block(piece.process), piece.first_bit, data.data(), bit, count);
    bit += count;
  }
}

void PdoMapping::apply_pieces(const ObjectDictionary& dictionary,
                              const std::array<std::uint8_t, kMostBytes>& data) const {
  if (whole_bytes_) {
    const std::uint8_t* from = data.data();
    for (const Piece& piece : std::span(pieces_, count_)) {
      const std::uint32_t bytes = piece.more_bits / 8u + 1;
      copy(from, place(dictionary, piece), bytes);
      from += bytes;
    }
    return;
  }
  std::uint32_t bit = 0;
  for (const Piece& piece : std::span(pieces_, count_)) {
    const std::uint32_t count = piece.more_bits + 1u;
    if (piece.first_bit != kPassedOver) {
      std::uint8_t* const block = dictionary.block(piece.process);
      if (is_whole_byte(piece)) block[piece.first_bit / 8] = 0;
      copy_bits(data.data(), bit, block, piece.first_bit, count);
    }
    bit += count;
  }
}

bool PdoMapping::holds(bool process, std::uint32_t first_bit) const {
  const auto holds = [&](const Piece& piece) {
    return piece.process == process && first_bit - piece.first_bit <= piece.more_bits;
  };
  return std::any_of(pieces_, pieces_ + count_, holds);
}

}  // namespace cbcan
