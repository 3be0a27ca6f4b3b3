// SPDX-License-Identifier: MIT
// The module as the client of PLCs that own their registers: libmodbus's server behaving like OpenPLC's, like
// CODESYS's, and like one that is slow, disconnected and restarted. Each request is one transfer, each result comes
// from the node.
#include <fcntl.h>
#include <modbus.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include "io/modbus/plc_client.hpp"
#include "plc_rig.hpp"
#include "window/connection.hpp"

using namespace cbcan;
using namespace cbcan::io;
using namespace cbcan::io::test;

namespace {

bool readable(int descriptor) {
  pollfd look{descriptor, POLLIN, 0};
  return ::poll(&look, 1, 0) == 1;
}

/// libmodbus's server, called only when it does not have to wait.
struct LibmodbusServer {
  LibmodbusServer(unsigned first, int count)
      : context_(modbus_new_tcp("127.0.0.1", 0), modbus_free),
        mapping_(modbus_mapping_new_start_address(0, 0, 0, 0, first, static_cast<unsigned>(count), 0, 0),
                 modbus_mapping_free),
        listener_(modbus_tcp_listen(context_.get(), 4)) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    REQUIRE(getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size) == 0);
    port = ntohs(address.sin_port);
  }

  std::span<std::uint16_t> registers() {
    return {mapping_->tab_registers, static_cast<std::size_t>(mapping_->nb_registers)};
  }

  /// Receives one request, if there is one; true = respond() is to be called.
  bool receive() {
    if (readable(listener_.get())) {
      int socket = listener_.get();
      client_ = Descriptor(modbus_tcp_accept(context_.get(), &socket));
    }
    if (!client_ || !readable(client_.get())) return false;
    modbus_set_socket(context_.get(), client_.get());
    size_ = modbus_receive(context_.get(), request_.data());
    if (size_ < 0) client_.reset();
    return size_ > 0;
  }
  void respond() { modbus_reply(context_.get(), request_.data(), size_, mapping_.get()); }
  void refuse() {
    modbus_reply_exception(context_.get(), request_.data(), MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
  }
  void cut() { client_.reset(); }
  bool connected() const { return static_cast<bool>(client_); }

  std::uint16_t port = 0;

 private:
  std::unique_ptr<modbus_t, void (*)(modbus_t*)> context_;
  std::unique_ptr<modbus_mapping_t, void (*)(modbus_mapping_t*)> mapping_;
  Descriptor listener_;
  Descriptor client_;
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request_{};
  int size_ = 0;
};

/// How a PLC serves Modbus between the scans of its program.
struct Kind {
  const char* name;
  std::uint16_t first;  ///< register of R3700
  Time scan;            ///< its cycle
  bool at_once;         ///< requests are served as they arrive; otherwise one in each scan
  bool bad;             ///< slow, disconnected, restarted, busy
};
constexpr Kind kKinds[] = {
    {"OpenPLC: %MW from 1024 on, a thread that serves whenever a request comes", 1024, 20 * kMillisecond,
     true, false},
    {"CODESYS: from 0 on, one request in each cycle of the task", 0, 10 * kMillisecond, false, false},
    {"slow, cut off, started anew", 3700, 30 * kMillisecond, false, true},
};

struct Plant {
  Plant(const Kind& kind, bool scanner)
      : kind_(kind),
        server_(kind.first, kPlcWords),
        program(make_program(scanner, server_.registers(), module.node, polls_, kind.bad ? 150 : 1'000'000)),
        random_(1) {
    PlcClient::Exchanges exchanges;
    exchanges.push_back(make_exchange(scanner, unit_, kind.first));
    client_.emplace(reactor_, unit_, plc_over_tcp({"127.0.0.1", server_.port}), std::move(exchanges),
                    PlcSettings{}, [this](const std::string& line) { told.push_back(line); });
  }

  /// One scan of the PLC.
  void scan() {
    const Time end = module.now + kind_.scan;
    if (kind_.bad) misbehave();
    do {
      client_->poll(module.now);
      for (bool more = serve(); more && kind_.at_once; more = serve())
        turn();
      turn();
      module.run(std::min(end, std::max(module.now + 1, client_->next_deadline())) - module.now);
    } while (module.now < end);
    polls_ = static_cast<unsigned>(client_->counters().requests / 3);  // a lower bound
    served_ = false;
    program->scan();
  }

  ScannedModule module{1000};
  std::vector<std::string> told;

 private:
  void turn() {
    reactor_.poll(0);
    client_->poll(module.now);
  }

  bool serve() {
    if (!waiting_) waiting_ = server_.receive();
    if (!waiting_ || module.now < late_until_ || (!kind_.at_once && served_)) return false;
    waiting_ = false;
    served_ = true;
    kind_.bad&& pick(50) == 0 ? server_.refuse() : server_.respond();
    return true;
  }

  /// Its responses arrive within the time-out of a second.
  void misbehave() {
    const unsigned dice = pick(1000);
    if (dice < 40) late_until_ = module.now + pick(300) * kMillisecond;
    if (dice < 960) return;
    waiting_ = false;
    server_.cut();
    if (dice > 980) program->restart(dice > 990);
  }

  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }

  Kind kind_;
  LibmodbusServer server_;
  ModuleUnit unit_{module};
  Reactor reactor_;
  std::optional<PlcClient> client_;
  unsigned polls_ = 0;
  bool waiting_ = false;  ///< a request waits for its response
  bool served_ = false;   ///< a request was served in this scan
  Time late_until_ = 0;

 public:
  std::unique_ptr<PlcProgram> program;

 private:
  std::mt19937 random_;
};

void check_requests(unsigned requests) {
  for (const Kind& kind : kKinds) {
    for (const bool scanner : {false, true}) {
      for (const Time delay : {Time{0}, 120 * kMillisecond}) {
        INFO(kind.name << (scanner ? ", scanner layout" : "") << ", node of " << delay / kMillisecond
                       << " ms");
        Plant plant(kind, scanner);
        plant.module.node_delay = delay;
        while (plant.program->ended() < requests)
          plant.scan();
        plant.program->check();
        CHECK(plant.told.empty() == !kind.bad);
        if (!kind.bad) CHECK(plant.module.node.transfers - requests + (scanner ? 1 : 0) <= 1);
      }
    }
  }
}

}  // namespace

TEST_CASE("PLCs that own their registers: one transfer for each request, each result the node's own") {
  check_requests(250);
}

TEST_CASE("a PLC that is not there is tried again, with a pause that grows to five seconds, and told once") {
  std::uint16_t port = LibmodbusServer(0, 1).port;
  Reactor reactor;
  ScannedModule module{1000};
  ModuleUnit unit(module);
  std::vector<std::string> told;
  PlcClient client(reactor, unit, plc_over_tcp({"localhost", port}), {}, {},
                   [&](const std::string& line) { told.push_back(line); });
  Time now = 0;
  for (const Time pause : {100u, 200u, 400u, 800u, 1600u, 3200u, 5000u, 5000u}) {
    client.poll(now);
    CHECK(client.next_deadline() - now == pause * kMillisecond);
    now = client.next_deadline();
  }
  CHECK(told == std::vector<std::string>{"plc " + client.place() + ": Connection refused; it is retried"});
}

TEST_CASE("an unknown name of a PLC") {
  CHECK_THROWS_WITH(plc_over_tcp({"no name at all", 502}),
                    "plc no name at all:502: Name or service not known; write an IP address");
}

TEST_CASE("PLCs that own their registers, 100,000 requests each", "[.long]") {
  check_requests(100'000);
}
