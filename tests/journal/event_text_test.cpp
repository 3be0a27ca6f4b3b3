// SPDX-License-Identifier: MIT
// Frames, values and results as text. The frames are written by hand from CiA 301.

#include "journal/event_text.hpp"

#include "sim/frame_text.hpp"
#include "support/catch.hpp"

namespace cbcan::journal {
namespace {

const descriptions::DeviceDescription kDevice{{}, {{0x1000, 0, 0, "Device type", DataType::kUnsigned32},
                                                   {0x1008, 0, 0, "Device name", DataType::kVisibleString},
                                                   {0x6401, 1, 8, "Input", DataType::kInteger16}}};

const descriptions::Object* find(std::uint8_t network, std::uint8_t node, std::uint16_t index, std::uint8_t sub) {
  return network == 1 && node == 5 ? kDevice.find(index, sub) : nullptr;
}

}  // namespace

TEST_CASE("frames in words") {
  struct Row {
    const char* frame;
    const char* words;
  };
  for (const auto& [frame, words] : {
           Row{"000#0105", "NMT Start Remote Node: node 5"},
           Row{"000#8200", "NMT Reset Communication: all nodes"},
           Row{"000#77", "a frame"},
           Row{"080#", "SYNC"},
           Row{"085#3081110000000000",
               "EMCY node 5: 8130h life guard error or heartbeat error; generic, communication"},
           Row{"100#409C00000A42", "TIME"},
           Row{"185#01", "TPDO1 node 5"},
           Row{"505#01", "RPDO4 node 5"},
           Row{"605#4000100000000000", "SDO node 5: read 1000h:00 Device type"},
           Row{"585#4300100091010F00", "SDO node 5: value of 1000h:00 Device type = 983441"},
           Row{"605#2B016402FEFF0000", "SDO node 5: write 6401h:02 Input = -2"},
           Row{"585#6001640200000000", "SDO node 5: written 6401h:02 Input"},
           Row{"585#410810000E000000", "SDO node 5: value of 1008h:00 Device name"},
           Row{"605#6000000000000000", "SDO node 5: read next segment"},
           Row{"585#8000100000000206", "SDO node 5: abort 1000h:00 Device type: 0602 0000h no such object"},
           Row{"606#8000100001000000",
               "SDO node 6: abort 1000h:00: 0000 0001h an abort code of the node's own"},
           Row{"705#R1", "node 5: node guarding request"},
           Row{"705#00", "node 5: boot-up"},
           Row{"705#85", "node 5: heartbeat or guarding: operational"},
           Row{"7E5#5A00000000000000", "LSS master"},
           Row{"00000605#40", "29-bit frame"},
       }) {
    CAPTURE(frame);
    CHECK(base::made([&, of = *sim::parse_frame(frame)](Buffer& to) { append_frame(to, of, 1, find); }) == words);
  }
}

TEST_CASE("results in words") {
  CHECK(result_text({.result = 0}) == "done");
  CHECK(result_text({.result = 2}) == "R3702 is above 127");
  CHECK(result_text({.result = 4, .code = 0x05040000}) == "0504 0000h SDO service timed out");
  CHECK(result_text({.result = 6}) ==
        "the number came without all words of its request; nothing is executed");
  CHECK(result_text({.result = kCancelled}) == "cancelled");
  CHECK(result_text({.result = kNeverSent}) == "cancelled before its first frame (is TIMEOUT too short?)");
  CHECK(result_text({.result = 77}) == "77 in place of a result");
}

TEST_CASE("values by what the EDS says, or as numbers") {
  const std::array<std::uint8_t, 2> two{0xFE, 0xFF};
  CHECK(value_text(two, kDevice.find(0x6401, 8)) == "-2");
  CHECK(value_text(two, kDevice.find(0x6401, 9)) == "65534");
  CHECK(value_text(two, kDevice.find(0x1000, 0)) == "65534");
  const std::uint8_t five[] = {1, 2, 3, 4, 5};
  CHECK(value_text(five, nullptr) == "\"hex:01 02 03 04 05\"");
  CHECK(value_text(std::span(five).first(4), nullptr) == "67305985");
  CHECK(value_text(std::span(five).first(0), nullptr) == "\"hex:\"");
  const std::array<std::uint8_t, 3> abc{'a', 'b', 'c'};
  CHECK(value_text(abc, kDevice.find(0x1008, 0)) == "\"abc\"");
}

}  // namespace cbcan::journal
