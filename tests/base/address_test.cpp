// SPDX-License-Identifier: MIT
#include "base/address.hpp"

#include "base/error.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"

namespace cbcan::base {
namespace {

ListenAddress parse(std::string_view text) {
  return parse_listen_address(text, 1502);
}

std::string complaint(std::string_view text) {
  return test::complaint_of<UsageError>([&] { parse(text); });
}

TEST_CASE("host and port") {
  CHECK(parse("127.0.0.1:1502") == ListenAddress{"127.0.0.1", 1502});
  CHECK(parse("localhost:0") == ListenAddress{"localhost", 0});
  CHECK(parse("[::1]:502") == ListenAddress{"::1", 502});
  CHECK(parse("plc.example:65535") == ListenAddress{"plc.example", 65535});
}

TEST_CASE("what is left out is the default port, or this machine alone") {
  CHECK(parse("0.0.0.0") == ListenAddress{"0.0.0.0", 1502});
  CHECK(parse("[::]") == ListenAddress{"::", 1502});
  CHECK(parse(":502") == ListenAddress{"127.0.0.1", 502});
}

TEST_CASE("an address is written as it is read") {
  CHECK(to_string(ListenAddress{"127.0.0.1", 1502}) == "127.0.0.1:1502");
  CHECK(to_string(ListenAddress{"::1", 502}) == "[::1]:502");
}

TEST_CASE("what means nothing is refused with what would be right") {
  CHECK(complaint("") == "address \"\": write HOST:PORT, such as 127.0.0.1:1502");
  CHECK(complaint("1502") == "address \"1502\": a port alone is written :1502");
  CHECK(complaint("::1:502") == "address \"::1:502\": an IPv6 address is written [::1]:1502");
  CHECK(complaint("[::1") == "address \"[::1\": an IPv6 address is written [::1]:1502");
  CHECK(complaint("[]:502") == "address \"[]:502\": an IPv6 address is written [::1]:1502");
  CHECK(complaint("[::1]502") == "address \"[::1]502\": after ']' comes ':' and the port");
  for (const char* text : {"host:", "host:x", "host:-1", "host:65536", "host:1 ", "host: 1", "[::1]:x", ":"})
    CHECK(complaint(text) ==
          "address \"" + std::string(text) + "\": the port is a number 0..65535, 0 = any free one");
}

}  // namespace
}  // namespace cbcan::base
