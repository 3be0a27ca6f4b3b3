// SPDX-License-Identifier: MIT
// The LSS slave as an LSS master sees it. Frames are those of CiA 305: requests have CAN-ID 7E5h, responses
// 7E4h, both eight bytes; zeros at their end are left out here. Reserved bytes are not 0 in some requests, as
// in switch state selective of CANopenNode's master.

#include "support/bench.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr std::uint8_t kNone = LssSlave::kNoNodeId, kNotStarted = 0;
constexpr const char* kSilence = "";
constexpr const char *kConfiguration = "0401", *kWaiting = "04";

using Identity = std::array<std::uint32_t, 4>;
using Log = std::vector<std::string>;
using Requests = std::vector<std::string>;

struct Exchange {
  std::string request, response;
};

/// A device with an LSS slave; logs the calls of its functions, with the time.
struct LssDevice final : StackRig<LssSlave>, private LssApplication {
  explicit LssDevice(std::uint8_t node_id,
                     const Identity& address = {0x319, 0x04030201, 0x00010002, 0x12345678})
      : StackRig(slave), address_(address), slave(*this, port) {
    if (node_id != kNotStarted) slave.start(node_id, 4, now);
  }

  /// Its response.
  std::string hear(const std::string& request) {
    slave.on_frame(frame_from("7E5#" + request + std::string(16 - request.size(), '0')), now);
    std::string said;
    for (const std::string& frame : port.sent)
      said += frame;
    port.sent.clear();
    return said;
  }
  void ask(const std::vector<Exchange>& exchanges) {
    for (const auto& [request, response] : exchanges) {
      INFO("after " << request);
      const std::string zeros(16 - response.size(), '0');
      CHECK(hear(request) == (response.empty() ? "" : "7E4#" + response + zeros));
    }
  }
  void ask_in_vain(const Requests& requests) {
    for (const std::string& request : requests)
      ask({{request, kSilence}});
  }

 private:
  std::uint32_t identity(std::uint8_t part) const override { return address_.at(part); }
  bool is_bit_rate_supported(std::uint8_t index) const override { return bit_rates && index != 1; }
  void set_on_bus(bool on, Time at) override { note(on ? "on" : "off", at); }
  void activate_bit_rate(std::uint8_t index, Time at) override { note("rate " + std::to_string(index), at); }
  StoreResult store(std::uint8_t node_id, std::uint8_t bit_rate) override {
    note("store " + std::to_string(node_id) + " " + std::to_string(bit_rate), now);
    return storage;
  }
  void on_node_id(std::uint8_t node_id, Time at) override {
    note("node " + std::to_string(node_id), at);
    CHECK(slave.reset_communication(at) == node_id);  // the NMT initialisation that follows
  }
  void note(const std::string& what, Time at) { log.push_back(std::to_string(at) + " " + what); }

  Identity address_;

 public:
  bool bit_rates = true;
  StoreResult storage = StoreResult::kStored;
  Log log;
  LssSlave slave;
};

/// The requests of the configuration state, and the responses of node 5 with the identity above.
const std::vector<Exchange> kConfigurationServices{
    {"110A", "11"},       {"130002", "13"},     {"17", "17"},         {"5A", "5A1903"},
    {"5B", "5B01020304"}, {"5C", "5C02000100"}, {"5D", "5D78563412"}, {"5E", "5E05"}};

/// A sequence of requests that is only complete with all of them.
const Requests kSelect{"401903", "4101020304", "4202000100", "4378563412"};
const Requests kIdentify{"461903", "4701020304", "48", "49FFFFFFFF", "4A", "4BFFFFFFFF"};

/// The device does not respond if one of them is missing, or has another number, or (except the first)
/// follows one with another number.
void check_incomplete(LssDevice& device, const Requests& run, const std::string& wrong_byte,
                      std::size_t compared) {
  for (std::size_t at = 0; at < run.size(); ++at) {
    const auto place = static_cast<std::ptrdiff_t>(at);
    Requests requests = run;
    if (at < compared) {
      if (at != 0) requests.insert(requests.begin() + place, run[at]);
      requests[at].replace(2, 2, wrong_byte);
      device.ask_in_vain(requests);
      requests = run;
    }
    requests.erase(requests.begin() + place);
    device.ask_in_vain(requests);
  }
}

}  // namespace

