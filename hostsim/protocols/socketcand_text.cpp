// SPDX-License-Identifier: MIT
#include "protocols/adapter.hpp"

#include <fmt/core.h>

#include "base/text.hpp"

namespace cbcan::protocols::socketcand {

namespace {

constexpr std::uint32_t kExtendedFlag = 0x8000'0000;
constexpr std::uint32_t kRemoteFlag = 0x4000'0000;
constexpr std::uint32_t kExtendedMask = 0x1FFF'FFFF;
constexpr std::uint32_t kStandardMask = 0x7FF;
constexpr std::size_t kExtendedDigits = 8;
constexpr int kHexadecimal = 16;

/// Keeps as many of the last digits as fit.
template <class Number>
std::optional<Number> parse_hex(std::string_view word) {
  const auto number = base::parse<std::uint64_t>(word, kHexadecimal);
  return number ? std::optional(static_cast<Number>(*number)) : std::nullopt;
}

int digits_of(const Frame& frame) {
  return (frame.flags & Frame::kExtended) != 0 ? 8 : 3;
}

}  // namespace

bool ElementReader::on_char(char c) {
  if (state_ == State::kEnded) state_ = State::kOutside;
  if (state_ == State::kOutside) {
    if (c == '<') state_ = State::kInside;
    text_.clear();
  } else if (c == '>') {
    state_ = State::kEnded;
  } else if (state_ == State::kInside && text_.size() == kLongest) {
    state_ = State::kTooLong;
    text_.clear();
  } else if (state_ == State::kInside) {
    text_ += c;
  }
  return state_ == State::kEnded;
}

std::optional<Frame> parse_identifier(std::string_view word) {
  const auto id = parse_hex<std::uint32_t>(word);
  if (!id) return std::nullopt;
  Frame frame;
  frame.id = *id & kExtendedMask;
  if (word.size() == kExtendedDigits || (*id & kExtendedFlag) != 0 || frame.id > kStandardMask)
    frame.flags |= Frame::kExtended;
  if ((*id & kRemoteFlag) != 0) frame.flags |= Frame::kRemote;
  return frame;
}

std::optional<Frame> parse_send(Words words) {
  if (words.size() < 2) return std::nullopt;
  auto frame = parse_identifier(words[0]);
  const auto length = base::parse<std::uint8_t>(words[1]);
  if (!frame || !length || *length > frame->data.size() || words.size() != 2u + *length) return std::nullopt;
  frame->length = *length;
  for (std::size_t i = 0; i < *length; ++i) {
    const auto byte = parse_hex<std::uint8_t>(words[2 + i]);
    if (!byte) return std::nullopt;
    if ((frame->flags & Frame::kRemote) == 0) frame->data[i] = *byte;
  }
  return frame;
}

/// A remote frame has nine digits: with eight, its flag would make the identifier an extended one.
void append_send(std::string& text, const Frame& frame) {
  const bool remote = (frame.flags & Frame::kRemote) != 0;
  const std::uint32_t extended = (frame.flags & Frame::kExtended) != 0 ? kExtendedFlag : 0;
  const std::uint32_t id = remote ? frame.id | kRemoteFlag | extended : frame.id;
  text += fmt::format("< send {:0{}x} {}", id, remote ? 9 : digits_of(frame), frame.length);
  for (std::size_t i = 0; i < frame.length; ++i)
    text += fmt::format(" {:x}", frame.data[i]);
  text += " >";
}

std::optional<Frame> parse_received(Words words) {
  if (words.size() < 2) return std::nullopt;
  auto frame = parse_identifier(words[0]);
  std::string digits;
  for (const std::string_view word : words.subspan(2))
    digits += word;
  if (!frame || digits.size() % 2 != 0 || digits.size() / 2 > frame->data.size()) return std::nullopt;
  frame->length = static_cast<std::uint8_t>(digits.size() / 2);
  for (std::size_t i = 0; i < frame->length; ++i) {
    const auto byte = base::parse<std::uint8_t>(std::string_view(digits).substr(2 * i, 2), kHexadecimal);
    if (!byte) return std::nullopt;
    frame->data[i] = *byte;
  }
  return frame;
}

void append_received(std::string& text, const Frame& frame, Time time) {
  text += fmt::format("< frame {:0{}X} {}.{:06} {} >", frame.id, digits_of(frame), time / kSecond,
                      time % kSecond, base::hex(std::span(frame.data).first(frame.length), ""));
}

}  // namespace cbcan::protocols::socketcand
