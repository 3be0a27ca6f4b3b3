// SPDX-License-Identifier: MIT
#include "text/value.hpp"

#include "support/catch.hpp"

using namespace cbcan::text;
using namespace std::string_literals;

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
}

TEST_CASE("words that number readers know are texts") {
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
