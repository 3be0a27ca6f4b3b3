// SPDX-License-Identifier: MIT
// Every text up to a length, and every line that differs from that of a frame in one character, compared with
// the grammar of the LAWICEL manual: t iii l dd.., T iiiiiiii l dd.., r iii l, R iiiiiiii l, optionally followed
// by four digits of a time stamp.

#include "cbcan/slcan/slcan.hpp"
#include "support/catch.hpp"

namespace slcan = cbcan::slcan;
using namespace cbcan;
using Event = slcan::LineReader::Event;

namespace {

int digit(char c) {
  const std::string_view small = "0123456789abcdef", capital = "0123456789ABCDEF";
  const std::size_t at = std::min(small.find(c), capital.find(c));
  return at == small.npos ? -1 : static_cast<int>(at);
}

/// A number of `count` digits from `at` on; -1 if some are missing.
std::int64_t number(std::string_view line, std::size_t at, std::size_t count) {
  std::int64_t value = 0;
  for (std::size_t i = at; i < at + count; ++i) {
    if (i >= line.size() || digit(line[i]) < 0) return -1;
    value = 16 * value + digit(line[i]);
  }
  return value;
}

/// False if the line is not a frame.
bool grammar(std::string_view line, Frame& frame) {
  const char type = line.empty() ? ' ' : line[0];
  const bool extended = type == 'T' || type == 'R', remote = type == 'r' || type == 'R';
  if (!extended && !remote && type != 't') return false;
  const std::size_t id_digits = extended ? 8 : 3;
  const std::int64_t id = number(line, 1, id_digits), length = number(line, 1 + id_digits, 1);
  if (id < 0 || id > (extended ? 0x1FFFFFFF : 0x7FF) || length < 0 || length > 8) return false;
  const auto bytes = static_cast<std::size_t>(remote ? 0 : length);
  const std::size_t end = 2 + id_digits + 2 * bytes;
  if (line.size() != end && (line.size() != end + 4 || number(line, end, 4) < 0)) return false;
  frame = {};
  frame.id = static_cast<std::uint32_t>(id);
  frame.length = static_cast<std::uint8_t>(length);
  frame.flags = static_cast<std::uint8_t>((extended ? Frame::kExtended : 0) | (remote ? Frame::kRemote : 0));
  for (std::size_t i = 0; i < bytes; ++i) {
    const std::int64_t byte = number(line, 2 + id_digits + 2 * i, 2);
    if (byte < 0) return false;
    frame.data[i] = static_cast<std::uint8_t>(byte);
  }
  return true;
}

/// True if it is a frame.
bool check(std::string_view line) {
  const Frame before{0x123, 1, Frame::kRemote, {9}};
  Frame frame = before, expected = before;
  const bool good = grammar(line, expected);
  if (slcan::decode(line, frame) != good || !(frame == (good ? expected : before))) FAIL("line " << line);
  return good;
}

// ---- Texts

/// One character of each kind: the four types, digits below and above the limits of DLC and identifier, letters
/// that are digits and one that is not, the ends of a line and an ignored character.
constexpr std::string_view kCharacters = "tTrR0179fFg\r\a\n";

struct Sweep {
  std::size_t most;  ///< characters
  std::size_t texts = 0, frames = 0;

