// SPDX-License-Identifier: MIT
// The SDO server by itself: where its buffers and counts end, and what it counts.

#include "cbcan/canopen/sdo/server.hpp"

#include "support/bench.hpp"

namespace cbcan::test {

namespace {

using Flags = ObjectFlags;

const std::vector<ObjectEntry> kServerEntries{
    {0x2000, 0, 0, DataType::kDomain, 0, Flags::kReadWrite | Flags::kVariable, 4, 21},
    {0x2001, 0, 0, DataType::kUnsigned64, 0, Flags::kReadWrite, 25, 8},
    {0x2002, 0, 0, DataType::kVisibleString, 0, Flags::kRead, 33, 24},
};

struct Server final : Wire {
  Server() {
    std::iota(values.begin() + 33, values.end(), std::uint8_t{0x41});  // "ABC...X"
    server.reset(0x5C2);
  }
  template <class... Frames>
  Wire& arrive(const Frames&... frames) {
    (server.on_frame(frame_from(frames), 0), ...);
    return *this;
  }
  void exchange(const std::string& request, const std::string& response) {
    arrive("642#" + request);
    expect("5C2#" + response);
  }

  std::vector<std::uint8_t> values = std::vector<std::uint8_t>(33 + 24);
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(24);
  ObjectDictionary dictionary{kServerEntries, values, nullptr};
  SdoServer server{dictionary, port, buffer};
};

}  // namespace

TEST_CASE("SDO server: a sub-block confirmed in part goes on behind what was confirmed in all") {
  Server server;
  server.exchange("A002200002000000", "C602200018000000");  // without CRC
  server.arrive("642#A300000000000000").expect("5C2#0141424344454647", "5C2#0248494A4B4C4D4E");
  server.arrive("642#A202020000000000").expect("5C2#014F505152535455", "5C2#8256575800000000");
  server.arrive("642#A201020000000000").expect("5C2#8156575800000000");
  server.exchange("A201020000000000", "D100000000000000");
}

TEST_CASE("SDO server: eight sub-blocks in a row without a segment taken, counted anew in each upload") {
  Server server;
  for (const bool again : {false, true}) {
    server.exchange("A402200001000000", "C602200018000000");
    server.arrive("642#A300000000000000").expect("5C2#0141424344454647");
    for (int i = 0; i < 7; ++i)
      server.exchange("A200010000000000", "0141424344454647");
    if (again) server.exchange("A200010000000000", "8002200003000405");
  }
}

TEST_CASE("SDO server: what it counts") {
  Server server;
  const SdoServer::Counters& counters = server.server.counters();
  server.exchange("4030200000000000", "8030200000000206");
  server.exchange("C600200008000000", "A40020007F000000");
  server.arrive("642#0141424344454647");  // a segment in a block is no request
  server.arrive("642#8000200000000008", "642#R8", "642#40002000", "00000642#4000200000000000");
  CHECK(counters.requests == 3);
  CHECK(counters.aborts_sent == 1);
  CHECK(counters.aborts_received == 1);
  CHECK(counters.ignored == 3);
}

}  // namespace cbcan::test
