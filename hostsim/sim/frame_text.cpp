// SPDX-License-Identifier: MIT
#include "sim/frame_text.hpp"

#include <algorithm>

#include "base/setting.hpp"
#include "base/text.hpp"

namespace cbcan::sim {

namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // CAN_ERR_FLAG of linux/can.h
constexpr unsigned kStandardIdDigits = 3;
constexpr unsigned kExtendedIdDigits = 8;

}  // namespace

void append_frame(base::Buffer& to, const Frame& frame) {
  const bool has_error = (frame.flags & Frame::kError) != 0;
  const bool is_long = has_error || (frame.flags & Frame::kExtended) != 0;
  base::append(to,
               base::Hex{has_error ? frame.id | kErrorFlag : frame.id,
                         is_long ? kExtendedIdDigits : kStandardIdDigits},
               '#');
  if ((frame.flags & Frame::kRemote) == 0)
    return base::append(to, base::HexBytes{std::span(frame.data).first(frame.length)});
  base::append(to, 'R');
  if (frame.length != 0) base::append(to, frame.length);
}

std::string frame_text(const Frame& frame) {
  return base::made([&frame](base::Buffer& to) { append_frame(to, frame); });
}

std::optional<Frame> parse_frame(std::string_view text) {
  const auto sides = base::split(text, '#');
  const bool extended = sides && sides->first.size() == kExtendedIdDigits;
  if (!sides || (!extended && sides->first.size() != kStandardIdDigits)) return std::nullopt;
  const auto id = base::parse<std::uint32_t>(sides->first, 16);
  if (!id || *id > (extended ? 0x1FFFFFFF : 0x7FF)) return std::nullopt;
  Frame frame{.id = *id, .flags = extended ? Frame::kExtended : std::uint8_t{0}};
  std::string_view data = sides->second;
  if (data.starts_with('R')) {
    frame.flags |= Frame::kRemote;
    const auto length = data.size() == 1 ? 0 : base::parse<std::uint8_t>(data.substr(1));
    if (!length || *length > frame.data.size()) return std::nullopt;
    frame.length = *length;
    return frame;
  }
  const auto bytes = base::parse_hex(data);
  if (!bytes || bytes->size() > frame.data.size()) return std::nullopt;
  std::ranges::copy(*bytes, frame.data.begin());
  frame.length = static_cast<std::uint8_t>(bytes->size());
  return frame;
}

std::optional<TimedFrame> parse_candump_line(std::string_view line) {
  const auto words = base::words_of(line);
  if (words.size() < 3 || !words[0].starts_with('(') || !words[0].ends_with(')')) return std::nullopt;
  const auto time = base::split(words[0].substr(1, words[0].size() - 2), '.');
  if (!time || time->second.size() != 6) return std::nullopt;
  const Time seconds = base::parse<Time>(time->first).value_or(kNever);
  const Time rest = base::parse<Time>(time->second).value_or(kNever);
  const auto frame = parse_frame(words[2]);
  if (!frame || seconds > kNever / kSecond / 2 || rest == kNever) return std::nullopt;
  return TimedFrame{seconds * kSecond + rest, *frame};
}

void append_candump_line(std::string& text, const Frame& frame, Time time, std::string_view interface) {
  base::Buffer line;
  base::append(line, '(', base::Padded{time / kSecond, 10}, '.', base::Padded{time % kSecond, 6}, ") ",
               interface, ' ');
  append_frame(line, frame);
  base::append(line, '\n');
  text += base::view(line);
}

}  // namespace cbcan::sim