  /// Checks all continuations of the current text; `line` is the expected content of the reader.
  void go_on(const slcan::LineReader& before, std::string& line, std::size_t characters) {
    for (const char c : kCharacters) {
      slcan::LineReader reader = before;
      const Event event = reader.on_char(c);
      const Event expected = c == '\r' ? Event::kLine : c == '\a' ? Event::kBell : Event::kNone;
      if (event != expected) FAIL("after " << line << " " << int{c});
      if (event == Event::kLine && reader.line() != line) FAIL("line " << line);
      if (event == Event::kLine) frames += check(line);
      ++texts;
      if (characters + 1 == most) continue;
      std::string next = c == '\r' || c == '\a' ? "" : c == '\n' ? line : line + c;
      go_on(reader, next, characters + 1);
    }
  }
};

TEST_CASE("SLCAN: every text of up to six characters of fourteen kinds") {
  Sweep sweep{6};
  std::string line;
  sweep.go_on({}, line, 0);
  CHECK(sweep.texts == 14 + 196 + 2'744 + 38'416 + 537'824 + 7'529'536);
  CHECK(sweep.frames == 108 + 324);  // three times 36 identifiers; l = 0 for t; 0, 1 and 7 for r
}

TEST_CASE("SLCAN: every text of up to seven characters of fourteen kinds", "[.long]") {
  Sweep sweep{7};
  std::string line;
  sweep.go_on({}, line, 0);
  CHECK(sweep.frames > 0);
}

// ---- Lines

TEST_CASE("SLCAN: a frame's line with any character instead of any of its own, and cut or lengthened") {
  std::size_t lines = 0;
  for (const char type : {'t', 'T', 'r', 'R'})
    for (char length = '0'; length <= '9'; ++length)
      for (const std::string stamp : {"", "0EA5"}) {
        std::string line = std::string(1, type) + (type < 'a' ? "1ABCDEF0" : "7A5") + length;
        if (type == 't' || type == 'T')
          line += std::string("0123456789abCDEF99").substr(0, 2u * unsigned(length - '0'));
        line += stamp;
        CHECK(check(line) == (length <= '8'));
        for (std::size_t at = 0; at < line.size(); ++at)
          for (int c = 0; c < 256; ++c, ++lines) {
            std::string other = line;
            other[at] = static_cast<char>(c);
            check(other);
          }
        for (std::size_t size = 0; size <= line.size(); ++size) {
          check(line.substr(0, size));
          check(line + std::string(size, '0'));
        }
      }
  CHECK(lines == 286'720);
}

TEST_CASE("SLCAN: every identifier of 11 bits and both sides of its limits with 29") {
  char text[16];
  for (unsigned id = 0; id <= 0xFFF; ++id) {
    std::snprintf(text, sizeof text, "t%03X0", id);
    CHECK(check(text) == (id <= 0x7FF));
  }
  for (const unsigned id : {0x1FFFFFFEu, 0x1FFFFFFFu, 0x20000000u, 0x80000000u, 0xFFFFFFFFu}) {
    std::snprintf(text, sizeof text, "R%08X0", id);
    CHECK(check(text) == (id <= 0x1FFFFFFF));
  }
}

// ---- States of the controller

TEST_CASE("SLCAN: F with every two characters") {
  for (int high = 0; high < 256; ++high)
    for (int low = 0; low < 256; ++low) {
      const std::string line{'F', static_cast<char>(high), static_cast<char>(low)};
      const std::int64_t flags = number(line, 1, 2);
      std::optional<BusState> expected;
      if (flags >= 0)
        expected = (flags & 0x20) != 0   ? BusState::kErrorPassive
                   : (flags & 0x09) != 0 ? BusState::kOverflow
                                         : BusState::kActive;
      if (slcan::decode_state(line) != expected) FAIL("flags " << high << " " << low);
    }
}

TEST_CASE("SLCAN: an s line with any character instead of any of its own") {
  const std::string good = "sp128007";
  for (std::size_t at = 0; at < good.size(); ++at)
    for (int c = 0; c < 256; ++c) {
      std::string line = good;
      line[at] = static_cast<char>(c);
      std::optional<BusState> expected = BusState::kErrorPassive;
      if (at == 1)
        expected = c == 'p'               ? expected
                   : c == 'b'             ? std::optional(BusState::kBusOff)
                   : c == 'a' || c == 'w' ? std::optional(BusState::kActive)
                                          : std::nullopt;
      else if (at == 0 ? c != 's' : c < '0' || c > '9')
        expected.reset();
      if (slcan::decode_state(line) != expected) FAIL("line " << line);
    }
  CHECK(!slcan::decode_state(good + "0"));
  CHECK(!slcan::decode_state(good.substr(0, 7)));
}

}  // namespace
