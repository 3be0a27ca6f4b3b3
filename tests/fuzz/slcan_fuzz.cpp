// SPDX-License-Identifier: MIT
// Any characters from a serial line.

#include <cctype>

#include "cbcan/slcan/slcan.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

using Event = slcan::LineReader::Event;

/// The line of a frame once more, by lengths: what encode() has to write for it; none if it is no frame.
std::optional<std::string> model(std::string_view line) {
  const std::string_view type = line.substr(0, 1);
  if (type.empty() || std::string_view("tTrR").find(type) == std::string_view::npos) return std::nullopt;
  const std::size_t id_digits = std::isupper(type[0]) ? 8 : 3;
  if (line.size() < 1 + id_digits + 1) return std::nullopt;
  std::string digits(line.substr(1));
  if (!std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isxdigit(c) != 0; }))
    return std::nullopt;
  std::transform(digits.begin(), digits.end(), digits.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const char length = digits[id_digits];
  if (length > '8' || digits.substr(0, id_digits) > (id_digits == 8 ? "1FFFFFFF" : "7FF"))
    return std::nullopt;
  const bool has_data = type == "t" || type == "T";
  const std::size_t wanted = id_digits + 1 + (has_data ? 2 * static_cast<std::size_t>(length - '0') : 0);
  if (digits.size() != wanted && digits.size() != wanted + 4) return std::nullopt;
  return std::string(type) + digits.substr(0, wanted) + '\r';
}

std::string encoded(const Frame& frame) {
  std::array<char, slcan::kMaxLine> line{};
  return {line.data(), slcan::encode(frame, line)};
}

void check_line(std::string_view line) {
  Frame frame;
  const auto expected = model(line);
  require(slcan::decode(line, frame) == expected.has_value(), "a line is a frame or it is not");
  if (expected) require(encoded(frame) == *expected, "a frame that was read is written as it came");
  if (slcan::decode_state(line)) require(line[0] == 'F' || line[0] == 's', "only F and s lines tell a state");
}

/// Lines and bells, once more.
void check_reader(std::string_view text) {
  slcan::LineReader reader;
  std::string line;
  std::uint32_t lost = 0;
  for (const char c : text) {
    const Event event = reader.on_char(c);
    if (c != '\r' && c != '\a') {
      require(event == Event::kNone, "a line ends with CR");
      if (c != '\n') line += c;
      continue;
    }
    const bool too_long = line.size() >= slcan::kMaxLine;
    lost += too_long;
    require(event == (c == '\a'  ? Event::kBell
                      : too_long ? Event::kLost
                                 : Event::kLine),
            "each line is reported");
    if (event == Event::kLine) require(reader.line() == line, "a line is what came since the last one");
    line.clear();
  }
  require(reader.lost() == lost, "lost lines are counted");
}

}  // namespace

}  // namespace cbcan::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cbcan;
  const std::string_view text = fuzz::text_of(data, size);
  fuzz::check_reader(text);
  fuzz::check_line(text.substr(0, text.find('\r')));
  return 0;
}