TEST_CASE("LSS: configuration services answer in the configuration state and are silent in the other") {
  LssDevice device(5);
  const auto ask_in_vain = [&] {
    for (const Exchange& service : kConfigurationServices)
      device.ask_in_vain({service.request});
  };
  ask_in_vain();
  device.ask_in_vain({"1510"});
  CHECK(device.slave.pending_node_id() == 5);
  CHECK(device.log.empty());
  device.ask_in_vain({kConfiguration});
  device.ask(kConfigurationServices);
  device.ask_in_vain({kWaiting});
  ask_in_vain();
}

TEST_CASE("LSS: a slave that has not been started hears nothing") {
  LssDevice device(kNotStarted);
  device.ask_in_vain({"4C"});
  CHECK(device.slave.deadline() == kNever);
}

TEST_CASE("LSS: frames that are no requests are ignored; so are unknown specifiers and modes") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration});
  for (const char* frame :
       {"7E5#5E", "7E5#5E000000000000", "7E5#R8", "000007E5#5E00000000000000", "7E4#5E00000000000000"}) {
    device.slave.on_frame(frame_from(frame), 0);
    CHECK(device.port.sent.empty());
  }
  device.ask_in_vain({"00", "5F", "44", "4D", "FF", "0402"});
  device.ask({{"5E", "5E05"}});
}

TEST_CASE("LSS: switch state selective needs all four numbers, in order; rubbish may follow them") {
  LssDevice device(5);
  check_incomplete(device, kSelect, "FF", 4);
  device.ask_in_vain({kSelect[0], kSelect[2], kSelect[1], kSelect[3], kSelect[0], kSelect[1], kSelect[2]});
  device.ask_in_vain({kWaiting, kSelect[3]});  // begins again
  device.ask_in_vain({kSelect[0], "4019030000AABBCC", "4101020304AABBCC", "4202000100AABBCC"});
  device.ask({{"4378563412AABBCC", "44"}, {"5E", "5E05"}});
  device.ask_in_vain(kSelect);  // not in the configuration state
}

TEST_CASE("LSS: configure node-ID takes 1..127 and 255") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration});
  device.ask({{"1101", "11"}, {"117F", "11"}, {"11FF", "11"}, {"1111", "11"}});
  device.ask({{"1100", "1101"}, {"1180", "1101"}, {"11FE", "1101"}});
  CHECK(device.slave.pending_node_id() == 0x11);
  CHECK(device.slave.node_id() == 5);
}

TEST_CASE("LSS: a device that has a node ID changes it with the next reset of the communication") {
  LssDevice device(5);
  device.ask({{kConfiguration, kSilence}, {"110A", "11"}, {"5E", "5E05"}, {kWaiting, kSilence}});
  CHECK(device.log.empty());
  CHECK(device.slave.node_id() == 5);
  device.ask_in_vain({kConfiguration});
  CHECK(device.slave.reset_communication(device.now) == 10);
  CHECK(device.slave.node_id() == 10);
  device.ask_in_vain({"5E"});  // the reset has led to the waiting state
  device.ask({{kConfiguration, kSilence}, {"11FF", "11"}, {kWaiting, kSilence}, {"4C", kSilence}});
  CHECK(device.slave.reset_communication(device.now) == kNone);
  device.ask({{"4C", "50"}});
  device.slave.start(5, 4, device.now);
  CHECK(device.slave.node_id() == 5);
  CHECK(device.slave.pending_node_id() == 5);
}

TEST_CASE("LSS: a device without a node ID is asked for, and gets one when it is switched back to waiting") {
  LssDevice device(kNone);
  device.now = 7;
  device.ask({{"4C", "50"}, {kWaiting, kSilence}, {"4C", "50"}, {kConfiguration, kSilence}, {"4C", "50"}});
  CHECK(device.log.empty());
  device.ask({{"5E", "5EFF"}, {"1142", "11"}, {"5E", "5E42"}, {"4C", kSilence}});
  CHECK(device.slave.node_id() == kNone);
  device.ask_in_vain({kWaiting, kWaiting});
  CHECK(device.log == Log{"7 node 66"});
  CHECK(device.slave.node_id() == 0x42);
  device.ask_in_vain({"4C"});
}

