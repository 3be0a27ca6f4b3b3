// SPDX-License-Identifier: MIT
// docs/contract.md, "SDO service": when mode 0 uses block transfer.

#include "contract/window.hpp"
#include "support/frame_text.hpp"
#include "support/sdo_peer.hpp"

using namespace cbcan::contract;

namespace {

constexpr std::uint16_t kAuto = 0, kBlock = 3;

void set_mode(Window& window, std::uint16_t mode) {
  window.configure(0x3004, 0, 1, {mode});
}

/// A transfer with node 5 that is cancelled at once: what its first request was. The late answer ends the
/// quarantine.
std::string first_request(Window& window) {
  std::string request = window.target().next_frame();
  window.set(3700, {0});
  window.expect("605#8000200000000008");
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

/// Node 5 takes a block write of "123456789" in mode 3; its CRC is the published check value 31C3h.
void show_block(Window& window) {
  set_mode(window, kBlock);
  window.write(5, 0x2000, 0, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
  window.exchange({{"605#C600200009000000", "585#A40020007F000000"},
                   {"605#0131323334353637", ""},
                   {"605#8238390000000000", "585#A2027F0000000000"},
                   {"605#D5C3310000000000", "585#A100000000000000"}});
  window.check_done();
  set_mode(window, kAuto);
}

/// Runs a transfer with the server; says how many frames it took.
int run(Window& window, cbcan::test::SdoPeer& server) {
  int frames = 0;
  for (std::string frame = window.target().next_frame(); !frame.empty();
       frame = window.target().next_frame()) {
    ++frames;
    server.on_frame(cbcan::test::frame_from(frame));
    while (const cbcan::Frame* const answer = server.answer()) {
      ++frames;
      window.arrive(cbcan::test::text_of(*answer));
    }
  }
  window.check_done();
  return frames;
}

/// 01h, 02h, ... 1Dh
Words counting_words() {
  Words words;
  for (unsigned byte = 1; byte <= 29; byte += 2)
    words.push_back(static_cast<std::uint16_t>(byte | (byte == 29 ? 0 : byte + 1) << 8));
  return words;
}

}  // namespace

TEST_CASE(
    "SDO service: Mode 0 uses block transfer with nodes that have shown that they can: after one that ended "
    "well in mode 3, writes of more than 28 bytes and reads with more than 28 in R3705 go by block, which "
    "takes fewer frames from there on") {
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
    cbcan::test::SdoPeer server(29);
    set_mode(window, kBlock);
    window.read(5, 0x2000, 0, 128);
    run(window, server);
    set_mode(window, kAuto);
    CHECK(first_of_write(window, 29) == "605#C60020001D000000");
    CHECK(first_of_read(window, 29) == "605#A400200005000000");
  }
  SECTION("from there on, whatever else went well") {
    cbcan::test::SdoPeer server(29);
    show_block(window);
    for (const std::uint16_t size : Words{4, 28, 29, 29}) {
      window.write(5, 0x2000, 0, size, counting_words());
      run(window, server);
    }
    set_mode(window, 2);
    window.read(5, 0x2000, 0, 29);
    run(window, server);
    set_mode(window, kAuto);
    CHECK(first_of_write(window, 29) == "605#C60020001D000000");
  }
  SECTION("not with another node") {
    show_block(window);
    window.write(6, 0x2000, 0, 29, {});
    window.exchange({{"606#210020001D000000", "586#8000200000000206"}});
    window.check_failed(0x06020000);
  }
  SECTION("not after one that did not end well") {
    set_mode(window, kBlock);
    window.write(5, 0x2000, 0, 9, {0, 0, 0, 0, 0});
    window.exchange({{"605#C600200009000000", "585#A40020007F000000"},
                     {"605#0100000000000000", ""},
                     {"605#8200000000000000", "585#A2027F0000000000"},
                     {"605#D500000000000000", "585#8000200004000405"}});
    window.check_failed(0x05040004);
    set_mode(window, kAuto);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
  SECTION("the other modes are what they are") {
    show_block(window);
    set_mode(window, 2);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
}

TEST_CASE(
    "SDO service: Mode 0 uses block transfer with nodes that have shown that they can: after one that ended "
    "well in mode 3, writes of more than 28 bytes and reads with more than 28 in R3705 go by block, which "
    "takes fewer frames from there on -- the frames, and the data") {
  Window window;
  cbcan::test::SdoPeer server(29);
  server.hold(1);
  SECTION("writing") {
    window.write(5, 0x2000, 0, 29, counting_words());
    CHECK(run(window, server) == 12);
    show_block(window);
    window.write(5, 0x2000, 0, 29, counting_words());
    CHECK(run(window, server) == 10);
    CHECK(std::vector(server.written().begin(), server.written().end()) ==
          std::vector<std::uint8_t>{1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15,
                                    16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29});
  }
  SECTION("reading") {
    window.read(5, 0x2000, 0, 29);
    CHECK(run(window, server) == 12);
    show_block(window);
    window.set(3706, filled_data());
    window.read(5, 0x2000, 0, 29);
    CHECK(run(window, server) == 11);
    CHECK(window.reg(3705) == 29);
    CHECK(window.target().read(3706, 15) == counting_words());
    CHECK(window.reg(3721) == 0xD000 + 3721);
  }
}

TEST_CASE(
    "SDO service: A node that refuses it is asked again without, in the same transaction; when that works, "
    "mode 0 uses no block with that node any more") {
  Window window;
  cbcan::test::SdoPeer server(29);
  server.hold(1);
  show_block(window);
  SECTION("a write") {
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange({{"605#C60020001D000000", "585#8000200001000405"}});
    CHECK(window.busy());
    CHECK(run(window, server) == 12);
    CHECK(server.written().size() == 29);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
    CHECK(first_of_read(window, 29) == "605#4000200000000000");
  }
  SECTION("a read") {
    window.read(5, 0x2000, 0, 128);
    window.exchange({{"605#A400200013000000", "585#8000200001000405"}});
    CHECK(window.busy());
    CHECK(run(window, server) == 12);
    CHECK(window.reg(3705) == 29);
    CHECK(window.target().read(3706, 15) == counting_words());
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
    CHECK(first_of_read(window, 29) == "605#4000200000000000");
  }
  SECTION("not any more, whatever else happens in mode 0") {
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange({{"605#C60020001D000000", "585#8000200001000405"}});
    run(window, server);
    window.pass(10s);
    for (int i = 0; i < 3; ++i) {
      window.write(5, 0x2000, 0, 29, counting_words());
      CHECK(run(window, server) == 12);
    }
  }
  SECTION("it does not work without either: the second answer counts") {
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange(
        {{"605#C60020001D000000", "585#8000200001000405"}, {"605#210020001D000000", "585#8000200002000106"}});
    window.check_failed(0x06010002);
    window.write(5, 0x2000, 0, 29, counting_words());
    window.expect("605#C60020001D000000");
    window.set(3700, {0});
    window.expect("605#8000200000000008");
  }
  SECTION("an abort in the middle is no refusal") {
    window.read(5, 0x2000, 0, 29);
    window.exchange(
        {{"605#A400200005000000", "585#C60020001D000000"}, {"605#A300000000000000", "585#8000200004000405"}});
    window.check_failed(0x05040004);
  }
  SECTION("another node is not affected") {
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange({{"605#C60020001D000000", "585#8000200001000405"}});
    run(window, server);
    set_mode(window, kBlock);
    window.write(6, 0x2000, 0, 9, {0x3231, 0x3433, 0x3635, 0x3837, 0x0039});
    window.exchange({{"606#C600200009000000", "586#A40020007F000000"},
                     {"606#0131323334353637", ""},
                     {"606#8238390000000000", "586#A2027F0000000000"},
                     {"606#D5C3310000000000", "586#A100000000000000"}});
    set_mode(window, kAuto);
    window.read(6, 0x2000, 0, 29);
    window.exchange(
        {{"606#A400200005000000", "586#C60020001D000000"}, {"606#A300000000000000", "586#8000200002000106"}});
    window.check_failed(0x06010002);
    CHECK(first_of_write(window, 29) == "605#210020001D000000");
  }
  SECTION("mode 3 is not asked again") {
    set_mode(window, kBlock);
    window.write(5, 0x2000, 0, 29, counting_words());
    window.exchange({{"605#C60020001D000000", "585#8000200001000405"}});
    window.check_failed(0x05040001);
  }
}
