// SPDX-License-Identifier: MIT
// docs/reference/contract.md, "SDO service": when mode 0 uses block transfer.

#include "contract/window.hpp"

using namespace cbcan::contract;

namespace {

/// The first request of a transfer with node 5 that is cancelled immediately. The late response ends the
/// quarantine.
std::string first_request(Window& window) {
  std::string request = window.target().next_frame();
  window.set(3700, {0}).expect("605#8000200000000008");
  window.arrive("585#8000200000000008");
  return request;
}

std::string first_of_write(Window& window, std::uint16_t size) {
  window.write(5, 0x2000, 0, size, {0, 0});
  return first_request(window);
}

std::string first_of_read(Window& window, std::uint16_t room) {
  window.read(5, 0x2000, 0, room);
  return first_request(window);
}

/// Node 5 accepts a block write of "123456789" in mode 3; its CRC is the published check value 31C3h.
void show_block(Window& window) {
  window.set_mode(kBlock);
  window.write(5, 0x2000, 0, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  window.exchange({{"605#C600200009000000", "585#A40020007F000000"},
                   {"605#0131323334353637", ""},
                   {"605#8238390000000000", "585#A2027F0000000000"},
                   {"605#D5C3310000000000", "585#A100000000000000"}});
  window.check_done();
  window.set_mode(kAuto);
}

// 2000h:00 of node 5 holds, or gets, the bytes 01h, 02h, ... 1Dh.
const std::vector<Step> kSegmentedWrite{
    {"605#210020001D000000", "585#6000200000000000"}, {"605#0001020304050607", "585#2000000000000000"},
    {"605#1008090A0B0C0D0E", "585#3000000000000000"}, {"605#000F101112131415", "585#2000000000000000"},
    {"605#10161718191A1B1C", "585#3000000000000000"}, {"605#0D1D000000000000", "585#2000000000000000"}};
const std::vector<Step> kSegmentedRead{
    {"605#4000200000000000", "585#410020001D000000"}, {"605#6000000000000000", "585#0001020304050607"},
    {"605#7000000000000000", "585#1008090A0B0C0D0E"}, {"605#6000000000000000", "585#000F101112131415"},
    {"605#7000000000000000", "585#10161718191A1B1C"}, {"605#6000000000000000", "585#0D1D000000000000"}};
const std::vector<Step> kBlockWrite{{"605#C60020001D000000", "585#A40020007F000000"},
                                    {"605#0101020304050607", ""},
                                    {"605#0208090A0B0C0D0E", ""},
                                    {"605#030F101112131415", ""},
                                    {"605#04161718191A1B1C", ""},
                                    {"605#851D000000000000", "585#A2057F0000000000"},
                                    {"605#D9111F0000000000", "585#A100000000000000"}};
const std::vector<Step> kBlockRead{{"605#A400200005000000", "585#C60020001D000000"},
                                   {"605#A300000000000000", "585#0101020304050607"},
                                   {"", "585#0208090A0B0C0D0E"},
                                   {"", "585#030F101112131415"},
                                   {"", "585#04161718191A1B1C"},
                                   {"", "585#851D000000000000"},
                                   {"605#A205050000000000", "585#D9111F0000000000"},
                                   {"605#A100000000000000", ""}};

/// 01h, 02h, ... 1Dh
Words counting_words() {
  Words words;
  for (unsigned byte = 1; byte <= 29; byte += 2)
    words.push_back(static_cast<std::uint16_t>(byte | (byte == 29 ? 0 : byte + 1) << 8));
  return words;
}

void write_29(Window& window, const std::vector<Step>& steps) {
  window.write(5, 0x2000, 0, 29, counting_words());
  window.exchange(steps).check_done();
}

void read_29(Window& window, const std::vector<Step>& steps) {
  window.set(3706, filled_data());
  window.read(5, 0x2000, 0, 29);
  window.exchange(steps).check_done();
  CHECK(window.reg(3705) == 29);
  CHECK(window.target().read(3706, 15) == counting_words());
  CHECK(window.reg(3721) == 0xD000 + 3721);
}

/// Node 5 rejects the first request of a block transfer; then the transfer continues without.
std::vector<Step> refused(const char* request, const std::vector<Step>& then) {
  std::vector<Step> steps{{request, "585#8000200001000405"}};
  steps.insert(steps.end(), then.begin(), then.end());
  return steps;
}

}  // namespace

TEST_CASE("[SDO-8] block transfer in mode 0") {
  Window window;
  SECTION("not before") {
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
    CHECK(first_of_read(window, 128) == "605#4000200000000000");
  }
  SECTION("after a write") {
    show_block(window);
    CHECK(first_of_write(window, 28) == "605#210020001C000000");
    CHECK(first_of_write(window, 29) == "605#C60020001D000000");
    CHECK(first_of_write(window, 128) == "605#C600200080000000");
    CHECK(first_of_read(window, 28) == "605#4000200000000000");
    CHECK(first_of_read(window, 29) == "605#A400200005000000");
    CHECK(first_of_read(window, 128) == "605#A400200013000000");
    CHECK(first_of_write(window, 4) == "605#2300200000000000");
  }
  SECTION("after a read") {
    window.set_mode(kBlock);
    read_29(window, kBlockRead);
    window.set_mode(kAuto);
    CHECK(first_of_write(window, 29) == "605#C60020001D000000");
    CHECK(first_of_read(window, 29) == "605#A400200005000000");
  }
  SECTION("from there on, whatever else went well") {
    show_block(window);
    write_29(window, kBlockWrite);
    write_29(window, kBlockWrite);
    window.write(5, 0x2000, 0, 2, {0x2211}).exchange({{"605#2B00200011220000", "585#6000200000000000"}});
    window.set_mode(2);
    read_29(window, kSegmentedRead);
    window.set_mode(kAuto);
    read_29(window, kBlockRead);
  }
  SECTION("not with another node") {
    show_block(window);
    window.write(6, 0x2000, 0, 29, {}).exchange({{"606#210020001D000000", "586#8000200000000206"}});
    window.check_failed(0x06020000);
  }
  SECTION("not after one that did not end well") {
    window.set_mode(kBlock);
    window.write(5, 0x2000, 0, 9, {0, 0, 0, 0, 0});
    window.exchange({{"605#C600200009000000", "585#A40020007F000000"},
                     {"605#0100000000000000", ""},
                     {"605#8200000000000000", "585#A2027F0000000000"},
                     {"605#D500000000000000", "585#8000200004000405"}});
    window.check_failed(0x05040004);
    window.set_mode(kAuto);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
  SECTION("the other modes are what they are") {
    show_block(window);
    window.set_mode(2);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
}

TEST_CASE("[SDO-8] the frames, and the data") {
  Window window;
  write_29(window, kSegmentedWrite);
  read_29(window, kSegmentedRead);
  show_block(window);
  write_29(window, kBlockWrite);
  read_29(window, kBlockRead);
}

TEST_CASE("[SDO-9] block transfer refused") {
  Window window;
  show_block(window);
  SECTION("a write") {
    write_29(window, refused("605#C60020001D000000", kSegmentedWrite));
    write_29(window, kSegmentedWrite);
    read_29(window, kSegmentedRead);
  }
  SECTION("a read") {
    read_29(window, refused("605#A400200005000000", kSegmentedRead));
    read_29(window, kSegmentedRead);
    write_29(window, kSegmentedWrite);
  }
  SECTION("not any more, however long it is") {
    write_29(window, refused("605#C60020001D000000", kSegmentedWrite));
    window.pass(10s);
    write_29(window, kSegmentedWrite);
  }
  SECTION("it does not work without either: the second response counts") {
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange(
        {{"605#C60020001D000000", "585#8000200000000106"}, {"605#210020001D000000", "585#8000200002000106"}});
    window.check_failed(0x06010002);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
  SECTION("by a code that is about the object it is final, and block goes on") {
    for (const char* response : {"585#8000200001000106", "585#8000200000000206", "585#80002000FFFFFF06"}) {
      window.read(5, 0x2000, 0, 29).expect("605#A400200005000000");
      window.arrive(response);
      CHECK(window.reg(3700) == 4);
    }
  }
  SECTION("an abort in the middle is no refusal") {
    window.read(5, 0x2000, 0, 29);
    window.exchange(
        {{"605#A400200005000000", "585#C60020001D000000"}, {"605#A300000000000000", "585#8000200004000405"}});
    window.check_failed(0x05040004);
  }
  SECTION("another node is not affected") {
    write_29(window, refused("605#C60020001D000000", kSegmentedWrite));
    window.set_mode(kBlock);
    window.write(6, 0x2000, 0, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
    window.exchange({{"606#C600200009000000", "586#A40020007F000000"},
                     {"606#0131323334353637", ""},
                     {"606#8238390000000000", "586#A2027F0000000000"},
                     {"606#D5C3310000000000", "586#A100000000000000"}});
    window.set_mode(kAuto);
    window.read(6, 0x2000, 0, 29);
    window.exchange(
        {{"606#A400200005000000", "586#C60020001D000000"}, {"606#A300000000000000", "586#8000200002000106"}});
    window.check_failed(0x06010002);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
  SECTION("mode 3 is not asked again") {
    window.set_mode(kBlock);
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange({{"605#C60020001D000000", "585#8000200001000405"}}).check_failed(0x05040001);
  }
}
