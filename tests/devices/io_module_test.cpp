// SPDX-License-Identifier: MIT
// The digital half of the CiA 401 I/O module, and functions common to both halves.
#include "devices/io_module.hpp"

#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

using nmt::State;
using sim::NetworkFailure;

using Module = Rig<devices::IoModule>;

}  // namespace

TEST_CASE("an input's levels show in 6000h, and every change is an event") {
  Module module(demo_image("io_module.eds"));
  module.shows(0x6000, 1, 0x00);
  module.input(0x6000, 1, 0x81).expect("changed 6000:01").shows(0x6000, 1, 0x81);
  module.input(0x6000, 1, 0x81);  // nothing new
  module.input(0x6000, 1, 0x80).expect("changed 6000:01");
  CHECK(module.deadline == kNever);
}

TEST_CASE("what is given to digital inputs is rounded into a byte") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6005, 0, 0);
  module.input(0x6000, 1, 3.5).shows(0x6000, 1, 4);
  module.input(0x6000, 1, 300).shows(0x6000, 1, 255);
  module.input(0x6000, 1, -1).shows(0x6000, 1, 0);
  module.input(0x6000, 1, 7);
  module.input(0x6000, 1, std::nan("")).shows(0x6000, 1, 0);
}

TEST_CASE("only inputs that there are take a value") {
  Module module(demo_image("io_module.eds"));
  for (const auto sub : std::initializer_list<std::uint8_t>{0, 2, 255})
    CHECK_FALSE(module.device.set_input(0x6000, sub, 1, module.now));
  CHECK_FALSE(module.device.set_input(0x6401, 3, 1, module.now));
  CHECK_FALSE(module.device.set_input(0x6200, 1, 1, module.now));
  CHECK_FALSE(module.device.set_input(0x6411, 1, 1, module.now));
}

TEST_CASE("6002h turns inputs round") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6002, 1, 0x0F).expect("changed 6000:01").shows(0x6000, 1, 0x0F);
  module.input(0x6000, 1, 0x11).expect("changed 6000:01").shows(0x6000, 1, 0x1E);
}

TEST_CASE("6003h: a filtered input has to stand for 3 ms") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6003, 1, 0x01);
  module.input(0x6000, 1, 0x03);  // bit 1 is not filtered
  module.shows(0x6000, 1, 0x02);
  module.expect("changed 6000:01");
  CHECK(module.deadline == 4000);
  module.pass(2999).shows(0x6000, 1, 0x02);
  module.pass(1).expect("changed 6000:01").shows(0x6000, 1, 0x03);

  module.input(0x6000, 1, 0x02);  // too short
  module.pass(2000);
  module.input(0x6000, 1, 0x03);
  module.pass(10000).shows(0x6000, 1, 0x03);

  module.input(0x6000, 1, 0x02);  // bounces: the filter time counts from the last edge
  module.pass(2000);
  module.input(0x6000, 1, 0x03);
  module.pass(1000);
  module.input(0x6000, 1, 0x02);
  module.pass(2999).shows(0x6000, 1, 0x03);
  module.pass(1).expect("changed 6000:01").shows(0x6000, 1, 0x02);
}

TEST_CASE("6003h: each input has a time of its own") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6003, 1, 0x03);
  module.input(0x6000, 1, 0x01);
  module.pass(2000);
  module.input(0x6000, 1, 0x03);
  module.pass(1000).expect("changed 6000:01").shows(0x6000, 1, 0x01);
  module.pass(2000).expect("changed 6000:01").shows(0x6000, 1, 0x03);
}

TEST_CASE("6005h turns digital events off, not the inputs") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6005, 0, 0);
  module.input(0x6000, 1, 0xFF).shows(0x6000, 1, 0xFF);
  module.write(0x6005, 0, 1);  // the missed event is not sent later
  module.input(0x6000, 1, 0xFE).expect("changed 6000:01");
}

TEST_CASE("6006h, 6007h and 6008h choose the edges") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6006, 1, 0x01);
  module.write(0x6007, 1, 0x02);
  module.write(0x6008, 1, 0x04);
  module.input(0x6000, 1, 0x01).expect("changed 6000:01");
  module.input(0x6000, 1, 0x00).expect("changed 6000:01");
  module.input(0x6000, 1, 0x02).expect("changed 6000:01");
  module.input(0x6000, 1, 0x00);
  module.input(0x6000, 1, 0x04);
  module.expect_nothing();
  module.input(0x6000, 1, 0x00).expect("changed 6000:01");
  module.input(0x6000, 1, 0x08);
  module.input(0x6000, 1, 0x00);
  module.expect_nothing();
}

TEST_CASE("outputs follow 6200h through polarity and filter mask") {
  Module module(demo_image("io_module.eds"));
  module.puts_out(0x6200, 1, 0x00);
  module.write(0x6200, 1, 0xA5).puts_out(0x6200, 1, 0xA5);
  module.write(0x6202, 1, 0x0F).puts_out(0x6200, 1, 0xAA);
  module.write(0x6208, 1, 0xF0);  // the lower four stay
  module.write(0x6200, 1, 0x5A).puts_out(0x6200, 1, 0x5A).shows(0x6200, 1, 0x5A);
  module.write(0x6208, 1, 0xFF).puts_out(0x6200, 1, 0x55);
  CHECK(module.device.output(0x6200, 0) == std::nullopt);
  CHECK(module.device.output(0x6200, 2) == std::nullopt);
}

