// SPDX-License-Identifier: MIT

#include <fstream>
#include <regex>
#include <set>

#include "boards/stm32/can_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

TEST_CASE("transmit: three mailboxes, then full; in the order of the requests, not of the identifiers") {
  StartedRig rig;
  CHECK(rig.send("603#"));
  CHECK(rig.send("602#"));
  CHECK(rig.send("601#"));
  CHECK_FALSE(rig.send("000#0100"));
  CHECK(rig.sent() == "603#");
  CHECK(rig.send("000#0100"));  // refused, then accepted: after the earlier ones
  CHECK_FALSE(rig.send("701#00"));
  CHECK(rig.sent() == "602#");
  CHECK(rig.sent() == "601#");
  CHECK(rig.sent() == "000#0100");
  CHECK(rig.sent().empty());
  rig.poll();
  CHECK(rig.can.counters().sent == 4);
  CHECK(rig.can.counters().refused == 2);
  CHECK(rig.can.counters().taken_back == 0);
}

TEST_CASE("transmit: a frame without acknowledgement is cancelled after a second") {
  StartedRig rig;
  rig.now = 5 * kSecond;
  CHECK(rig.send("000#0100"));
  CHECK(rig.poll() == 6 * kSecond);
  rig.fail(30, CanRig::Model::kAcknowledgement);  // the cable is off
  rig.poll(kSecond - 1);
  CHECK(rig.can.counters().taken_back == 0);
  CHECK(rig.can.state() == cbcan::BusState::kErrorPassive);
  rig.poll(1);
  rig.let_it_ask();
  CHECK(rig.can.state() == cbcan::BusState::kErrorPassive);  // not bus-off, whatever the driver did
  CHECK(rig.can.counters().taken_back == 1);
  CHECK(rig.can.counters().sent == 0);
  rig.poll(10 * 60 * kSecond);
  CHECK(rig.sent().empty());  // the cable is back
}

TEST_CASE("transmit: the second begins with the request, however long the loop had slept") {
  StartedRig rig;
  CHECK(rig.send("601#"));
  rig.poll();
  CHECK(rig.sent() == "601#");
  CHECK(rig.poll() == kNever);
  rig.now += 3600 * kSecond;
  CHECK(rig.send("602#"));  // the same mailbox
  CHECK(rig.poll() == rig.now + kSecond);
  CHECK(rig.sent() == "602#");
}

// ---- Receive

namespace {

/// FIFO that the frame is for, of node 7Fh; -1 = none. Written from the driver's promises.
int fifo_for(std::uint32_t id, bool remote) {
  const bool where_pdos_are = id <= 0x5FF || (id >= 0x680 && id <= 0x6FF);
  if (!numbers::kFiltersSeeRtr && id == 0x77F) return 0;
  if (remote && numbers::kFiltersSeeRtr) return id == 0x77F ? 0 : where_pdos_are ? 1 : -1;
  if (id == 0x000 || id == 0x67F || id == 0x7E4 || id == 0x7E5 || (id >= 0x580 && id <= 0x5FF)) return 0;
  return where_pdos_are || (id >= 0x700 && id <= 0x77F) ? 1 : -1;
}

/// The CAN-IDs in the table of docs/how-to/port.md, for node 7Fh.
std::set<unsigned long> identifiers_of_page() {
  std::ifstream file(CBCAN_SOURCE_DIR "/docs/how-to/port.md");
  const std::string page(std::istreambuf_iterator<char>(file), {});
  const std::regex row(R"(\| ([0-9A-F]{3})h(?:\.\.([0-9A-F]{3})h)?( \+ own node ID)? \|)");
  std::set<unsigned long> found;
  for (std::sregex_iterator each(page.begin(), page.end(), row), end; each != end; ++each) {
    const unsigned long first = std::stoul((*each)[1], nullptr, 16) + ((*each)[3].matched ? 0x7F : 0);
    const unsigned long last = (*each)[2].matched ? std::stoul((*each)[2], nullptr, 16) : first;
    for (unsigned long id = first; id <= last; ++id)
      found.insert(id);
  }
  return found;
}

}  // namespace

TEST_CASE("receive: docs/how-to/port.md lists what passes the filters") {
  const std::set<unsigned long> in_page = identifiers_of_page();
  for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
    // Identifiers that only a PDO can use: the page has these as text.
    const bool is_elsewhere =
        (id >= 0x001 && id < 0x080) || (id > 0x100 && id < 0x180) || (id >= 0x680 && id < 0x700);
    INFO(std::hex << id);
    CHECK((in_page.contains(id) || is_elsewhere) == (fifo_for(id, false) >= 0));
  }
}

TEST_CASE("receive: a length of 9 to 15 means eight bytes; bytes past the length are 0") {
  StartedRig rig;
  Frame frame = frame_from("581#1122334455667788");
  frame.length = 15;
  rig.hear(frame);
  Frame heard;
  REQUIRE(rig.can.receive(heard));
  CHECK(heard == frame_from("581#1122334455667788"));
  frame.length = 5;
  rig.hear(frame);
  REQUIRE(rig.can.receive(heard));
  CHECK(heard == frame_from("581#1122334455"));
}

TEST_CASE("receive: every identifier hits or misses the filters as promised") {
  StartedRig rig;
  for (const bool remote : {false, true}) {
    for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
      Frame frame;
      frame.id = id;
      if (remote) frame.flags = Frame::kRemote;
      const int expected = fifo_for(id, remote);
      INFO((remote ? "RTR " : "") << std::hex << id);
      REQUIRE(rig.model.arrive(frame) == (expected >= 0));
      REQUIRE(rig.model.rx0_line() == (expected == 0));
      REQUIRE(rig.model.rx1_line() == (expected == 1));
      rig.can.on_interrupt();
      Frame heard;
      REQUIRE(rig.can.receive(heard) == (expected >= 0));
      if (expected >= 0) REQUIRE(heard == frame);
    }
  }
  for (const char* extended : {"00000000#", "00000581#", "16000000#", "1C1FFFFF#"})
    CHECK_FALSE(rig.hear(frame_from(extended)));
}

TEST_CASE("receive: an overrun keeps what was there, is counted, and shows for a second") {
  StartedRig rig;
  for (const char* frame : {"581#01", "582#02", "583#03", "584#04", "585#05"})
    rig.model.arrive(frame_from(frame));
  rig.can.on_interrupt();
  for (const char* frame : {"581#01", "582#02", "583#03"})
    CHECK(rig.received() == frame);
  CHECK(rig.received().empty());
  CHECK(rig.can.counters().overruns == 1);  // FOVR is one bit: the number of lost frames is unknown
  rig.poll();
  CHECK(rig.can.state() == BusState::kOverflow);
  rig.poll(kSecond - 1);
  CHECK(rig.can.state() == BusState::kOverflow);
  rig.poll(1);
  CHECK(rig.can.state() == BusState::kActive);
  CHECK(rig.can.counters().overruns == 1);
}

TEST_CASE("receive: a storm of EMCY messages that the loop does not follow loses no SDO response") {
  StartedRig rig;
  for (int i = 0; i < 1000; ++i)
    rig.hear(frame_from("081#0010010000000000"));
  rig.hear(frame_from("5C2#6011640100000000"));
  CHECK(rig.received() == "5C2#6011640100000000");  // received before the storm
  int emcy = 0;
  while (rig.received() == "081#0010010000000000")
    ++emcy;
  CHECK(emcy == 64);
  CHECK(rig.can.counters().received == 1001);
  CHECK(rig.can.counters().queue_full == 1000 - 64);
  rig.poll();
  CHECK(rig.can.state() == BusState::kOverflow);
}
