// SPDX-License-Identifier: MIT

#include "base/text.hpp"
#include "base/buffer.hpp"
#include "base/setting.hpp"
#include "support/catch.hpp"

using namespace cbcan::base;
using namespace std::string_literals;

TEST_CASE("integers are decimal, or hexadecimal with 0x or h") {
  CHECK(parse_integer("0") == 0);
  CHECK(parse_integer("127") == 127);
  CHECK(parse_integer("-5") == -5);
  CHECK(parse_integer("0x1017") == 4119);
  CHECK(parse_integer("0XfF") == 255);
  CHECK(parse_integer("42h") == 66);
  CHECK(parse_integer("0FFh") == 255);
  CHECK(parse_integer("6411H") == 0x6411);
  CHECK(parse_integer("9223372036854775807") == INT64_MAX);
  for (const char* bad : {"", "0x", "-", "12 ", " 12", "0x-5", "1.0", "9223372036854775808", "FFh", "twelve", "h",
                          "0x42h", "-42h", "4 2h", "0xh"}) {
    INFO(bad);
    CHECK_FALSE(parse_integer(bad));
  }
}

TEST_CASE("Blanks and control characters at both ends do not count") {
  CHECK(trim(" \t\x01 a b \x1A\r") == "a b");
  CHECK(trim(" \t ").empty());
  CHECK(trim("\xA0") == "\xA0");
}

TEST_CASE("The case of ASCII letters does not count") {
  CHECK(same_text("DefaultValue", "DEFAULTvalue"));
  CHECK_FALSE(same_text("a", "ab"));
  CHECK_FALSE(same_text("[", "{"));
}

TEST_CASE("UTF-8 is distinguished from other text") {
  CHECK(first_line_not_utf8("a\xC3\xBC\xE2\x82\xAC\xF0\x9F\x98\x80") == 0);
  CHECK(first_line_not_utf8("\xFC") == 1);              // Latin-1
  CHECK(first_line_not_utf8("\xC3") == 1);              // cut short
  CHECK(first_line_not_utf8("\xC0\x80") == 1);          // overlong
  CHECK(first_line_not_utf8("\xE0\x80\x80") == 1);      // overlong
  CHECK(first_line_not_utf8("\xED\xA0\x80") == 1);      // surrogate
  CHECK(first_line_not_utf8("\xF4\x90\x80\x80") == 1);  // beyond Unicode
}

TEST_CASE("Text for people is UTF-8 without control characters") {
  CHECK(to_utf8("\xC3\xBC") == "\xC3\xBC");
  CHECK(to_utf8("\xFC") == "\xC3\xBC");
  CHECK(to_utf8(std::string_view("a\0b\x7F", 4)) == "a b ");
  CHECK(to_utf8("a\nb\x1B[2Kc\xC2\x9B"
                "d\xC2\xA0") == "a b [2Kc d\xC2\xA0");
  CHECK(to_utf8("\x9F\xA0") == " \xC2\xA0");
  CHECK(lines_to_utf8("a\nb\r\n\tc\x1B") == "a\nb \n c ");
  CHECK(to_xml("<a b=\"c\">&amp;\n\xFC") == "&lt;a b=&quot;c&quot;&gt;&amp;amp; \xC3\xBC");
}

TEST_CASE("The first line that is not UTF-8") {
  CHECK(first_line_not_utf8("") == 0);
  CHECK(first_line_not_utf8("a\n\xC3\xBC\n") == 0);
  CHECK(first_line_not_utf8("a\n\xFC\n") == 2);
  CHECK(first_line_not_utf8("a\n\n\xE2\x82") == 3);
}

TEST_CASE("Words are separated by blanks and line ends") {
  CHECK(words_of(" a\tb \n c=1 2\r\n") == std::vector<std::string_view>{"a", "b", "c=1", "2"});
  CHECK(words_of(" \n").empty());
  CHECK(split("a=b=c", '=') == std::pair<std::string_view, std::string_view>("a", "b=c"));
  CHECK(split("=", '=') == std::pair<std::string_view, std::string_view>("", ""));
  CHECK_FALSE(split("a", '='));
}

TEST_CASE("Help has two columns, 80 wide") {
  CHECK(beside("--a N", "one two", 12) == "  --a N     one two\n");
  CHECK(beside("--longer N", "one", 12) == "  --longer N\n            one\n");
  const std::string words(67, 'x');
  CHECK(beside("--a N", words + " y", 12) == "  --a N     " + words + "\n            y\n");
  CHECK(beside("--a N", words.substr(2) + " y", 12) == "  --a N     " + words.substr(2) + " y\n");
}

TEST_CASE("suggestions for mistyped words") {
  constexpr std::array<std::string_view, 5> kKnown{"can", "can.bit_rate", "can.spec", "log.file", "node.id"};
  CHECK(nearest("can.bit_rte", kKnown) == "can.bit_rate");
  CHECK(nearest("can.rate", kKnown) == "can.bit_rate");
  CHECK(nearest("can.spce", kKnown) == "can.spec");
  CHECK(nearest("can.sepc", kKnown) == "can.spec");
  CHECK(nearest("can.spcee", kKnown) == "");
  CHECK(nearest("can.file", kKnown) == "log.file");
  CHECK(nearest("cab", kKnown) == "can");
  CHECK(nearest("x", kKnown) == "");
  CHECK(nearest("", kKnown) == "");
  CHECK(nearest("can.", kKnown) == "");
}

