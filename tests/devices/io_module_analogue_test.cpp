// SPDX-License-Identifier: MIT
// The analogue half of the CiA 401 I/O module.
#include "devices/io_module.hpp"
#include "tests/devices/rig.hpp"

namespace cbcan::test {

namespace {

using nmt::State;
using Module = Rig<devices::IoModule>;

constexpr std::uint8_t kUpper = 1, kLower = 2, kDelta = 4, kNegativeDelta = 8, kPositiveDelta = 16;

/// The demo plant's module with analogue events enabled and this selection (6421h) for channel 1.
struct Watched {
  explicit Watched(std::uint8_t trigger) : module_(demo_image("io_module.eds")) { set_up(trigger); }
  void set_up(std::uint8_t trigger) {
    write(0x6423, 0, 1);
    write(0x6421, 1, trigger);
  }
  void write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) { module_.write(index, sub, value); }
  void reset() { module_.reset(true); }
  /// A new value of the channel, and whether it is an event.
  struct Step {
    double value;
    bool event;
  };
  void steps(std::initializer_list<Step> steps) {
    for (const Step& step : steps) {
      INFO(step.value);
      module_.input(0x6401, 1, step.value);
      if (step.event) module_.expect("changed 6401:01");
      module_.expect_nothing();
    }
  }

 private:
  Module module_;
};

constexpr std::uint64_t bits(std::int32_t number) {
  return static_cast<std::uint32_t>(number);
}

}  // namespace

TEST_CASE("an analogue input shows in 6401h, rounded and within 16 bits") {
  Module module(demo_image("io_module.eds"));
  const auto shows = [&](double value, std::uint16_t shown) {
    INFO(value);
    module.input(0x6401, 2, value).shows(0x6401, 2, shown);
  };
  shows(1000.4, 1000);
  shows(1000.5, 1001);
  shows(-1.5, 0xFFFE);
  shows(40000, 0x7FFF);
  shows(-40000, 0x8000);
  shows(std::numeric_limits<double>::infinity(), 0x7FFF);
  module.shows(0x6401, 1, 0);
}

TEST_CASE("A module without 6423h reports its analogue inputs; no client could switch that on") {
  Module module(dictionary_of({{0x6401, 1, DataType::kInteger16}}));
  module.input(0x6401, 1, 100).expect("changed 6401:01");
  module.reset(true).input(0x6401, 1, 200).expect("changed 6401:01");
}

TEST_CASE("6423h is off at first: no analogue event, by CiA 401") {
  Module module(demo_image("io_module.eds"));
  module.input(0x6401, 1, 100);
  module.write(0x6423, 0, 1);
  module.expect_nothing();
  module.input(0x6401, 1, 101).expect("changed 6401:01");
}

TEST_CASE("the default selection 07h with its zeros: every change is an event") {
  Watched module(7);
  module.steps({{1, true}, {1, false}, {-1, true}, {0, true}});
}

TEST_CASE("a file without 6421h: limits and delta count, by CiA 401") {
  Module module(dictionary_of({{0x6401, 1, DataType::kInteger16},
                               {0x6423, 0, DataType::kBoolean},
                               {0x6424, 1, DataType::kInteger32},
                               {0x6425, 1, DataType::kInteger32},
                               {0x6426, 1, DataType::kUnsigned32}}));
  module.write(0x6423, 0, 1);
  module.write(0x6424, 1, 100);
  module.write(0x6425, 1, bits(-100));
  module.write(0x6426, 1, 10);
  module.input(0x6401, 1, 99);
  module.input(0x6401, 1, 9);
  module.input(0x6401, 1, 100).expect("changed 6401:01");
  module.input(0x6401, 1, 109);
  module.expect_nothing();
  module.input(0x6401, 1, -101).expect("changed 6401:01");
}

TEST_CASE("no bit of 6421h: no event") {
  Watched module(0);
  module.steps({{100, false}});
  module.write(0x6421, 1, 0xE0);  // unused bits
  module.steps({{200, false}});
}

TEST_CASE("6424h: from the upper limit on, every change") {
  Watched module(kUpper);
  module.write(0x6424, 1, 100);
  module.steps({{99, false}, {100, true}, {100, false}, {101, true}, {99, false}, {-200, false}});
}

TEST_CASE("6425h: below the lower limit, every change") {
  Watched module(kLower);
  module.write(0x6425, 1, bits(-100));
  module.steps({{-100, false}, {-101, true}, {-102, true}, {-100, false}, {32767, false}});
}

TEST_CASE("limits are numbers of 32 bits in the unit of 6401h") {
  Watched module(kUpper | kLower);
  module.write(0x6424, 1, 0x00010000);  // out of reach of 16 bits
  module.write(0x6425, 1, bits(-32768));
  module.steps({{32767, false}, {-32768, false}});
}

