// SPDX-License-Identifier: MIT
// A bus on a real SocketCAN interface. CBCAN_VCAN names a vcan that is up; tests that take an interface down or
// delete it create their own, which needs root.
#include "io/can/outside_bus.hpp"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include "turns.hpp"

namespace cbcan::io {
namespace {

std::string vcan() {
  const char* name = std::getenv("CBCAN_VCAN");
  if (name == nullptr)
    throw std::runtime_error("CBCAN_VCAN names no interface; run this by tools/dev/in-vcan-vm");
  return name;
}

void run(const std::string& command) {
  INFO(command);
  REQUIRE(std::system(command.c_str()) == 0);
}

/// An interface, deleted by the destructor.
struct OwnInterface {
  OwnInterface() { add(); }
  ~OwnInterface() { static_cast<void>(std::system(("ip link del dev " + name() + " 2>/dev/null").c_str())); }
  OwnInterface(const OwnInterface&) = delete;
  OwnInterface& operator=(const OwnInterface&) = delete;

  const std::string& name() const { return name_; }
  void add(const std::string& options = "") {
    run("ip link add dev " + name() + " " + options + " type vcan && ip link set dev " + name() + " up");
  }
  void del() { run("ip link del dev " + name()); }
  void set(const std::string& what) { run("ip link set dev " + name() + " " + what); }

  std::string down_message() const {
    return where() + "the interface is down; `ip link set " + name() + " up` brings it up";
  }
  std::string gone_message() const {
    return where() + "no such interface; `ip link` lists them; for a virtual one: ip link add dev " + name() +
           " type vcan && ip link set " + name() + " up";
  }
  std::string up_message() const { return where() + "the interface is up again"; }

 private:
  std::string where() const { return "can socketcan:" + name() + ": "; }

  std::string name_ = "cbio" + std::to_string(getpid());
};

/// Another program on the same interface.
struct Witness {
  explicit Witness(const std::string& interface)
      : socket_(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    REQUIRE(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }

  void send(std::uint32_t can_id, const std::vector<std::uint8_t>& data = {}) {
    can_frame frame{};
    frame.can_id = can_id;
    frame.can_dlc = static_cast<std::uint8_t>(data.size());
    std::copy(data.begin(), data.end(), frame.data);
    REQUIRE(::write(socket_.get(), &frame, sizeof frame) == sizeof frame);
  }

  /// The identifiers, with their flags, of the frames since the last call.
  std::vector<std::uint32_t> take_ids() {
    std::vector<std::uint32_t> ids;
    while (::read(socket_.get(), &last_, sizeof last_) == sizeof last_)
      ids.push_back(last_.can_id);
    return ids;
  }
  const can_frame& last() const { return last_; }

 private:
  Descriptor socket_;
  can_frame last_{};
};

/// One node on a bus that is connected to the interface.
struct Rig final : sim::Receiver, sim::Observer {
  explicit Rig(const std::string& interface)
      : can(socketcan_bus(reactor, bus, interface,
                          [this](const std::string& line) { warnings.push_back(line); })) {
    port.accept(0, 0x7FF);
    bus.observe(*this);
  }

  void on_frame(const Frame& frame, Time) override { frames.push_back(frame); }
  void on_bus_state(BusState state, Time) override { states.push_back(state); }
  void on_bus_frame(const Frame& frame, Time) override {
    ++observed;
    reports += (frame.flags & Frame::kError) != 0 ? 1 : 0;
  }

  std::size_t turn(Time now = Reactor::now()) {
    can->poll(now);
    bus.advance(now);
    return reactor.poll(0);
  }

  template <typename Done>
  void run_until(Done done) {
    test::turn_until([this] { turn(); }, done);
  }

  /// Turns until the witness has seen `count` frames, which the kernel may deliver later; returns their
  /// identifiers.
  std::vector<std::uint32_t> seen_by(Witness& witness, std::size_t count) {
    std::vector<std::uint32_t> ids;
    run_until([&] {
      const auto more = witness.take_ids();
      ids.insert(ids.end(), more.begin(), more.end());
      return ids.size() >= count;
    });
    return ids;
  }

