// SPDX-License-Identifier: MIT
// The SDO server by itself: where its buffers and counts end, and what it counts.

#include "cbcan/canopen/sdo/server.hpp"

#include "support/bench.hpp"

namespace cbcan::test {

namespace {

using Flags = ObjectFlags;

const std::vector<ObjectEntry> kEntries{
    {0x2000, 0, 0, DataType::kDomain, 0, Flags::kReadWrite | Flags::kVariable, 4, 21},
    {0x2001, 0, 0, DataType::kUnsigned64, 0, Flags::kReadWrite, 25, 8},
    {0x2002, 0, 0, DataType::kVisibleString, 0, Flags::kRead, 33, 24},
};

struct Server final : Wire {
  Server() {
    std::iota(values.begin() + 33, values.end(), std::uint8_t{0x41});  // "ABC...X"
    server.reset(0x5C2);
  }
  Wire& arrive(const std::string& frame) {
    server.on_frame(frame_from(frame), 0);
    return *this;
  }
  void exchange(const std::string& request, const std::string& response) {
    arrive("642#" + request);
    expect("5C2#" + response);
  }

  std::vector<std::uint8_t> values = std::vector<std::uint8_t>(33 + 24);
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(24);
  ObjectDictionary dictionary{kEntries, values, nullptr};
  SdoServer server{dictionary, port, buffer};
};

}  // namespace

TEST_CASE("SDO server: without a declared size as many bytes as the object has, and not one more") {
  Server server;
  for (const bool one_more : {false, true}) {
    server.exchange("2001200000000000", "6001200000000000");
    server.exchange("0001020304050607", "2000000000000000");
    if (one_more) {
      server.exchange("1B08090000000000", "8001200012000706");
    } else {
      server.exchange("1D08000000000000", "3000000000000000");
    }
  }
  server.exchange("4001200000000000", "4101200008000000");
  server.exchange("6000000000000000", "0001020304050607");
  server.exchange("7000000000000000", "1D08000000000000");
}

TEST_CASE("SDO server: a block upload's steps in each of its states") {
  // By state, 0504 0001h or the step's own response; the last segment of four is number 4.
  const std::string start = "A300000000000000", taken = "A204040000000000", end = "A100000000000000";
  const std::string refused = "8002200001000405";
  Server server;
  const auto initiate = [&server] { server.exchange("A402200004000000", "C602200018000000"); };
  const auto stream = [&] {
    initiate();
    server.arrive("642#" + start);
    for (const char* segment :
         {"0141424344454647", "0248494A4B4C4D4E", "034F505152535455", "8456575800000000"})
      server.expect(std::string("5C2#") + segment);
  };
  SECTION("before it") {
    for (const std::string& step : {start, taken, end})
      server.exchange(step, "8000000001000405");
  }
  SECTION("initiated") {
    for (const std::string& step : {taken, end}) {
      initiate();
      server.exchange(step, refused);
      server.exchange(start, refused);  // that was the end of it
    }
  }
  SECTION("waiting for the acknowledgement") {
    for (const std::string& step : {start, end}) {
      stream();
      server.exchange(step, refused);
      server.exchange(taken, refused);
    }
  }
  SECTION("waiting for the end") {
    for (const std::string& step : {start, taken}) {
      stream();
      server.exchange(taken, "D1076B0000000000");
      server.exchange(step, refused);
      server.exchange(end, refused);
    }
  }
  SECTION("at its end, once") {
    stream();
    server.exchange(taken, "D1076B0000000000");
    server.arrive("642#" + end).expect_silence();
    server.exchange(end, refused);
  }
}

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
  server.arrive("642#8000200000000008");
  server.arrive("642#R8");
  server.arrive("642#40002000");
  server.arrive("00000642#4000200000000000");
  CHECK(counters.requests == 3);
  CHECK(counters.aborts_sent == 1);
  CHECK(counters.aborts_received == 1);
  CHECK(counters.ignored == 3);
}

}  // namespace cbcan::test
