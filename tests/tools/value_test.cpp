// SPDX-License-Identifier: MIT
#include "descriptions/values.hpp"

#include "base/setting.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"

using namespace cbcan::descriptions;

namespace {

Bytes parse(std::string_view text, std::string_view type) {
  return parse_value(text, value_type(type));
}
std::string print(const Bytes& bytes, std::string_view type) {
  return print_value(bytes, value_type(type));
}

std::string complaint(std::string_view text, std::string_view type) {
  return cbcan::test::complaint_of<UsageError>([&] { parse(text, type); });
}

}  // namespace

TEST_CASE("Numbers on the command line: decimal, 0x, trailing h; a hint where hexadecimal was meant") {
  CHECK(parse_number("25617", 0xFFFF, "INDEX") == 0x6411);
  CHECK(parse_number("0x6411", 0xFFFF, "INDEX") == 0x6411);
  CHECK(parse_number("6411h", 0xFFFF, "INDEX") == 0x6411);
  CHECK(parse_number("1F82H", 0xFFFF, "INDEX") == 0x1F82);
  CHECK(parse_number("0", 0, "NODE") == 0);
  CHECK_THROWS_WITH(parse_number("1F82", 0xFFFF, "INDEX"),
                    "INDEX 1F82: hexadecimal is written 0x1F82 or 1F82h");
  CHECK_THROWS_WITH(parse_number("128", 127, "NODE"), "NODE 128: the most is 127");
  for (const char* bad : {"", "-1", "+1", "0x", "h", "1.5", "1 ", "x"})
    CHECK_THROWS_AS(parse_number(bad, 127, "NODE"), UsageError);
}

TEST_CASE("Integers of every size, little-endian, at the ends of their ranges") {
  CHECK(parse("255", "u8") == Bytes{0xFF});
  CHECK(parse("0x1234", "u16") == Bytes{0x34, 0x12});
  CHECK(parse("1193046", "u24") == Bytes{0x56, 0x34, 0x12});
  CHECK(parse("-1", "i40") == Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF});
  CHECK(parse("-128", "i8") == Bytes{0x80});
  CHECK(parse("18446744073709551615", "u64") == Bytes(8, 0xFF));
  CHECK(parse("-9223372036854775808", "i64") == Bytes{0, 0, 0, 0, 0, 0, 0, 0x80});
  CHECK(complaint("256", "u8") == "'256' is no u8: its range is 0..255");
  CHECK(complaint("-1", "u8") == "'-1' is no u8: its range is 0..255");
  CHECK(complaint("128", "i8") == "'128' is no i8: its range is -128..127");
  CHECK(complaint("-129", "i8") == "'-129' is no i8: its range is -128..127");
  CHECK(complaint("18446744073709551616", "u64") != "");
  CHECK(complaint("ten", "u8") == "'ten' is no u8: write a decimal number, 0x12 or 12h");
}

TEST_CASE("The other types") {
  CHECK(parse("1.5", "f32") == Bytes{0, 0, 0xC0, 0x3F});
  CHECK(parse("-2e3", "f64") == Bytes{0, 0, 0, 0, 0, 0x40, 0x9F, 0xC0});
  CHECK(complaint("1,5", "f32") == "'1,5' is no f32: write a number such as -1.5 or 2e3");
  CHECK(parse("true", "bool") == Bytes{1});
  CHECK(parse("0", "bool") == Bytes{0});
  CHECK(complaint("yes", "bool") == "'yes' is no bool: write true or false");
  CHECK(parse("abc", "string") == Bytes{'a', 'b', 'c'});
  CHECK(parse("01 02fF", "hex") == Bytes{1, 2, 0xFF});
  CHECK(parse("hex:01 02", "u8") == Bytes{1, 2});
  CHECK(complaint("hex:012", "u8") != "");
  CHECK(complaint("hex:0g", "u8") != "");
  CHECK_THROWS_AS(value_type("u12"), UsageError);
}

TEST_CASE("Printing by type") {
  CHECK(print({0x34, 0x12}, "u16") == "4660");
  CHECK(print({0xFF, 0xFF, 0xFF}, "i24") == "-1");
  CHECK(print({0, 0, 0, 0, 0, 0, 0, 0x80}, "i64") == "-9223372036854775808");
  CHECK(print({0, 0, 0xC0, 0x3F}, "f32") == "1.5");
  CHECK(print({2}, "bool") == "true");
  CHECK(print({'a', 'b'}, "string") == "ab");
  CHECK(print({1, 0xAB}, "hex") == "01 AB");
  CHECK_THROWS_WITH(print({1, 2, 3}, "u16"), "the object has 3 bytes, u16 has 2: 01 02 03");
}

TEST_CASE("Printing without a type: by size") {
  CHECK(print_value(Bytes{}) == "(empty)");
  CHECK(print_value(Bytes{5}) == "0x05 5");
  CHECK(print_value(Bytes{0x2C, 0x01}) == "0x012C 300");
  CHECK(print_value(Bytes{1, 2, 3}) == "0x030201 197121");
  CHECK(print_value(Bytes{1, 2, 3, 4, 5}) == "01 02 03 04 05");
  CHECK(print_value(Bytes(8, 0xFF)) == "0xFFFFFFFFFFFFFFFF 18446744073709551615");
}

TEST_CASE("JSON strings") {
  CHECK(cbcan::base::json_text("a\"b\\c\n\xFF") == "\"a\\\"b\\\\c\\u000A\\u00FF\"");
}
