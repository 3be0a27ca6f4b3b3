// SPDX-License-Identifier: MIT
// The adapter's side of the LAWICEL protocol, character by character, from its manual.
#include "protocols/adapter.hpp"

#include <new>

#include "sim/bus_suite.hpp"

using namespace cbcan;
using cbcan::protocols::Adapter;
using cbcan::protocols::slcan_adapter;
using namespace cbcan::test;

namespace {

std::size_t allocations = 0;

}  // namespace

void* operator new(std::size_t size, const std::nothrow_t& /*unused*/) noexcept {
  ++allocations;
  return std::malloc(size);
}
void* operator new(std::size_t size) {
  if (void* const memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace {

/// An adapter and another port on its bus.
struct SlcanDesk : Host<SlcanDesk> {
  cbcan::sim::Bus bus;
  Time now = 0;
  std::uint64_t lost = 0;
  std::unique_ptr<cbcan::protocols::StreamSession> adapter = slcan_adapter(
      bus, [this] { bus.advance(now); }, Adapter::kMostUnsent, &lost);
  Listener ear;
  cbcan::sim::Port& other = bus.attach(ear);

  SlcanDesk() { other.accept(0, 0x7FF); }

  void arrive(std::string_view frame) {
    CHECK(other.try_send(frame_from(frame)));
    bus.advance(now);
  }
};

}  // namespace

TEST_CASE("SLCAN: opened, it sends and hears frames") {
  SlcanDesk desk;
  CHECK(desk.respond("C\r") == "\a");
  CHECK(desk.respond("S6\r") == "\r");
  CHECK(desk.respond("O\r") == "\r");
  CHECK(desk.respond("t60584017100000000000\r") == "z\r");
  CHECK(desk.respond("T1ABCDEF0100\r") == "Z\r");
  CHECK(desk.respond("r7421\r") == "z\r");
  CHECK(desk.respond("R000007420\r") == "Z\r");
  CHECK(desk.ear.heard == Texts{"605#4017100000000000", "1ABCDEF0#00", "742#R1", "00000742#R0"});
  desk.arrive("585#4B17100000");
  desk.arrive("1ABCDEF0#");
  desk.arrive("742#R1");
  CHECK(desk.said() == "t58554B17100000\rT1ABCDEF00\rr7421\r");
}

TEST_CASE("SLCAN: opening and closing is no work for each identifier") {
  SlcanDesk desk;
  CHECK(desk.respond("O\r") == "\r");
  const auto second = slcan_adapter(desk.bus, [] {});
  const std::size_t before = allocations;
  for (int i = 0; i < 10; ++i)
    second->receive("O\rC\r");
  CHECK(allocations - before < 10);
  CHECK(second->unsent() == std::string(20, '\r'));
}

TEST_CASE("SLCAN: what a host sends to open an adapter that it knows nothing about") {
  SlcanDesk desk;
  CHECK(desk.respond("t12") == "");
  CHECK(desk.respond("\r\r\rC\rS6\rO\r") == "\a\r\r\a\r\r");
  CHECK(desk.respond("C\rS8\rO\rO\r") == "\r\r\r\a");
}

TEST_CASE("SLCAN: closed, it neither sends nor hears") {
  SlcanDesk desk;
  CHECK(desk.respond("t0000\r") == "\a");
  CHECK(desk.respond("F\r") == "\a");
  desk.arrive("123#");
  CHECK(desk.respond("O\rC\r") == "\r\r");
  desk.arrive("123#");
  CHECK(desk.said() == "");
  CHECK(desk.ear.heard.empty());
}

TEST_CASE("SLCAN: L listens and does not send") {
  SlcanDesk desk;
  CHECK(desk.respond("L\rt0000\rO\r") == "\r\a\a");
  desk.arrive("123#");
  CHECK(desk.respond("C\r") == "t1230\r\r");
  CHECK(desk.ear.heard.empty());
}

TEST_CASE("SLCAN: settings are for the closed channel") {
  SlcanDesk desk;
  CHECK(desk.respond("S0\rS8\rZ1\rZ0\rM00000000\rmFFFFFFFF\r") == "\r\r\r\r\r\r");
  CHECK(desk.respond("O\rS6\rZ1\rM00000000\rm00000000\r") == "\r\a\a\a\a");
}

TEST_CASE("SLCAN: V and N response always") {
  SlcanDesk desk;
  CHECK(desk.respond("V\rN\rO\rV\rN\r") == "V1013\rNCB01\r\rV1013\rNCB01\r");
}

TEST_CASE("SLCAN: what it does not know is refused") {
  SlcanDesk desk;
  for (const char* line :
       {"S",  "S9",  "S66",      "s031C",     "o",          "O1", "L1",    "C1",       "Z",
        "Z2", "Z10", "M0000000", "M0000000G", "m000000000", "V1", "N1",    "F0",       "X1",
        "A",  "P",   "q",        " ",         "\xFF",       "z",  "hello", "mG0000000"}) {
    CAPTURE(line);
    CHECK(desk.respond(std::string(line) + "\r") == "\a");
  }
  CHECK(desk.respond("O\r") == "\r");
  for (const char* line : {"C1", "O1", "F0", "t", "t8000", "t00001", "t1239", "T200000000", "r7029"}) {
    CAPTURE(line);
    CHECK(desk.respond(std::string(line) + "\r") == "\a");
  }
  CHECK(desk.ear.heard.empty());
}

TEST_CASE("SLCAN: Z1 adds the milliseconds of the minute") {
  SlcanDesk desk;
  CHECK(desk.respond("Z1\rO\r") == "\r\r");
  desk.now = 59'999 * kMillisecond + 999;
  desk.arrive("123#AA");
  desk.now = 60'000 * kMillisecond;
  desk.arrive("123#R0");
  CHECK(desk.said() == "t1231AAEA5F\rr12300000\r");
}

TEST_CASE("SLCAN: a client that does not read loses frames, and F reports it once") {
  SlcanDesk desk;
  CHECK(desk.respond("O\r") == "\r");
  for (int i = 0; i < 10'000; ++i)
    desk.arrive("605#4017100000000000");
  const std::size_t kept = desk.adapter->unsent().size();
  CHECK(kept <= Adapter::kMostUnsent);
  CHECK(kept % 22 == 0);
  CHECK(desk.lost == 10'000 - kept / 22);
  desk.said();
  CHECK(desk.respond("F\rF\r") == "F09\rF00\r");
  desk.arrive("605#");
  CHECK(desk.said() == "t6050\r");
}

TEST_CASE("SLCAN: without a limit nothing is lost, in whatever pieces it is taken") {
  SlcanDesk desk;
  const auto second = slcan_adapter(
      desk.bus, [] {}, Adapter::kUnlimited);
  second->receive("O\r");
  second->sent(1);
  std::string expected, taken;
  for (int i = 0; i < 10'000; ++i) {
    const std::string digits = std::to_string(10'000 + i);
    desk.arrive("605#" + digits + "0");
    expected += "t6053" + digits + "0\r";
  }
  for (std::size_t step = 1; !second->unsent().empty(); step = step * 3 % 1013) {
    const std::string_view piece = second->unsent().substr(0, step);
    taken += piece;
    second->sent(piece.size());
  }
  CHECK(taken == expected);
}

TEST_CASE("SLCAN: a full transmit queue refuses, and F says so once") {
  SlcanDesk desk;
  desk.bus.set_link(false);
  CHECK(desk.respond("O\rt0000\rF\rF\r") == "\r\aF02\rF00\r");
}

TEST_CASE("SLCAN: the controller's state is reported unasked and by F") {
  SlcanDesk desk;
  desk.bus.set_state(BusState::kErrorPassive, 0);
  CHECK(desk.said() == "");
  CHECK(desk.respond("O\rF\r") == "\rF20\r");
  desk.bus.set_state(BusState::kBusOff, 0);
  CHECK(desk.respond("F\r") == "sb000256\rFA0\r");
  desk.bus.set_state(BusState::kErrorPassive, 0);
  desk.bus.set_state(BusState::kOverflow, 0);
  CHECK(desk.respond("F\r") == "sp128128\rF08\r");
  desk.bus.set_state(BusState::kActive, 0);
  CHECK(desk.respond("F\r") == "sa000000\rF00\r");
}

TEST_CASE("SLCAN: error reports of the controller are not frames") {
  SlcanDesk desk;
  CHECK(desk.respond("O\r") == "\r");
  desk.bus.receive(Frame{0x4, 8, Frame::kError, {}}, 0);
  CHECK(desk.said() == "");
}

TEST_CASE("SLCAN: adapters hear each other, in the order of the bus") {
  SlcanDesk desk;
  const auto second = slcan_adapter(desk.bus, [&desk] { desk.bus.advance(0); });
  second->receive("O\r");
  CHECK(desk.respond("O\rt1230\rt1240\r") == "\rz\rz\r");
  second->receive("t1250\r");
  CHECK(second->unsent() == "\rt1230\rt1240\rz\r");
  CHECK(desk.said() == "t1250\r");
}

TEST_CASE("SLCAN: frames queued by a closed adapter are sent; the next adapter starts clean") {
  SlcanDesk desk;
  auto gone = slcan_adapter(desk.bus, [] {});
  gone->receive("O\rt1230\r");
  gone.reset();
  desk.bus.set_state(BusState::kErrorPassive, 0);
  desk.bus.advance(0);
  CHECK(desk.ear.heard == Texts{"123#"});
  const auto next = slcan_adapter(desk.bus, [] {});
  desk.arrive("123#");
  CHECK(next->unsent().empty());
  next->receive("O\r");
  desk.arrive("124#");
  CHECK(next->unsent() == "\rt1240\r");
}

TEST_CASE("SLCAN: characters may come in any pieces") {
  const std::string_view text = "O\rt1230\rF\r";
  for (unsigned cuts = 0; cuts < 1u << (text.size() - 1); ++cuts) {
    SlcanDesk desk;
    std::size_t begin = 0;
    for (std::size_t end = 1; end <= text.size(); ++end)
      if (end == text.size() || (cuts >> (end - 1) & 1) != 0) {
        desk.adapter->receive(text.substr(begin, end - begin));
        begin = end;
      }
    if (desk.said() != "\rz\rF00\r" || desk.ear.heard != Texts{"123#"}) FAIL("cuts " << cuts);
  }
}