  Reactor reactor;
  sim::Bus bus;
  std::vector<std::string> warnings;
  std::vector<Frame> frames;
  std::vector<BusState> states;
  std::size_t observed = 0;
  std::size_t reports = 0;
  sim::Port& port = bus.attach(*this);
  std::unique_ptr<OutsideBus> can;
};

TEST_CASE("frames go out as they are, once and in order, and do not come back") {
  Rig rig(vcan());
  Witness witness(vcan());
  CHECK(rig.port.try_send({0x605, 8, 0, {0x40, 0x17, 0x10, 1, 2, 3, 4, 5}}));
  CHECK(rig.port.try_send({0x701, 1, Frame::kRemote, {}}));
  CHECK(rig.port.try_send({0x123, 2, Frame::kExtended, {0xAA, 0x55}}));
  CHECK(rig.seen_by(witness, 3) == std::vector<std::uint32_t>{0x605, 0x40000701, 0x80000123});
  CHECK(witness.last().can_dlc == 2);
  CHECK(witness.last().data[1] == 0x55);
  CHECK(rig.frames.empty());
  CHECK(rig.observed == 3);
  CHECK(rig.warnings.empty());
}

TEST_CASE("frames come in as they are, and reach the observers") {
  Rig rig(vcan());
  Witness witness(vcan());
  witness.send(0x585, {0x4B, 0x17, 0x10, 0, 0xE8, 3, 0, 0});
  witness.send(0x40000701);
  witness.send(0x80000123, {7});
  rig.run_until([&] { return rig.frames.size() == 3; });
  CHECK(rig.frames == std::vector<Frame>{{0x585, 8, 0, {0x4B, 0x17, 0x10, 0, 0xE8, 3, 0, 0}},
                                         {0x701, 0, Frame::kRemote, {}},
                                         {0x123, 1, Frame::kExtended, {7}}});
  CHECK(rig.observed == 3);
}

TEST_CASE("error frames are the state of the bus") {
  Rig rig(vcan());
  Witness controller(vcan());
  const auto report = [&](std::uint32_t error_class, std::uint8_t details) {
    const auto count = rig.reports;
    controller.send(CAN_ERR_FLAG | error_class, {0, details, 0, 0, 0, 0, 0, 0});
    rig.run_until([&] { return rig.reports == count + 1; });
    return rig.port.state();
  };
  CHECK(report(0x004, 0x30) == BusState::kErrorPassive);
  CHECK(report(0x040, 0) == BusState::kBusOff);
  CHECK_FALSE(rig.port.try_send({0x605, 0, 0, {}}));
  CHECK(report(0x100, 0) == BusState::kActive);
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  CHECK(report(0x004, 0x10) == BusState::kErrorPassive);
  CHECK(report(0x004, 0x01) == BusState::kErrorPassive);  // error passive outranks an overflow
  CHECK(report(0x004, 0x40) == BusState::kOverflow);
  const Time shown_until = rig.can->next_deadline();
  CHECK(shown_until > Reactor::now());
  CHECK(shown_until <= Reactor::now() + kOverflowShown);
  rig.turn(shown_until);
  CHECK(rig.port.state() == BusState::kActive);
  CHECK(rig.can->next_deadline() == kNever);
}

TEST_CASE("frames that the kernel had to drop are shown as an overflow, for a while") {
  constexpr std::size_t kFlood = 40'000;
  Rig rig(vcan());
  Witness witness(vcan());
  for (std::size_t i = 0; i < kFlood; ++i)
    witness.send(0x181, {1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(rig.reactor.poll(0) == 1);
  CHECK(rig.frames.size() == 512);  // then the others are served
  while (rig.turn() != 0) {
  }
  witness.send(0x182);  // the kernel reports its count with the next frame
  rig.run_until([&] { return rig.frames.back().id == 0x182; });
  CHECK(rig.observed < kFlood + 1);
  CHECK(rig.port.state() == BusState::kOverflow);
  rig.turn(rig.can->next_deadline());
  CHECK(rig.states == std::vector<BusState>{BusState::kOverflow, BusState::kActive});
}

TEST_CASE("an interface that goes down takes the link with it, and brings it back") {
  OwnInterface interface;
  Rig rig(interface.name());
  CHECK(rig.bus.link());
  interface.set("down");
  rig.run_until([&] { return !rig.bus.link(); });
  CHECK_FALSE(rig.port.try_send({0x605, 0, 0, {}}));
  CHECK(rig.turn() == 0);
  CHECK(rig.can->next_deadline() == kNever);
  interface.set("up");
  rig.run_until([&] { return rig.bus.link(); });
  Witness witness(interface.name());
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  rig.turn();
  CHECK(rig.seen_by(witness, 1) == std::vector<std::uint32_t>{0x605});
  witness.send(0x585);
  rig.run_until([&] { return rig.frames.size() == 1; });
  CHECK(rig.warnings == std::vector<std::string>{interface.down_message(), interface.up_message()});
}

TEST_CASE("a frame that meets an interface down for a moment does not stop the bus, and the loss is seen") {
  OwnInterface interface;
  Rig rig(interface.name());
  interface.set("down");
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  rig.bus.advance(Reactor::now());
  interface.set("up");
  Witness witness(interface.name());
  rig.can->poll(Reactor::now());
  CHECK(rig.bus.link());
  CHECK(rig.warnings == std::vector<std::string>{interface.down_message(), interface.up_message()});
  CHECK(rig.port.try_send({0x606, 0, 0, {}}));
  rig.turn();
  CHECK(rig.seen_by(witness, 1) == std::vector<std::uint32_t>{0x606});
}

TEST_CASE("an interface that is deleted and made again is joined again, whatever its number") {
  const bool same_number = GENERATE(false, true);
  OwnInterface interface;
  const std::string number = std::to_string(if_nametoindex(interface.name().c_str()));
  Rig rig(interface.name());
  interface.del();
  rig.run_until([&] { return !rig.bus.link(); });
  rig.run_until([&] { return rig.warnings.back() == interface.gone_message(); });
  CHECK(rig.turn() == 0);
  interface.add(same_number ? "index " + number : "");
  rig.run_until([&] { return rig.bus.link(); });
  Witness witness(interface.name());
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  witness.send(0x585);
  rig.run_until([&] { return rig.frames.size() == 1; });
  CHECK(rig.seen_by(witness, 1) == std::vector<std::uint32_t>{0x605});
  CHECK(rig.warnings.back() == interface.up_message());
}

TEST_CASE("an interface that is down at the start gets a warning and is used once it is up") {
  OwnInterface interface;
  interface.set("down");
  Rig rig(interface.name());
  CHECK_FALSE(rig.bus.link());
  CHECK(rig.warnings == std::vector<std::string>{interface.down_message()});
  rig.turn();
  CHECK(rig.turn() == 0);
  interface.set("up");
  rig.run_until([&] { return rig.bus.link(); });
  Witness witness(interface.name());
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  rig.turn();
  CHECK(rig.seen_by(witness, 1) == std::vector<std::uint32_t>{0x605});
}

TEST_CASE("a frame for which the interface has no room is kept and tried again") {
  OwnInterface interface;
  Rig rig(interface.name());
  Witness witness(interface.name());
  run("tc qdisc replace dev " + interface.name() + " root pfifo limit 0");
  CHECK(rig.port.try_send({0x605, 0, 0, {}}));
  CHECK(rig.port.try_send({0x606, 0, 0, {}}));
  rig.turn();
  CHECK(rig.port.queued() == 2);
  CHECK(rig.bus.next_deadline() == kNever);
  CHECK(rig.can->next_deadline() != kNever);
  CHECK(rig.can->next_deadline() <= Reactor::now() + kFrameRetry);
  CHECK(witness.take_ids().empty());
  run("tc qdisc del dev " + interface.name() + " root");
  rig.turn(rig.can->next_deadline());
  CHECK(rig.seen_by(witness, 2) == std::vector<std::uint32_t>{0x605, 0x606});
  rig.turn(rig.can->next_deadline());
  CHECK(rig.can->next_deadline() == kNever);
}

TEST_CASE("an interface that is not CAN is reported") {
  Reactor reactor;
  sim::Bus bus;
  CHECK_THROWS_WITH(socketcan_bus(reactor, bus, "lo", nullptr),
                    "can socketcan:lo: not a CAN interface (No such device); `ip link show type can` and "
                    "`ip link show type vcan` list those");
}

TEST_CASE("the bus is alone again when the interface is left, also when it was waiting for room") {
  struct Nobody final : sim::Receiver {};
  Nobody nobody;
  OwnInterface interface;
  Witness witness(interface.name());
  Reactor reactor;
  sim::Bus bus;
  sim::Port& port = bus.attach(nobody);
  {
    const auto can = socketcan_bus(reactor, bus, interface.name(), nullptr);
    run("tc qdisc replace dev " + interface.name() + " root pfifo limit 0");
    CHECK(port.try_send({0x605, 0, 0, {}}));
    bus.advance(0);
    CHECK(port.queued() == 1);
  }
  run("tc qdisc del dev " + interface.name() + " root");
  bus.advance(0);
  CHECK(port.queued() == 0);
  CHECK(witness.take_ids().empty());
}

}  // namespace
}  // namespace cbcan::io
