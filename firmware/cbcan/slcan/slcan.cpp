// SPDX-License-Identifier: MIT
#include "cbcan/slcan/slcan.hpp"

#include <algorithm>

namespace cbcan::slcan {

namespace {

constexpr std::uint32_t kLastStandardId = 0x7FF;
constexpr std::uint32_t kLastExtendedId = 0x1FFF'FFFF;
constexpr std::size_t kTimeStampDigits = 4;
constexpr char kSmall = 0x20;  // the bit that makes a letter small

/// Writes text without a check of size: the caller knows the maximum length.
class Writer {
 public:
  explicit Writer(char* begin) : begin_(begin), next_(begin) {}

  void put(char c) { *next_++ = c; }
  void put(std::string_view text) {
    for (const char c : text)
      put(c);
  }
  void put_hex(std::uint32_t value, unsigned digits) {
    while (digits-- > 0)
      put("0123456789ABCDEF"[value >> 4 * digits & 0xF]);
  }
  std::size_t length() const { return static_cast<std::size_t>(next_ - begin_); }

 private:
  char* begin_;
  char* next_;
};

/// Takes digits from the front of a text; after a missing or invalid one ended() stays false.
class Digits {
 public:
  explicit Digits(std::string_view text) : next_(text.begin()), end_(text.end()) {}

  std::uint32_t take(std::size_t count, std::uint32_t base = 16) {
    std::uint32_t value = 0;
    for (; count > 0; --count)
      value = value * base + take_one(base);
    return value;
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - next_); }
  bool ended() const { return good_ && next_ == end_; }

 private:
  std::uint32_t take_one(std::uint32_t base) {
    std::uint32_t value = base;
    if (next_ != end_) value = value_of(*next_++);
    if (value < base) return value;
    good_ = false;
    return 0;
  }
  static std::uint32_t value_of(char c) {
    if (c >= '0' && c <= '9') return static_cast<std::uint32_t>(c - '0');
    const char small = static_cast<char>(c | kSmall);
    if (small >= 'a' && small <= 'f') return static_cast<std::uint32_t>(small - 'a' + 10);
    return ~0u;
  }

  std::string_view::iterator next_;
  std::string_view::iterator end_;
  bool good_ = true;
};

std::optional<BusState> decode_status(std::string_view line) {
  Digits digits({line.data() + 1, 2});
  const std::uint32_t flags = digits.take(2);
  if (!digits.ended()) return std::nullopt;
  if (flags & status::kErrorPassive) return BusState::kErrorPassive;
  if (flags & (status::kReceiveFull | status::kDataOverrun)) return BusState::kOverflow;
  return BusState::kActive;
}

std::optional<BusState> decode_state_change(std::string_view line) {
  Digits counters({line.data() + 2, 6});
  counters.take(6, 10);
  if (!counters.ended()) return std::nullopt;
  switch (line[1]) {
    case 'a':
    case 'w': return BusState::kActive;
    case 'p': return BusState::kErrorPassive;
    case 'b': return BusState::kBusOff;
    default: return std::nullopt;
  }
}

}  // namespace

std::size_t encode(const Frame& frame, std::span<char, kMaxLine> out) {
  if (frame.flags & Frame::kError) return 0;
  const bool remote = frame.flags & Frame::kRemote;
  const bool extended = frame.flags & Frame::kExtended;
  Writer writer(out.data());
  const char type = remote ? 'R' : 'T';
  writer.put(extended ? type : static_cast<char>(type | kSmall));
  writer.put_hex(frame.id, extended ? 8 : 3);
  writer.put_hex(frame.length, 1);
  for (std::size_t i = 0; !remote && i < frame.length; ++i)
    writer.put_hex(frame.data[i], 2);
  writer.put(kEnd);
  return writer.length();
}

bool decode(std::string_view line, Frame& frame) {
  if (line.empty()) return false;
  const char type = static_cast<char>(line[0] | kSmall);
  if (type != 't' && type != 'r') return false;
  const bool extended = type != line[0];
  Frame read;
  read.flags =
      static_cast<std::uint8_t>((type == 'r' ? Frame::kRemote : 0) | (extended ? Frame::kExtended : 0));
  Digits digits({line.data() + 1, line.size() - 1});
  read.id = digits.take(extended ? 8 : 3);
  read.length = static_cast<std::uint8_t>(digits.take(1));
  if (read.id > (extended ? kLastExtendedId : kLastStandardId) || read.length > read.data.size())
    return false;
  for (std::size_t i = 0; type == 't' && i < read.length; ++i)
    read.data[i] = static_cast<std::uint8_t>(digits.take(2));
  if (digits.left() == kTimeStampDigits) digits.take(kTimeStampDigits);
  if (!digits.ended()) return false;
  frame = read;
  return true;
}

LineReader::Event LineReader::on_char(char c) {
  if (ended_) length_ = 0;
  ended_ = c == kEnd || c == kNo;
  if (c == kNo) return Event::kBell;
  if (c == kEnd) return length_ < text_.size() ? Event::kLine : Event::kLost;
  if (c != '\n' && length_ < text_.size()) text_[length_++] = c;
  return Event::kNone;
}

std::optional<BusState> decode_state(std::string_view line) {
  if (line.size() == 3 && line[0] == 'F') return decode_status(line);
  if (line.size() == 8 && line[0] == 's') return decode_state_change(line);
  return std::nullopt;
}

OpenCommands encode_open(std::uint16_t kbit_per_second) {
  OpenCommands commands{'\r', '\r', '\r', 'C', '\r', 'S', '0', '\r', 'O', '\r'};
  const auto rate = std::ranges::find(kBitRates, kbit_per_second);
  commands[6] = static_cast<char>('0' + (rate - kBitRates.begin()));
  return commands;
}

}  // namespace cbcan::slcan