TEST_CASE("LSS: a device that reacts to nothing gets its node ID, and is silent while others switch") {
  struct Plain final : LssApplication {
    std::uint32_t identity(std::uint8_t) const override { return 1; }
    bool is_bit_rate_supported(std::uint8_t) const override { return true; }
    StoreResult store(std::uint8_t, std::uint8_t) override { return StoreResult::kNoStorage; }
  } application;
  RecordingPort port;
  LssSlave slave(application, port);
  slave.start(kNone, 4, 0);
  const auto hear = [&](const char* frame) { slave.on_frame(frame_from(frame), 0); };
  for (const char* request : {"7E5#0401000000000000", "7E5#1142000000000000", "7E5#0400000000000000"})
    hear(request);
  CHECK(slave.node_id() == 0x42);
  for (const char* request : {"7E5#0401000000000000", "7E5#150A000000000000", "7E5#5E00000000000000"})
    hear(request);
  slave.poll(20 * kMillisecond);
  hear("7E5#5E00000000000000");
  CHECK(port.sent == std::deque<std::string>{"7E4#1100000000000000", "7E4#5E42000000000000"});
}

TEST_CASE("LSS: configure bit timing") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration});
  for (const char* good : {"0000", "0002", "0003", "0004", "0006", "0007", "0008", "0009"})
    device.ask({{std::string("13") + good, "13"}});
  for (const char* bad : {"0001", "0005", "000A", "00FF", "0100", "8000"})
    device.ask({{std::string("13") + bad, "1301"}});
  device.ask({{"17", "17"}});
  CHECK(device.log == Log{"0 store 5 9"});
  device.bit_rates = false;
  device.ask({{"13", "1301"}});
}

TEST_CASE("LSS: activate bit timing: off the bus for twice the delay, switched half-way") {
  LssDevice device(5);
  device.now = 1000;
  device.ask({{kConfiguration, kSilence}, {"130003", "13"}, {"152C01", kSilence}});  // 300 ms
  CHECK(device.log == Log{"1000 off"});
  CHECK(device.slave.deadline() == 301'000);
  device.pass(300 * kMillisecond);
  device.ask_in_vain({"5E"});
  device.pass(300 * kMillisecond - 1);
  CHECK(device.log == Log{"1000 off", "301000 rate 3"});
  device.ask_in_vain({"5E"});
  device.pass(1);
  CHECK(device.log == Log{"1000 off", "301000 rate 3", "601000 on"});
  CHECK(device.slave.deadline() == kNever);
  device.ask({{"5E", "5E05"}});  // still in the configuration state
}

TEST_CASE("LSS: activate bit timing at once, with no new rate, and on a device that cannot") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration, "15"});
  CHECK(device.log == Log{"0 off", "0 rate 4", "0 on"});
  device.ask({{"5E", "5E05"}});
  device.bit_rates = false;
  device.ask_in_vain({"15"});
  CHECK(device.log.size() == 3);
}

TEST_CASE("LSS: a reset while the bit rate is being switched puts the device back on the bus") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration, "15FFFF"});
  CHECK(device.slave.deadline() == 65'535 * kMillisecond);
  device.now = 9;
  device.slave.start(5, 4, device.now);
  CHECK(device.log == Log{"0 off", "9 on"});
  CHECK(device.slave.deadline() == kNever);
}

TEST_CASE("LSS: store configuration stores what is pending; both errors") {
  LssDevice device(5);
  device.ask({{kConfiguration, kSilence}, {"110A", "11"}, {"130002", "13"}, {"17", "17"}});
  CHECK(device.log == Log{"0 store 10 2"});
  device.storage = LssApplication::StoreResult::kNoStorage;
  device.ask({{"17", "1701"}});
  device.storage = LssApplication::StoreResult::kAccessError;
  device.ask({{"17", "1702"}});
}

