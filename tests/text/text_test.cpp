// SPDX-License-Identifier: MIT

#include "support/catch.hpp"
#include "text/numbers.hpp"
#include "text/suggestion.hpp"
#include "text/utf8.hpp"
#include "text/words.hpp"

using namespace cbcan::text;

TEST_CASE("integers are decimal or 0x") {
  CHECK(parse_integer("0") == 0);
  CHECK(parse_integer("127") == 127);
  CHECK(parse_integer("-5") == -5);
  CHECK(parse_integer("0x1017") == 4119);
  CHECK(parse_integer("0XfF") == 255);
  CHECK(parse_integer("9223372036854775807") == INT64_MAX);
  for (const char* bad :
       {"", "0x", "-", "12 ", " 12", "0x-5", "1.0", "9223372036854775808", "FFh", "twelve"}) {
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
  CHECK(less_text("A", "b"));
  CHECK_FALSE(less_text("B", "a"));
}

TEST_CASE("UTF-8 is told from other text") {
  CHECK(is_utf8("a\xC3\xBC\xE2\x82\xAC\xF0\x9F\x98\x80"));
  CHECK_FALSE(is_utf8("\xFC"));              // Latin-1
  CHECK_FALSE(is_utf8("\xC3"));              // cut short
  CHECK_FALSE(is_utf8("\xC0\x80"));          // overlong
  CHECK_FALSE(is_utf8("\xE0\x80\x80"));      // overlong
  CHECK_FALSE(is_utf8("\xED\xA0\x80"));      // surrogate
  CHECK_FALSE(is_utf8("\xF4\x90\x80\x80"));  // beyond Unicode
}

TEST_CASE("Text for people is UTF-8 without control characters") {
  CHECK(to_utf8("\xC3\xBC") == "\xC3\xBC");
  CHECK(to_utf8("\xFC") == "\xC3\xBC");
  CHECK(to_utf8(std::string_view("a\0b\x7F", 4)) == "a b ");
}

TEST_CASE("The first line that is not UTF-8") {
  CHECK(first_line_not_utf8("") == 0);
  CHECK(first_line_not_utf8("a\n\xC3\xBC\n") == 0);
  CHECK(first_line_not_utf8("a\n\xFC\n") == 2);
  CHECK(first_line_not_utf8("a\n\n\xE2\x82") == 3);
}

TEST_CASE("Words stand between blanks and line ends") {
  CHECK(words_of(" a\tb \n c=1 2\r\n") == std::vector<std::string_view>{"a", "b", "c=1", "2"});
  CHECK(words_of(" \n").empty());
  CHECK(split("a=b=c", '=') == std::pair<std::string_view, std::string_view>("a", "b=c"));
  CHECK(split("=", '=') == std::pair<std::string_view, std::string_view>("", ""));
  CHECK_FALSE(split("a", '='));
}

TEST_CASE("Help stands in two columns, 80 wide") {
  CHECK(beside("--a N", "one two", 12) == "  --a N     one two\n");
  CHECK(beside("--longer N", "one", 12) == "  --longer N\n            one\n");
  const std::string words(67, 'x');
  CHECK(beside("--a N", words + " y", 12) == "  --a N     " + words + "\n            y\n");
  CHECK(beside("--a N", words.substr(2) + " y", 12) == "  --a N     " + words.substr(2) + " y\n");
}

TEST_CASE("what somebody may have meant") {
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
