// SPDX-License-Identifier: MIT

#include "support/catch.hpp"
#include "text/numbers.hpp"

using namespace cbcan::text;

TEST_CASE("how long something takes") {
  CHECK(parse_duration("0us") == 0u);
  CHECK(parse_duration("1us") == 1u);
  CHECK(parse_duration("100ms") == 100'000u);
  CHECK(parse_duration("2s") == 2'000'000u);
  CHECK(parse_duration("31536000s") == 31'536'000'000'000u);
}

TEST_CASE("what says no time") {
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

TEST_CASE("hexadecimal numbers begin with 0x or end with h") {
  CHECK(parse_integer("0x42") == 66);
  CHECK(parse_integer("42h") == 66);
  CHECK(parse_integer("0FFh") == 255);
  CHECK(parse_integer("6411H") == 0x6411);
  for (const char* text : {"h", "FFh", "0x42h", "-42h", "4 2h", "0xh"}) {
    CAPTURE(text);
    CHECK(parse_integer(text) == std::nullopt);
  }
}