TEST_CASE("LSS: identify remote slave, in both states, up to the ends of the ranges") {
  struct Range {
    const char *revision_low, *revision_high, *serial_low, *serial_high, *response;
  };
  LssDevice device(5);
  check_incomplete(device, kIdentify, "00", 2);
  for (const char* state : {kWaiting, kConfiguration}) {
    device.ask_in_vain({state});
    for (const Range& range : {Range{"4800", "49FFFFFFFF", "4A00", "4BFFFFFFFF", "4F"},
                               Range{"4802000100", "4902000100", "4A78563412", "4B78563412", "4F"},
                               Range{"4803000100", "49FFFFFFFF", "4A00", "4BFFFFFFFF", kSilence},
                               Range{"4800", "4901000100", "4A00", "4BFFFFFFFF", kSilence},
                               Range{"4800", "49FFFFFFFF", "4A79563412", "4BFFFFFFFF", kSilence},
                               Range{"4800", "49FFFFFFFF", "4A00", "4B77563412", kSilence}}) {
      device.ask_in_vain(
          {kIdentify[0], kIdentify[1], range.revision_low, range.revision_high, range.serial_low});
      device.ask({{range.serial_high, range.response}});
    }
  }
  device.ask({{"5E", "5E05"}});
}

TEST_CASE("LSS: a response that the port refuses is sent when there is room, once") {
  LssDevice device(5);
  device.ask_in_vain({kConfiguration});
  device.port.refuse_next = 2;
  device.ask_in_vain({"5E"});
  CHECK(device.slave.deadline() == 100);
  device.pass(kMillisecond);
  device.expect("7E4#5E05000000000000");
  CHECK(device.port.tries == 3);
  CHECK(device.slave.deadline() == kNever);
}

TEST_CASE("LSS: a response that has not left when the next request comes is dropped; a reset drops it too") {
  LssDevice device(5);
  const auto be_refused = [&] {
    device.ask_in_vain({kConfiguration});
    device.port.refuse_next = 1;
    device.ask_in_vain({"5E"});
  };
  be_refused();
  device.ask({{"5A", "5A1903"}});
  be_refused();
  device.ask_in_vain({kWaiting});
  device.pass(kMillisecond);
  be_refused();
  device.slave.reset_communication(device.now);
  device.pass(kMillisecond);
  CHECK(device.port.sent.empty());
}

// ---- Fastscan: how an LSS master finds devices without a node ID

TEST_CASE("LSS: fastscan with parts that the master knows or leaves out") {
  LssDevice device(kNone);
  device.ask({{"510000000080", "4F"},
              {"51000000001F", "4F"},  // its highest bit
              {"511903", "4F"},        // the whole number, and once more
              {"5E", kSilence},
              {"5119030000000003", "4F"},      // vendor known, then the serial number
              {"5101020304000102", kSilence},  // not the current part
              {"5179563412000300", kSilence},  // one bit wrong
              {"5179563412010303", "4F"},      // not checked
              {"5179563412010300", "4F"},      // back to part 0, but the part is not complete
              {"5E", kSilence},
              {"5119030000000003", "4F"},
              {"5178563412000300", "4F"},
              {"5E", "5EFF"},
              {"510000000080", kSilence}});  // not in the configuration state
}

TEST_CASE("LSS: fastscan: invalid requests, and requests that restart it") {
  LssDevice device(kNone);
  device.ask({{"510000000080", "4F"}});
  device.ask_in_vain({"5119030000200001", "51190300007F0001", "5119030000810001", "5119030000000004",
                      "5119030000000400", "5119030000000101"});
  device.ask({{"5119030000000001", "4F"}, {"5119030000000001", kSilence}});
  SECTION("the master") {
    device.ask({{"510000000080", "4F"}, {"5119030000000001", "4F"}});
  }
  SECTION("the waiting state") {
    device.ask({{kWaiting, kSilence}, {"5119030000000001", "4F"}});
  }
  SECTION("a node ID ends it") {
    device.ask(
        {{kConfiguration, kSilence}, {"1142", "11"}, {kWaiting, kSilence}, {"510000000080", kSilence}});
  }
}
