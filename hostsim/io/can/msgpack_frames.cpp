// SPDX-License-Identifier: MIT
#include "io/can/msgpack_frames.hpp"

#include <algorithm>
#include <bit>
#include <string_view>

namespace cbcan::io {

namespace {

// The first byte of each value.
constexpr std::uint8_t kSmallMap = 0x80, kSmallText = 0xA0, kNil = 0xC0, kFalse = 0xC2, kTrue = 0xC3;
constexpr std::uint8_t kBytes8 = 0xC4, kFloat32 = 0xCA, kFloat64 = 0xCB, kUnsigned8 = 0xCC;
constexpr std::uint8_t kUnsigned32 = 0xCE, kSigned8 = 0xD0, kText8 = 0xD9, kMap16 = 0xDE, kNegative = 0xE0;

class Writer {
 public:
  void map(std::uint8_t entries) { bytes_.push_back(kSmallMap | entries); }
  void key(std::string_view name) {
    bytes_.push_back(static_cast<std::uint8_t>(kSmallText | name.size()));
    bytes_.insert(bytes_.end(), name.begin(), name.end());
  }
  void nothing(std::string_view name) { key(name), bytes_.push_back(kNil); }
  void truth(std::string_view name, bool value) { key(name), bytes_.push_back(value ? kTrue : kFalse); }
  void whole(std::string_view name, std::uint32_t value) { key(name), put(kUnsigned32, value, 4); }
  void real(std::string_view name, double value) {
    key(name), put(kFloat64, std::bit_cast<std::uint64_t>(value), 8);
  }
  void data(std::string_view name, std::span<const std::uint8_t> value) {
    key(name), put(kBytes8, value.size(), 1);
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void put(std::uint8_t first, std::uint64_t value, int bytes) {
    bytes_.push_back(first);
    while (bytes-- > 0)
      bytes_.push_back(static_cast<std::uint8_t>(value >> 8 * bytes));
  }

  std::vector<std::uint8_t> bytes_;
};

/// What no number of a frame is.
constexpr std::uint64_t kNoNumber = ~std::uint64_t{0};

/// Text and bytes are `bytes`, truths and whole numbers from 0 on `number`.
struct Value {
  std::uint64_t number = 0;
  std::span<const std::uint8_t> bytes{};
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  bool is_at_end() const { return rest_.empty(); }

  /// How many entries it has.
  std::optional<std::uint64_t> map() {
    const std::uint64_t first = number(1).value_or(0);
    if (first == kMap16) return number(2);
    return (first & 0xF0) == kSmallMap ? std::optional(first & 0x0F) : std::nullopt;
  }

  std::optional<Value> value() {
    const auto read = number(1);
    if (!read) return std::nullopt;
    const auto first = static_cast<std::uint8_t>(*read);
    if (first < kSmallMap) return Value{first};
    if (first >= kNegative) return Value{kNoNumber};
    if ((first & 0xE0) == kSmallText) return bytes(first & 0x1F);
    if (first >= kBytes8 && first < kBytes8 + 3) return bytes(number(1u << (first - kBytes8)));
    if (first >= kText8 && first < kText8 + 3) return bytes(number(1u << (first - kText8)));
    if (first == kNil || first == kFalse || first == kTrue) return Value{first == kTrue ? 1u : 0u};
    if (first == kFloat32 || first == kFloat64) return real(first == kFloat32 ? 4 : 8);
    if (first >= kUnsigned8 && first < kSigned8) return whole(1u << (first - kUnsigned8));
    if (first >= kSigned8 && first < kSigned8 + 4) return with_sign(1u << (first - kSigned8));
    return std::nullopt;
  }

 private:
  std::optional<std::uint64_t> number(std::size_t bytes) {
    if (bytes > rest_.size()) return std::nullopt;
    std::uint64_t value = 0;
    for (; bytes > 0; --bytes, rest_ = rest_.subspan(1))
      value = value << 8 | rest_.front();
    return value;
  }
  std::optional<Value> whole(std::size_t bytes) {
    const auto value = number(bytes);
    return value ? std::optional(Value{*value}) : std::nullopt;
  }
  std::optional<Value> real(std::size_t bytes) {
    return number(bytes) ? std::optional(Value{kNoNumber}) : std::nullopt;
  }
  std::optional<Value> with_sign(std::size_t bytes) {
    const auto value = number(bytes);
    if (!value) return std::nullopt;
    return Value{(*value >> (8 * bytes - 1)) == 0 ? *value : kNoNumber};
  }
  std::optional<Value> bytes(std::optional<std::uint64_t> count) {
    if (!count || *count > rest_.size()) return std::nullopt;
    const Value value{0, rest_.first(*count)};
    rest_ = rest_.subspan(*count);
    return value;
  }

  std::span<const std::uint8_t> rest_;
};

/// What of a message counts.
struct Message {
  std::uint64_t id = kNoNumber, length = 0, is_extended = 0, is_remote = 0, is_error = 0, is_fd = 0;
  std::span<const std::uint8_t> data{};

  void set(std::string_view key, const Value& value) {
    if (key == "arbitration_id") id = value.number;
    if (key == "dlc") length = value.number;
    if (key == "is_extended_id") is_extended = value.number;
    if (key == "is_remote_frame") is_remote = value.number;
    if (key == "is_error_frame") is_error = value.number;
    if (key == "is_fd") is_fd = value.number;
    if (key == "data") data = value.bytes;
  }

  std::optional<Frame> frame() const {
    Frame frame;
    const bool fits = id <= (is_extended != 0 ? 0x1FFF'FFFFu : 0x7FFu) && length <= frame.data.size() &&
                      data.size() == (is_remote != 0 ? 0 : length);
    if (!fits || is_error != 0 || is_fd != 0) return std::nullopt;
    frame.id = static_cast<std::uint32_t>(id);
    frame.length = static_cast<std::uint8_t>(length);
    if (is_extended != 0) frame.flags |= Frame::kExtended;
    if (is_remote != 0) frame.flags |= Frame::kRemote;
    std::ranges::copy(data, frame.data.begin());
    return frame;
  }
};

}  // namespace

std::vector<std::uint8_t> pack_frame(const Frame& frame, Time time) {
  const bool remote = (frame.flags & Frame::kRemote) != 0;
  Writer writer;
  writer.map(11);
  writer.real("timestamp", static_cast<double>(time) / static_cast<double>(kSecond));
  writer.whole("arbitration_id", frame.id);
  writer.truth("is_extended_id", (frame.flags & Frame::kExtended) != 0);
  writer.truth("is_remote_frame", remote);
  writer.truth("is_error_frame", false);
  writer.nothing("channel");
  writer.whole("dlc", frame.length);
  writer.data("data", std::span(frame.data).first(remote ? 0 : frame.length));
  writer.truth("is_fd", false);
  writer.truth("bitrate_switch", false);
  writer.truth("error_state_indicator", false);
  return writer.take();
}

std::optional<Frame> unpack_frame(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  Message message;
  for (std::uint64_t entries = reader.map().value_or(0); entries > 0; --entries) {
    const auto key = reader.value();
    const auto value = key ? reader.value() : std::nullopt;
    if (!value) return std::nullopt;
    message.set({reinterpret_cast<const char*>(key->bytes.data()), key->bytes.size()}, *value);
  }
  return reader.is_at_end() && !bytes.empty() ? message.frame() : std::nullopt;
}

}  // namespace cbcan::io