// ---- Durations

TEST_CASE("durations") {
  CHECK(parse_duration("0us") == 0u);
  CHECK(parse_duration("1us") == 1u);
  CHECK(parse_duration("100ms") == 100'000u);
  CHECK(parse_duration("2s") == 2'000'000u);
  CHECK(parse_duration("31536000s") == 31'536'000'000'000u);
  for (const char* text : {"", "s", "1", "1m", "-1s", "1.5s", "1 s", " 1s", "1s ", "0x1s", "31536001s",
                           "18446744073709551616us"}) {
    CAPTURE(text);
    CHECK(parse_duration(text) == std::nullopt);
  }
}

TEST_CASE("what time it is") {
  CHECK(seconds_text(0) == "0.000000");
  CHECK(seconds_text(1) == "0.000001");
  CHECK(seconds_text(100'000) == "0.100000");
  CHECK(seconds_text(3'600'000'042) == "3600.000042");
}

// ---- Values

TEST_CASE("bytes are pairs of hex digits, blanks between them mean nothing") {
  CHECK(parse_hex("hex:") == Bytes{});
  CHECK(parse_hex("hex:01 02 fF") == Bytes{1, 2, 255});
  CHECK(parse_hex("hex:0102FF") == Bytes{1, 2, 255});
  CHECK(parse_hex("01 02 FF") == Bytes{1, 2, 255});
  CHECK(parse_hex("hex:  01  02  ") == Bytes{1, 2});
  for (const char* bad : {"hex:0", "hex:01 2", "hex:0 1", "hex:0g", "hex:0x01", "hex:-1", "hex:01,02"}) {
    INFO(bad);
    CHECK_FALSE(parse_hex(bad));
  }
}

TEST_CASE("a typed value has the type that it looks like") {
  CHECK(parse_value("true") == Value(true));
  CHECK(parse_value("false") == Value(false));
  CHECK(parse_value("17") == Value(std::int64_t{17}));
  CHECK(parse_value("-0.5") == Value(-0.5));
  CHECK(parse_value("1e3") == Value(1000.0));
  CHECK(parse_value("Valve 5") == Value("Valve 5"s));
  CHECK(parse_value("\"17\"") == Value("17"s));
  CHECK(parse_value("\"") == Value("\""s));
  CHECK(parse_value("") == Value(""s));
  CHECK(parse_value("inf") == Value("inf"s));
  CHECK(parse_value("nan") == Value("nan"s));
  CHECK(parse_value("infinity") == Value("infinity"s));
  CHECK(parse_value("beach") == Value("beach"s));
}

TEST_CASE("values are shown as a plant file writes them") {
  CHECK(value_text(true) == "true");
  CHECK(value_text(std::int64_t{-5}) == "-5");
  CHECK(value_text(2000.0) == "2000.0");
  CHECK(value_text(0.1) == "0.1");
  CHECK(value_text("a b"s) == "\"a b\"");
  CHECK(value_text(Bytes{1, 0xFF}) == "\"hex:01 FF\"");
  CHECK(value_text(Bytes{}) == "\"hex:\"");
}

TEST_CASE("parts of a text are appended") {
  const std::uint8_t bytes[] = {0x0A, 0xFF, 0x30};
  const auto text = [](const auto&... parts) { return made([&](Buffer& to) { append(to, parts...); }); };
  CHECK(text("a", 'b', "c"s, std::uint8_t{7}, -5, UINT64_MAX) == "abc7-518446744073709551615");
  for (std::uint64_t power = 1; power != 0; power = power > UINT64_MAX / 10 ? 0 : power * 10)
    for (const std::uint64_t number : {power - 1, power, power * 9 + 9}) {
      REQUIRE(text(number) == std::to_string(number));
      REQUIRE(text(static_cast<std::int64_t>(number)) == std::to_string(static_cast<std::int64_t>(number)));
    }
  CHECK(text(INT64_MIN, INT8_MIN, std::int8_t{-9}) == "-9223372036854775808-128-9");
  CHECK(text(Hex{0x1F, 4}, Hex{0xABCDE, 2}, Hex{0, 1}, Hex{UINT64_MAX, 3}) == "001FABCDE0FFFFFFFFFFFFFFFF");
  CHECK(text(HexBytes{bytes}, HexBytes{bytes, ", "}, HexBytes{{}, " "}) == "0AFF300A, FF, 30");
  CHECK(text(Padded{42, 6}, Padded{1234, 2}) == "0000421234");
  CHECK(text(Padded{0, 3}, ' ', Padded{9, 1}, ' ', Padded{99999, 5}, ' ', Padded{1, 20}) ==
        "000 9 99999 00000000000000000001");
  CHECK(text(Decimal{123'456'789, 9}, ' ', Decimal{UINT64_MAX, 9}, ' ', Decimal{7, 0}) ==
        "0.123456789 18446744073.709551615 7");
  CHECK(text(Decimal{1500, 3}, Decimal{2000, 3}, Decimal{1, 6}, Decimal{0, 3}) == "1.520.0000010");
  CHECK(text(std::string(10'000, 'x'), "y") == std::string(10'000, 'x') + "y");
}
