// SPDX-License-Identifier: MIT
// What changes the values of a node: signals, inputs, incidents, a behaviour.

#include "node_rig.hpp"

namespace cbcan::test {

namespace {

using sim::Ramp;
using sim::Replay;
using sim::Signal;

/// 6000h:1 shows twice its input. An error is present while 6200h:1 is above 100, or during the incident
/// "jam".
struct Doubler final : sim::Behaviour {
  explicit Doubler(sim::DeviceNode& node) : node_(node) {}

  void reset(bool application, Time) override { resets += application ? "node " : "communication "; }
  Time update(Time now) override {
    const std::uint64_t shown = 2 * input_;
    if (node_.dictionary().get(0x6000, 1) != shown) {
      node_.dictionary().set(0x6000, 1, shown);
      node_.changed(0x6000, 1, now);
    }
    const bool wrong = jammed_ || node_.dictionary().get(0x6200, 1) > 100;
    if (wrong)
      node_.error(0xFF01, 0x81, {1, 2, 3, 4, 5}, now);
    else
      node_.error_over(0xFF01, now);
    return kNever;
  }
  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time) override {
    if (index != 0x6000 || sub != 1) return false;
    input_ = static_cast<std::uint64_t>(value);
    return true;
  }
  std::vector<std::string_view> incidents() const override { return {"jam"}; }
  void set_incident(std::size_t, bool present, Time) override { jammed_ = present; }

  static inline std::string resets;

 private:
  sim::DeviceNode& node_;
  std::uint64_t input_ = 0;
  bool jammed_ = false;
};

sim::NodeParts with_doubler() {
  Doubler::resets.clear();
  sim::NodeParts parts;
  parts.behaviour = behaves_as<Doubler>;
  return parts;
}

sim::NodeParts with_signal(const sim::Shape& shape, Time sample_period = 10 * kMillisecond) {
  sim::NodeParts parts;
  parts.signals.push_back({0x6000, 1, sample_period, shape});
  return parts;
}

}  // namespace

TEST_CASE("Node: a constant signal is there at power-on, and stays through resets") {
  NodeBench bench(with_signal(sim::Constant{0x1234}));
  bench.ask("605#4000600100000000", "585#4B00600134120000");
  bench.ask("000#0105", "185#3412");
  bench.pass(kSecond).expect_silence();
  bench.ask("000#8105", "705#00");
  bench.ask("605#4000600100000000", "585#4B00600134120000");
  bench.input(bench.node, 0x6000, 1, 0x4321);
  bench.send("000#8205").expect("705#00");
  bench.ask("000#8105", "705#00");
  bench.ask("605#4000600100000000", "585#4B00600121430000");
}

TEST_CASE("Node: a CSV's values at their times, in steps of the sample period, again and again") {
  const sim::CsvPoints csv = sim::parse_csv_points("0,1\n0.005,2\n0.010,3\n0.012,3\n");
  REQUIRE(csv.problem.empty());
  WorldBench bench;
  Replay replay;
  replay.points = csv.points;
  replay.repeat = true;
  add_node(bench, 5, with_signal(replay, kMillisecond));
  bench.start().expect("705#00");
  bench.ask("000#0105", "185#0100");
  bench.pass(20 * kMillisecond);
  bench.expect_at(5 * kMillisecond, "185#0200");
  bench.expect_at(10 * kMillisecond, "185#0300");
  bench.expect_at(12 * kMillisecond, "185#0100");
  bench.expect_at(17 * kMillisecond, "185#0200");
}

TEST_CASE("Node: two signals with sample periods of their own") {
  sim::NodeParts parts;
  parts.signals.push_back({0x6000, 1, 3 * kMillisecond, Ramp{0, 12, 12 * kMillisecond}});
  parts.signals.push_back({0x6002, 0, 4 * kMillisecond, Ramp{0, -12, 12 * kMillisecond}});
  NodeBench bench(parts);
  sim::Node& node = bench.node;
  std::string seen;
  for (int i = 0; i <= 12; ++i) {
    seen += std::to_string(value_of(node, 0x6000, 1)) + "/" +
            std::to_string(static_cast<std::int8_t>(value_of(node, 0x6002, 0))) + " ";
    bench.pass(kMillisecond);
  }
  CHECK(seen == "0/0 0/0 0/0 3/0 3/-4 3/-4 6/-4 6/-4 6/-8 9/-8 9/-8 9/-8 12/-12 ");
}

