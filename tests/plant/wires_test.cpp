// SPDX-License-Identifier: MIT
// Wires between nodes: their values over time, independent of the steps of time.
#include "scripts.hpp"
#include "sim/bus_suite.hpp"
#include "support/bare_network.hpp"

namespace cbcan::plant::test {
namespace {

std::string wire(std::string_view from, std::string_view to, std::string_view more = "") {
  return fmt::format("[[wire]]\nfrom = \"{}\"\nto = \"{}\"\n{}\n", from, to, more);
}

std::string get(VirtualPlant& plant, std::string_view what) {
  return run(plant, fmt::format("get {}", what));
}

/// The PLC writes 6200h:01 of the I/O module.
void write_outputs(VirtualPlant& plant, int value) {
  plant.execute(fmt::format("trigger write 0x42 0x6200 1 1 {}", value));
  plant.execute("wait register 3700 = 0");
}

TEST_CASE("what a wire makes of a step of 100 at 1 s, and of one back to 0 at 2 s") {
  struct Row {
    sim::TransferFunction transfer;
    Time time;
    double value;
  };
  const auto row = [](Time time, double value, auto change) {
    Row made{{}, time, value};
    change(made.transfer);
    return made;
  };
  const auto lags = [](sim::TransferFunction& t) { t.lag = 500 * kMillisecond; };
  const auto rows = {
      row(999'999, 0, [](auto&) {}),
      row(1'000'000, 100, [](auto&) {}),
      row(1'000'000, 205, [](auto& t) { t.scale = 2, t.offset = 5; }),
      row(1'000'000, 50, [](auto& t) { t.high = 50; }),
      row(2'000'000, 7, [](auto& t) { t.low = 7; }),
      row(0, 1, [](auto& t) { t.inverted = true; }),
      row(1'000'000, 0, [](auto& t) { t.inverted = true; }),
      row(1'299'999, 0, [](auto& t) { t.delay = 300 * kMillisecond; }),
      row(1'300'000, 100, [](auto& t) { t.delay = 300 * kMillisecond; }),
      row(3'499'999, 100, [](auto& t) { t.delay = 1500 * kMillisecond; }),
      row(3'500'000, 0, [](auto& t) { t.delay = 1500 * kMillisecond; }),
      row(1'500'000, 63.212056, lags),  // 100 (1 - 1/e)
      row(2'000'000, 86.466472, lags),
      row(2'500'000, 31.809235, lags),  // 86.466472 / e
      row(50'000'000, 0, lags),
  };
  for (const auto& [transfer, time, value] : rows) {
    CAPTURE(time, value);
    for (const Time step : {Time{1'000}, Time{7'777}, Time{250'000}, Time{60'000'000}}) {
      sim::Wire wire(transfer);
      wire.put(0, 0);
      Time now = 0;
      for (const auto& [at, put] : {std::pair(Time{1'000'000}, 100), std::pair(Time{2'000'000}, 0)}) {
        for (; now + step < at && now + step < time; now += step)
          wire.take(now);
        if (at <= time) wire.put(put, at);
      }
      CHECK(wire.take(time) == Approx(value).margin(1e-5));
    }
  }
}

TEST_CASE("a lag is passed on at times that do not depend on who looks, until it is over") {
  sim::TransferFunction transfer;
  transfer.lag = 500 * kMillisecond;
  sim::Wire wire(transfer);
  wire.put(0, 0);
  wire.put(100, 1'000'000);
  wire.take(1'003'000);
  CHECK(wire.next_change(1'003'000) == 1'010'000);
  CHECK(wire.next_change(20'999'000) == 21'000'000);  // 40 time constants
  CHECK(wire.next_change(21'000'000) == kNever);
}

TEST_CASE("an output is wired as it is at the terminal, bit by bit, at once") {
  const auto plant = demo(wire("66:output:2", "32:0x2001") + wire("66:0x6200:1.1", "66:input:8") +
                          wire("66:output:8", "66:input:1", "inverted = true"));
  CHECK(get(*plant, "32 0x2001") == "0");
  CHECK(get(*plant, "0x42 0x6000:1") == "1");
  write_outputs(*plant, 0x02);
  CHECK(get(*plant, "32 0x2001") == "1");
  CHECK(get(*plant, "0x42 0x6000:1") == "129");
  plant->execute("set 0x42 0x6202:1 0x02");  // polarity: the terminal is inverted
  CHECK(get(*plant, "32 0x2001") == "0");
  CHECK(get(*plant, "66 output:2") == "0");
  CHECK(get(*plant, "66 0x6200:1.1") == "1");
  CHECK(get(*plant, "66 0x6000:1") == "129");
  CHECK(plant->execute("wait object 66 output:2 = 0").starts_with("ok"));
  plant->execute("power 66 off");
  plant->execute("power 66 on");
  CHECK(get(*plant, "66 0x6000:1") == "1");
  CHECK(plant->execute("get 32 output:1") == "error: output:1: node 32 has no such terminal\n");
  CHECK(plant->execute("get 66 output:99") == "error: output:99: node 66 has no such terminal\n");
}

TEST_CASE("delays and lags end at their own times, across networks and back") {
  constexpr std::string_view kSecond = R"([[network]]
[network.module]
enabled = false
[[network.node]]
id = 32
eds = "demo:/generic.eds"
)";
  const std::string wires = wire("66:analogue-output:1", "2/32:0x2002", "delay_ms = 250") +
                            wire("2/32:0x2002", "32:0x2002", "lag_ms = 100\nscale = 10") +
                            wire("32:0x2002", "66:analogue-input:1", "sample_ms = 50");
  std::vector<std::string> known;
  for (const std::string_view step : {"1us", "999us", "40ms", "3s"}) {
    const auto plant = demo(std::string(kSecond) + wires);
    Frames frames(*plant);
    plant->execute("nmt start all");
    plant->execute("set 66 0x6423 1");
    plant->execute("trigger write 66 0x6411 1 2 300");
    plant->execute("pass 250ms");
    CHECK(get(*plant, "2/32 0x2002") == "300");
    const std::string response = plant->execute("wait object 66 0x6401:1 >= 2000");
    plant->execute("pass 100us");
    for (int i = 0; i < 20; ++i)
      plant->execute(fmt::format("pass {}", step));
    plant->advance_to(70 * cbcan::kSecond);
    CHECK(get(*plant, "66 0x6401:1") == "3000");
    frames.seen.push_back(response);
    if (known.empty()) known = frames.seen;
    CHECK(frames.seen == known);
  }
}

TEST_CASE("networks with wires go through time together, however far they are to go at once") {
  const std::string text = R"([[node]]
id = 66
eds = "demo:/io_module.eds"
[[node]]
id = 32
eds = "demo:/generic.eds"
signals = [ { index = 0x2002, shape = "ramp", to = 50, duration_ms = 1000, sample_ms = 13 } ]
[[network]]
[[network.node]]
id = 66
eds = "demo:/io_module.eds"
)" + wire("32:0x2002.1", "2/66:input:1", "delay_ms = 7") +
                           wire("2/66:0x6000:1.0", "66:input:2");
  constexpr Time kAsDue = 0;
  const auto logs = [&text](Time step) {
    auto [config, nodes] = build(text, reader());
    REQUIRE(nodes.good);
    std::array<cbcan::test::BusLog, 2> seen;
    cbcan::test::ByHand driver;
    Network one(config, config.networks[0], std::move(nodes.networks[0]), driver.context());
    Network two(config, config.networks[1], std::move(nodes.networks[1]), driver.context());
    Wires wires(config, config.wires, {&one, &two}, driver.context());
    one.world().bus().observe(seen[0]);
    two.world().bus().observe(seen[1]);
    for (Network* network : {&one, &two})
      network->start(false);
    for (Network* network : {&one, &two})
      CHECK(network->send(nmt::command_frame(nmt::Command::kStart, 0)));
    Time& now = driver.now;
    if (step == kAsDue) driver.poll_what_is_due_until(2 * kSecond + 1);
    for (; now < 2 * kSecond; now = std::min(now + step, 2 * kSecond))
      (now / step % 2 == 0 ? one : two).advance();
    if (step != kAsDue) one.advance();
    return std::pair(seen[0].lines, seen[1].lines);
  };
  const auto known = logs(1'000);
  // Bit 1 of 0..50 changes 25 times: each is a TPDO there, 7 ms later, and one here at the same time.
  CHECK(std::ranges::count_if(known.first,
                              [](const auto& line) { return line.find(" 1C2#02") != line.npos; }) == 13);
  CHECK(std::ranges::count_if(known.second,
                              [](const auto& line) { return line.find(" 1C2#01") != line.npos; }) == 13);
  for (const Time step : {kAsDue, Time{13'000}, Time{99'999}, Time{700'000}, Time{2'000'000}})
    CHECK(logs(step) == known);
}

TEST_CASE("ends that a node does not have are reported") {
  const std::string text = "[[node]]\nid = 5\neds = \"demo:/io_module.eds\"\n" +
                           wire("5:output:999", "5:input:1") + wire("5:0x6200:1", "5:0x1017");
  const config::PlantBuild nodes = build(text, reader()).build;
  CHECK_FALSE(nodes.good);
  CHECK(
      nodes.lines ==
      std::vector<std::string>{
          "plant.toml:4: wire 5:output:999 to 5:input:1: the node, whose device is cia401, has no such "
          "output or "
          "number as 5:output:999; cbcan-sim eds prints its objects",
          "plant.toml:8: wire 5:0x6200:1 to 5:0x1017: the node, whose device is cia401, has no such input as "
          "5:0x1017; cbcan-sim eds prints its objects"});
}

TEST_CASE("an end by name is checked like one by number") {
  const auto line = [](const std::string& wires) {
    const std::string text = "[[node]]\nid = 5\neds = \"demo:/io_module.eds\"\n";
    return build(text + wires, reader()).build.lines.at(0);
  };
  CHECK(line(wire("5:output-1-to-8", "5:inputs-1-to-8")) ==
        "plant.toml:4: wire 5:output-1-to-8 to 5:inputs-1-to-8: \"output-1-to-8\": the node has no such "
        "object; did "
        "you mean outputs-1-to-8?");
  CHECK(line(wire("5:output:1", "5:inputs-1-to-8") + wire("5:output:2", "5:input:3")) ==
        "plant.toml:8: wire 5:output:2 to 5:input:3: 5:input:3 already has a wire at plant.toml:4; "
        "remove one "
        "of the two, or write sum = true in both");
}

TEST_CASE("what goes round through devices does not stop time") {
  const auto plant = demo(wire("32:0x2001", "32:0x2002", "scale = -1\noffset = 1") +
                          wire("32:0x2002.0", "32:0x2003.0") + wire("32:0x2003", "32:0x2004"));
  plant->execute("set 32 0x2001 5");
  plant->execute("pass 1s");
  CHECK(plant->now() == kSecond);
}

}  // namespace
}  // namespace cbcan::plant::test
