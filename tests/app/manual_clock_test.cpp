// SPDX-License-Identifier: MIT
#include "app/manual_clock.hpp"

#include "io/errors.hpp"
#include "support/catch.hpp"

using namespace cbcan::app;

TEST_CASE("how long is to pass") {
  CHECK(parse_pass("pass 0us") == 0);
  CHECK(parse_pass("pass 1us") == 1);
  CHECK(parse_pass("pass 100ms") == 100'000);
  CHECK(parse_pass("pass 2s") == 2'000'000);
  CHECK(parse_pass("pass 2s\r") == 2'000'000);
  CHECK(parse_pass("pass 31536000s") == 31'536'000'000'000);
}

TEST_CASE("what says no time is refused with what would be right") {
  for (const char* line : {"", "pass", "pass ", "pass s", "pass 1", "pass 1m", "pass -1s", "pass 1.5s",
                           "pass 1 s", "pass  1s", " pass 1s", "pass 1s ", "Pass 1s", "pass 0x1s",
                           "pass 31536001s", "pass 18446744073709551616us", "wait 1s"}) {
    CAPTURE(line);
    CHECK_THROWS_WITH(parse_pass(line),
                      "standard input: \"" + std::string(line) +
                          "\": write pass and how long, a whole number of us, ms or s, such as "
                          "pass 100ms");
  }
}

TEST_CASE("what time it is") {
  CHECK(seconds_text(0) == "0.000000");
  CHECK(seconds_text(1) == "0.000001");
  CHECK(seconds_text(100'000) == "0.100000");
  CHECK(seconds_text(3'600'000'042) == "3600.000042");
}