TEST_CASE("6426h: the difference to the value at the last event, both ways") {
  Watched module(kDelta);
  module.write(0x6426, 1, 10);
  module.steps({{9, false}, {10, true}, {1, false}, {0, true}, {-9, false}, {-32768, true}, {32767, true}});
}

TEST_CASE("6427h: only falls") {
  Watched module(kNegativeDelta);
  module.write(0x6427, 1, 10);
  module.steps({{100, false}, {-9, false}, {-10, true}, {-19, false}, {-20, true}});
}

TEST_CASE("6428h: only rises") {
  Watched module(kPositiveDelta);
  module.write(0x6428, 1, 10);
  module.steps({{-100, false}, {9, false}, {10, true}, {19, false}, {20, true}});
}

TEST_CASE("a delta of 32 bits is more than any change") {
  Watched module(kDelta | kNegativeDelta | kPositiveDelta);
  module.write(0x6426, 1, 0xFFFFFFFF);
  module.write(0x6427, 1, 0xFFFFFFFF);
  module.write(0x6428, 1, 0xFFFFFFFF);
  module.steps({{32767, false}, {-32768, false}});
}

TEST_CASE("a limit and a delta: both have to be reached") {
  Watched module(kUpper | kDelta);
  module.write(0x6424, 1, 100);
  module.write(0x6426, 1, 10);
  module.steps({{50, false}, {100, true}, {105, false}, {110, true}, {99, false}});
}

TEST_CASE("6422h shows the channels of the last moment with an event") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6423, 0, 1);
  module.input(0x6401, 2, 5).expect("changed 6401:02").shows(0x6422, 1, 2);
  module.input(0x6401, 1, 5).expect("changed 6401:01");  // at the same time
  module.shows(0x6422, 1, 3);
  module.now += 1;
  module.update();
  module.shows(0x6422, 1, 3);
  module.input(0x6401, 1, 6).expect("changed 6401:01").shows(0x6422, 1, 1);
}

TEST_CASE("channel 33 is bit 0 of 6422h:02") {
  Module module(dictionary_of({{0x6401, 40, DataType::kInteger16},
                               {0x6422, 2, DataType::kUnsigned32},
                               {0x6423, 0, DataType::kBoolean}}));
  module.write(0x6423, 0, 1);
  module.input(0x6401, 33, 1);
  module.input(0x6401, 32, 1).shows(0x6422, 1, 0x80000000).shows(0x6422, 2, 0x00000001);
  module.expect("changed 6401:21", "changed 6401:20");
}

TEST_CASE("a source without a place in 6422h is an event all the same") {
  Module module(dictionary_of({{0x6401, 33, DataType::kInteger16},
                               {0x6422, 1, DataType::kUnsigned32},
                               {0x6423, 0, DataType::kBoolean}}));
  module.write(0x6423, 0, 1);
  module.input(0x6401, 33, 1).expect("changed 6401:21").shows(0x6422, 1, 0);
}

TEST_CASE("6411h goes out: 300 stays 300") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6411, 1, 300).shows(0x6411, 1, 300).puts_out(0x6411, 1, 300).puts_out(0x6411, 2, 0);
  module.write(0x6411, 2, 0x8000).puts_out(0x6411, 2, -32768);
  CHECK(module.device.output(0x6411, 0) == std::nullopt);
  CHECK(module.device.output(0x6411, 3) == std::nullopt);
}

TEST_CASE("6443h and 6444h: analogue error values") {
  Module module(demo_image("io_module.eds"));
  module.write(0x6411, 1, 300);
  module.write(0x6411, 2, 400);
  module.write(0x6444, 1, bits(-7));
  module.write(0x6443, 2, 0);
  module.write(0x6444, 2, 9);
  module.state(State::kOperational);
  module.network_failure(sim::NetworkFailure::kHeartbeat);
  module.puts_out(0x6411, 1, -7);
  module.puts_out(0x6411, 2, 400);
  module.shows(0x6411, 1, 300);
  module.write(0x6444, 1, 100000);  // limited to 16 bits
  module.puts_out(0x6411, 1, 32767);
  module.state(State::kPreOperational);
  module.state(State::kOperational).puts_out(0x6411, 1, 300);
  module.state(State::kStopped).puts_out(0x6411, 1, 32767);
  module.reset(true).puts_out(0x6411, 1, 0);
}

TEST_CASE("reset node: deltas count from what the inputs are then") {
  Watched module(kDelta);
  module.write(0x6426, 1, 10);
  module.steps({{9, false}});
  module.reset();
  module.set_up(kDelta);
  module.write(0x6426, 1, 10);
  module.steps({{18, false}, {19, true}});
}

}  // namespace cbcan::test
