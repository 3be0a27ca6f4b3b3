// SPDX-License-Identifier: MIT
// Faults of SDO responses of a simulated node; every frame is written out.
#include "sim/faulty_plant.hpp"

using namespace cbcan::test;

namespace {

struct Case {
  const char* fault;
  Texts responses;  ///< with the time in microseconds
};

void check(const Texts& requests, const std::vector<Case>& cases) {
  for (const Case& row : cases) {
    INFO(row.fault);
    FaultyPlant plant;
    plant.set(row.fault);
    plant.send(requests);
    plant.pass(10 * cbcan::kSecond);
    CHECK(plant.heard() == row.responses);
  }
}

const Texts kRead1000{"605#4000100000000000"};
const char* const kResponse = "0 585#4300100091010000";
/// The server's response to a request that belongs to no transfer, since an abort has ended it.
const char* const kUnknown = "0 585#8010200001000405";

const Texts kReadSegments{"605#4010200000000000", "605#6000000000000000", "605#7000000000000000",
                          "605#6000000000000000"};
const Texts kWriteSegments{"605#2110200014000000", "605#0000010203040506", "605#100708090A0B0C0D",
                           "605#030E0F1011121300"};
const Texts kReadBlock{"605#A410200014000000", "605#A300000000000000", "605#A203140000000000",
                       "605#A100000000000000"};
// The CRC-16/XMODEM of 00 01 .. 13 is ACCCh.
const Texts kWriteBlock{"605#C610200014000000", "605#0100010203040506", "605#020708090A0B0C0D",
                        "605#830E0F1011121300", "605#C5CCAC0000000000"};

}  // namespace

TEST_CASE("An expedited read with each fault of responses") {
  check(kRead1000, {
                       {"response-never", {}},
                       {"response-late delay_ms=50", {"50000 585#4300100091010000"}},
                       {"response-twice", {kResponse, kResponse}},
                       {"response-twice delay_ms=3", {kResponse, "3000 585#4300100091010000"}},
                       {"response-out-of-order", {"100000 585#4300100091010000"}},
                       {"response-out-of-order delay_ms=7", {"7000 585#4300100091010000"}},
                       {"response-other-toggle", {kResponse}},
                       {"response-other-specifier", {"0 585#E300100091010000"}},
                       {"response-other-specifier specifier=3", {"0 585#6300100091010000"}},
                       {"response-other-index", {"0 585#4301100091010000"}},
                       {"response-other-index other_index=0x2001 other_sub=7", {"0 585#4301200791010000"}},
                       {"response-other-index other_sub=7", {"0 585#4300100791010000"}},
                       {"response-other-size", {"0 585#4700100091010000"}},
                       {"response-other-size size=1", {"0 585#4F00100091010000"}},
                       {"response-other-crc", {kResponse}},
                       {"response-other-sequence", {kResponse}},
                       {"abort", {"0 585#8000100000000008"}},
                       {"abort code=0x06020000", {"0 585#8000100000000206"}},
                       {"short-frame", {"0 585#43001000910100"}},
                       {"short-frame length=0", {"0 585#"}},
                       {"duplicate-node-id", {kResponse, "0 585#430010006EFEFFFF"}},
                       {"silent", {}},
                       {"heartbeat-stops", {kResponse}},
                   });
}

TEST_CASE("Faults for one object or one step leave the others alone") {
  check(kRead1000, {
                       {"response-never index=0x1000", {}},
                       {"response-never index=0x1000 sub=0", {}},
                       {"response-never index=0x1000 sub=1", {kResponse}},
                       {"response-never index=0x2001", {kResponse}},
                       {"response-never step=initiate", {}},
                       {"response-never step=segment", {kResponse}},
                   });
  check({"605#4000200000000000"}, {
                                      {"response-other-index step=abort", {"0 585#8001200000000206"}},
                                      {"response-other-index step=initiate", {"0 585#8000200000000206"}},
                                  });
}

TEST_CASE("A segmented read with each fault that is about its steps") {
  const char* const first = "0 585#4110200014000000";
  const char* const one = "0 585#0000010203040506";
  const char* const two = "0 585#100708090A0B0C0D";
  const char* const three = "0 585#030E0F1011121300";
  check(
      kReadSegments,
      {
          {"response-other-crc", {first, one, two, three}},
          {"response-other-toggle",
           {first, "0 585#1000010203040506", "0 585#000708090A0B0C0D", "0 585#130E0F1011121300"}},
          {"response-other-toggle after=1 count=1", {first, one, "0 585#000708090A0B0C0D", three}},
          {"response-other-size step=initiate", {"0 585#4110200013000000", one, two, three}},
          {"response-other-size step=initiate size=0xFFFFFFFF", {"0 585#41102000FFFFFFFF", one, two, three}},
          {"response-other-size step=segment after=2", {first, one, two, "0 585#050E0F1011121300"}},
          {"response-other-size step=segment count=1 size=0", {first, "0 585#0E00010203040506", two, three}},
          {"response-never step=segment after=1 count=1", {first, one, three}},
          {"abort step=segment after=1 count=1", {first, one, "0 585#8010200000000008", kUnknown}},
          {"duplicate-node-id after=1 count=1", {first, one, "0 585#00FFFEFDFCFBFAF9", two, three}},
          {"response-out-of-order after=1 count=1", {first, two, one, three}},
      });
}

