// SPDX-License-Identifier: MIT
// The bus suite with a real interface in the middle. CBCAN_VCAN names a vcan that is up; cutting it needs root.

#include "io/can/outside_bus.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sched.h>
#include <sys/socket.h>

#include "io/loop/reactor.hpp"
#include "sim/bus_suite.hpp"

namespace {

using cbcan::Time;
using cbcan::io::Reactor;
using namespace cbcan::test;

std::string vcan() {
  const char* name = std::getenv("CBCAN_VCAN");
  if (name == nullptr)
    throw std::runtime_error("CBCAN_VCAN names no interface; run this by tools/dev/in-vcan-vm");
  return name;
}

/// Sends error frames of a kind that no other socket receives, and waits for its own: on one processor the kernel
/// delivers frames in the order in which they were sent, but not always within the sender's system call.
class Marker {
 public:
  Marker() : socket_(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW)) {
    cpu_set_t first;
    CPU_ZERO(&first);
    CPU_SET(0, &first);
    REQUIRE(sched_setaffinity(0, sizeof first, &first) == 0);
    const int on = 1;
    const can_err_mask_t kind = CAN_ERR_PROT;
    setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &on, sizeof on);
    setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0);
    setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &kind, sizeof kind);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(vcan().c_str()));
    REQUIRE(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }

  /// Returns when every frame that was sent before has been delivered; at once if the interface is down.
  void pass() {
    can_frame frame{};
    frame.can_id = CAN_ERR_FLAG | CAN_ERR_PROT;
    frame.can_dlc = CAN_ERR_DLC;
    if (::write(socket_.get(), &frame, sizeof frame) == sizeof frame)
      static_cast<void>(!::read(socket_.get(), &frame, sizeof frame));
  }

 private:
  cbcan::io::Descriptor socket_;
};

/// Two buses that are connected to the same interface.
class VcanWire {
  struct Side {
    explicit Side(Reactor& reactor)
        : can(cbcan::io::socketcan_bus(reactor, bus, vcan(),
                                       [](const std::string& line) { UNSCOPED_INFO(line); })) {}
    cbcan::sim::Bus bus;
    std::unique_ptr<cbcan::io::OutsideBus> can;
  };

  Marker marker_;
  Reactor reactor_;
  Side left_side_{reactor_}, right_side_{reactor_};

 public:
  cbcan::test::WireEnd left{left_side_.bus}, right{right_side_.bus};

  ~VcanWire() { mend(); }

  /// Ends when a turn has done nothing.
  void settle() {
    do {
      const Time now = Reactor::now();
      for (Side* side : {&left_side_, &right_side_}) {
        side->can->poll(now);
        side->bus.advance(now);
      }
      marker_.pass();
    } while (reactor_.poll(0) != 0 || left.port.queued() != 0 || right.port.queued() != 0);
  }
  void cut() { set("down"); }
  void mend() { set("up"); }

 private:
  void set(const std::string& what) {
    const std::string command = "ip link set dev " + vcan() + " " + what;
    if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
    settle();
  }
};

}  // namespace

TEST_CASE("vcan: every kind of frame, to everybody but its sender") {
  cbcan::test::check_every_kind_of_frame<VcanWire>();
}
TEST_CASE("vcan: both ways") {
  cbcan::test::check_both_ways<VcanWire>();
}
TEST_CASE("vcan: a burst larger than the queue loses nothing") {
  cbcan::test::check_burst_without_loss<VcanWire>();
}
TEST_CASE("vcan: a cut cable loses frames and delivers none of them late") {
  cbcan::test::check_cut_cable<VcanWire>();
}