TEST_CASE("a network failure gives outputs their error values until the node is started again") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6206, 1, 0xF0);
  module.write(0x6207, 1, 0x3C);
  module.write(0x6200, 1, 0xC9);
  module.state(State::kOperational).puts_out(0x6200, 1, 0xC9);
  for (const auto failure :
       {NetworkFailure::kHeartbeat, NetworkFailure::kGuarding, NetworkFailure::kBusOff}) {
    module.network_failure(failure);
    module.puts_out(0x6200, 1, 0x39);
    module.state(State::kPreOperational).puts_out(0x6200, 1, 0x39).shows(0x6200, 1, 0xC9);
    module.state(State::kOperational).puts_out(0x6200, 1, 0xC9);
  }
}

TEST_CASE("NMT Stopped gives outputs their error values, Pre-operational does not") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6200, 1, 0xFF);
  module.state(State::kOperational);
  module.state(State::kPreOperational).puts_out(0x6200, 1, 0xFF);
  module.state(State::kStopped).puts_out(0x6200, 1, 0x00);
  module.state(State::kOperational).puts_out(0x6200, 1, 0xFF);
}

TEST_CASE("an error value goes through polarity and filter mask like a written one") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6200, 1, 0xFF);
  module.write(0x6202, 1, 0x0F);
  module.write(0x6208, 1, 0x3F);  // the upper two stay
  module.state(State::kStopped).puts_out(0x6200, 1, 0xCF);
}

TEST_CASE("reset node: outputs as at power-on, inputs as they are, without an event") {
  Module module(demo_image("io_module.eds"));
  module.input(0x6000, 1, 0x12).expect("changed 6000:01");
  module.write(0x6200, 1, 0xFF);
  module.write(0x6208, 1, 0x0F);
  module.state(State::kStopped);
  module.reset(true).shows(0x6000, 1, 0x12).puts_out(0x6200, 1, 0x00);
  module.write(0x6207, 1, 0xFF).puts_out(0x6200, 1, 0x00);  // the failure has ended
}

TEST_CASE("reset node switches outputs off that are masked from power-on") {
  Module module(demo_image("io_module.eds"), {{0x6208, 1, 0x0F}});
  module.write(0x6208, 1, 0xFF);
  module.write(0x6200, 1, 0xFF).puts_out(0x6200, 1, 0xFF);
  module.reset(true).puts_out(0x6200, 1, 0x00);
}

TEST_CASE("reset communication leaves the outputs be") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6200, 1, 0x77);
  module.write(0x6208, 1, 0x00);
  module.reset(false).puts_out(0x6200, 1, 0x77);
  module.write(0x6207, 1, 0x11);
  module.write(0x6208, 1, 0xFF);
  module.state(State::kStopped).puts_out(0x6200, 1, 0x11);
  module.reset(false).puts_out(0x6200, 1, 0x11);
}

TEST_CASE("values that the plant file gives to inputs are the values at the terminals") {
  Module module(demo_image("io_module.eds"), {{0x6000, 1, 0x0C}, {0x6002, 1, 0xFF}, {0x6401, 2, 55}});
  module.shows(0x6000, 1, 0x0C);
  module.shows(0x6401, 2, 55);
  module.write(0x6002, 1, 0x00).expect("changed 6000:01").shows(0x6000, 1, 0xF3);
}

TEST_CASE("an incident is an error with the code of CiA 401, told once") {
  Module module(demo_image("io_module.eds"));
  CHECK(module.device.incidents().size() == 2);
  module.incident("output-short-circuit", true).expect("2320/03");
  module.incident("output-short-circuit", true);
  module.incident("input-voltage-low", true).expect("3120/05");
  module.incident("output-short-circuit", false).expect("2320 over");
  module.reset(false).expect("3120/05");
  module.reset(true).expect("3120/05");
  module.incident("input-voltage-low", false).expect("3120 over");
}

TEST_CASE("a module has as many blocks as its dictionary") {
  Module module(dictionary_of({{0x6000, 254, DataType::kUnsigned8}, {0x6200, 3, DataType::kUnsigned8}}));
  module.input(0x6000, 254, 0x80).shows(0x6000, 254, 0x80);
  module.expect("changed 6000:FE");  // without 6005h and 6006h the profile's defaults apply
  module.write(0x6200, 3, 0x42).puts_out(0x6200, 3, 0x42).puts_out(0x6200, 2, 0x00);
  module.state(State::kStopped);  // also without 6206h and 6207h
  module.puts_out(0x6200, 3, 0x00);
}

TEST_CASE("all values are up to date before the first event is reported") {
  struct Sampling final : sim::DeviceNode {
    descriptions::DictionaryImage image = dictionary_of({{0x6000, 2, DataType::kUnsigned8}});
    ObjectDictionary own{image.entries, image.values, nullptr};
    devices::IoModule module{*this};
    std::vector<std::uint64_t> sampled;
    ObjectDictionary& dictionary() override { return own; }
    void error(std::uint16_t, std::uint8_t, const sim::EmergencyInfo&, Time) override {}
    void error_over(std::uint16_t, Time) override {}
    void changed(std::uint16_t, std::uint8_t sub, Time now) override {
      module.update(now);  // as before a TPDO is sampled
      sampled.push_back(sub * 0x10000u + own.get(0x6000, 1) * 0x100 + own.get(0x6000, 2));
    }
  } node;
  node.module.set_input(0x6000, 1, 0x11, 0);
  node.module.set_input(0x6000, 2, 0x22, 0);
  node.module.update(0);
  CHECK(node.sampled == std::vector<std::uint64_t>{0x21122, 0x11122});
}

}  // namespace cbcan::test