TEST_CASE("A segmented write with each fault that is about its steps") {
  const char* const first = "0 585#6010200000000000";
  const char* const even = "0 585#2000000000000000";
  const char* const odd = "0 585#3000000000000000";
  check(kWriteSegments,
        {
            {"response-other-size", {first, even, odd, even}},
            {"response-other-toggle count=1", {first, odd, odd, even}},
            {"response-never step=segment after=2", {first, even, odd}},
            {"abort step=segment count=1", {first, "0 585#8010200000000008", kUnknown, kUnknown}},
            {"duplicate-node-id", {first, first, even, even, odd, odd, even, even}},
        });
}

TEST_CASE("A block read with each fault that is about its steps") {
  const char* const first = "0 585#C610200014000000";
  const char* const one = "0 585#0100010203040506";
  const char* const two = "0 585#020708090A0B0C0D";
  const char* const three = "0 585#830E0F1011121300";
  const char* const end = "0 585#C5CCAC0000000000";
  check(
      kReadBlock,
      {
          {"response-other-toggle", {first, one, two, three, end}},
          {"response-other-size step=initiate", {"0 585#C610200013000000", one, two, three, end}},
          {"response-other-size step=block-end", {first, one, two, three, "0 585#C9CCAC0000000000"}},
          {"response-other-crc", {first, one, two, three, "0 585#C533530000000000"}},
          {"response-other-sequence count=1", {first, "0 585#0200010203040506", two, three, end}},
          {"response-other-sequence after=2", {first, one, two, "0 585#840E0F1011121300", end}},
          {"response-other-specifier step=block-segment", {first, one, two, three, end}},
          {"response-never step=block-segment after=1 count=1", {first, one, three, end}},
          {"response-never step=block-end", {first, one, two, three}},
          {"response-out-of-order step=block-segment count=1", {first, two, one, three, end}},
          {"response-out-of-order count=2", {two, first, one, three, end}},
          {"response-late step=block-segment after=2", {first, one, two, end, "50000 585#830E0F1011121300"}},
          {"abort step=block-segment count=1", {first, "0 585#8010200000000008", kUnknown, kUnknown}},
          {"duplicate-node-id after=2 count=1", {first, one, two, "0 585#02F8F7F6F5F4F3F2", three, end}},
      });
}

TEST_CASE("A block write with each fault that is about its steps") {
  const char* const first = "0 585#A41020007F000000";
  const char* const taken = "0 585#A2037F0000000000";
  const char* const end = "0 585#A100000000000000";
  check(kWriteBlock,
        {
            {"response-other-crc", {first, taken, end}},
            {"response-other-sequence", {first, "0 585#A2027F0000000000", end}},
            {"response-never step=block-acknowledge", {first, end}},
            {"response-other-specifier step=block-end specifier=0", {first, taken, "0 585#0100000000000000"}},
            {"response-other-index", {"0 585#A41120007F000000", taken, end}},
            {"abort step=block-end code=0x05040004", {first, taken, "0 585#8010200004000405"}},
        });
}

TEST_CASE("One byte less than the least that can be said is one more") {
  using cbcan::sim::SdoStep;
  const cbcan::sim::Fault fault =
      cbcan::test::fault_from("response-other-size", cbcan::sim::FaultPlace::kNode);
  const auto other = [&](SdoStep step, const char* frame) {
    return cbcan::test::text_of(changed(fault, {step, 0}, cbcan::test::frame_from(frame)));
  };
  CHECK(other(SdoStep::kInitiate, "585#4F01200005000000") == "585#4B01200005000000");
  CHECK(other(SdoStep::kInitiate, "585#4101200000000000") == "585#4101200001000000");
  CHECK(other(SdoStep::kSegment, "585#0F00000000000000") == "585#0D00000000000000");
  CHECK(other(SdoStep::kBlockEnd, "585#DD00000000000000") == "585#D900000000000000");
}

TEST_CASE("An acknowledgement of no segment tells of one") {
  const cbcan::sim::Fault fault =
      cbcan::test::fault_from("response-other-sequence", cbcan::sim::FaultPlace::kNode);
  const cbcan::sim::SdoResponse response{cbcan::sim::SdoStep::kBlockAcknowledge, 0};
  CHECK(cbcan::test::text_of(changed(fault, response, cbcan::test::frame_from("585#A2007F0000000000"))) ==
        "585#A2017F0000000000");
}