TEST_CASE("Node: an input without a behaviour is the object's value, rounded and limited") {
  NodeBench bench;
  sim::Node& node = bench.node;
  struct Given {
    std::uint16_t index;
    std::uint8_t sub;
    double value;
    std::uint64_t stored;
  };
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  for (const Given& row : std::initializer_list<Given>{{0x6000, 1, 2.4, 2},
                                                       {0x6000, 1, 2.5, 3},
                                                       {0x6000, 1, -1, 0},
                                                       {0x6000, 1, 65535, 65535},
                                                       {0x6000, 1, 65536, 65535},
                                                       {0x6000, 1, 1e300, 65535},
                                                       {0x6000, 1, not_a_number, 0},
                                                       {0x6001, 0, 1, 1},
                                                       {0x6001, 0, 0, 0},
                                                       {0x6001, 0, 5, 1},
                                                       {0x6001, 0, -5, 0},
                                                       {0x6002, 0, -128, 0x80},
                                                       {0x6002, 0, -1000, 0x80},
                                                       {0x6002, 0, 1000, 0x7F},
                                                       {0x6002, 0, -1.5, 0xFE},
                                                       {0x6003, 0, 0.1, 0x3DCCCCCD}}) {
    INFO(row.index << " " << row.value);
    bench.input(node, row.index, row.sub, row.value);
    CHECK(value_of(node, row.index, row.sub) == row.stored);
  }
  CHECK_FALSE(node.set_input(0x6000, 2, 1, bench.now));  // no such sub-index
  CHECK_FALSE(node.set_input(0x7000, 0, 1, bench.now));
  CHECK_FALSE(node.set_input(0x1010, 1, 1, bench.now));  // a command, not a number
  CHECK_FALSE(node.set_input(0x1014, 0, 0, bench.now));  // for SDO, which checks it
}

TEST_CASE("Node: a behaviour has its inputs, the others are the dictionary's") {
  NodeBench bench(with_doubler());
  sim::Node& node = bench.node;
  bench.ask("000#0105", "185#0000");
  bench.input(node, 0x6000, 1, 0x11).expect("185#2200");
  bench.input(node, 0x6002, 0, 0x11);
  CHECK(value_of(node, 0x6002, 0) == 0x11);
  CHECK(node.set_input(0x6003, 0, 1, bench.now, true));  // a wire
  bench.ask("000#8105", "705#00");
  CHECK(value_of(node, 0x6002, 0) == 0);
  CHECK(value_of(node, 0x6003, 0) == 0x3F800000);
  CHECK(value_of(node, 0x6000, 1) == 0x22);
}

TEST_CASE("Node: a behaviour's errors: by SDO, by RPDO, by an incident") {
  NodeBench bench(with_doubler());
  sim::Node& node = bench.node;
  bench.send("605#2B00620165000000").expect("585#6000620100000000", "085#01FF810102030405");
  bench.ask("605#4001100000000000", "585#4F01100081000000");
  bench.send("605#2B00620164000000").expect("585#6000620100000000", "085#0000000000000000");
  bench.ask("000#0105", "185#0000");
  bench.ask("205#6500", "085#01FF810102030405");
  bench.ask("205#0000", "085#0000000000000000");
  bench.incident(node, "jam", true).expect("085#01FF810102030405");
  CHECK_FALSE(node.set_incident("jelly", true, bench.now));
  bench.incident(node, "jam", false).expect("085#0000000000000000");
}

TEST_CASE(
    "Node: an error whose cause is still there is reported again after reset node, not after reset comm.") {
  NodeBench bench(with_doubler());
  sim::Node& node = bench.node;
  bench.incident(node, "jam", true).expect("085#01FF810102030405");
  bench.ask("000#8205", "705#00");
  bench.ask("605#4001100000000000", "585#4F01100081000000");
  bench.send("000#8105").expect("705#00", "085#01FF810102030405");
  CHECK(Doubler::resets == "node communication node ");
}

TEST_CASE("Node: without a behaviour there are no incidents") {
  NodeBench bench;
  sim::Node& node = bench.node;
  CHECK_FALSE(node.set_incident("jam", true, bench.now));
}

}  // namespace cbcan::test
