// SPDX-License-Identifier: MIT
// Blocks of processes, each against its analytic answer, whatever the steps in which it is read.
#include "sim/wire.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

using namespace cbcan;
using cbcan::sim::Block;

namespace {

struct Input {
  double at;
  double value;
};
using Answer = std::function<double(double t)>;

Time us(double seconds) {
  return static_cast<Time>(std::llround(seconds * 1e6));
}

/// From 0 s to 20 s: the answer at 397 times, with reads in between in steps of each size, and without.
void check(const char* text, const std::vector<Input>& inputs, const Answer& answer) {
  for (const Time step : {Time{0}, Time{1'000}, Time{333'333}, Time{7'000'000}}) {
    CAPTURE(text, step);
    Block block = Block::parse(text).block;
    REQUIRE(Block::parse(text).problem.empty());
    auto input = inputs.begin();
    Time now = 0;
    for (int i = 0; i <= 396; ++i) {
      const double t = static_cast<double>(us(i * 20.0 / 396)) / 1e6;
      for (; input != inputs.end() && input->at <= t; ++input)
        block.put(input->value, now = us(input->at));
      for (; step != 0 && now + step < us(t); now += step)
        block.at(now);
      if (i % 5 == 0 && step == 333'333) block.put((input - 1)->value, us(t));  // the same input once more
      CAPTURE(t);
      REQUIRE(std::abs(block.at(now = us(t)) - answer(t)) < 1e-6);
    }
  }
}

const std::vector<Input> kStep{{0, 0}, {1, 100}};          // a step of 100 at 1 s
const std::vector<Input> kPulse{{0, 0}, {1, 4}, {5, -2}};  // 4 from 1 s to 5 s, then -2

}  // namespace

TEST_CASE("pt1: a step, and a first value of its own") {
  check("pt1 time=2.5", kStep, [](double t) { return t < 1 ? 0 : 100 * (1 - std::exp(-(t - 1) / 2.5)); });
  check("pt1 time=2 start=50", {{0, 10}}, [](double t) { return 10 + 40 * std::exp(-t / 2); });
}

TEST_CASE("integrator: ramps up to its limits, and leaves them at once") {
  // 0.5 per s and unit: 2 per s from 1 s, 7 at 4.5 s; from 5 s 1 per s down, -1 at 13 s.
  check("integrator gain=0.5 low=-1 high=7", kPulse, [](double t) {
    if (t < 5) return std::min(7.0, 2 * std::max(0.0, t - 1));
    return std::max(-1.0, 7 - (t - 5));
  });
  check("integrator start=3", {{0, 2}}, [](double t) { return 3 + 2 * t; });
}

TEST_CASE("dead-time: each change comes later") {
  check("dead-time time=1.5", kPulse, [](double t) {
    return us(t) < us(2.5) ? 0 : us(t) < us(6.5) ? 4 : -2;
  });
  check("dead-time time=30 start=9", kPulse, [](double) { return 9; });
}

TEST_CASE("pid: proportional, integral and filtered derivative part of a step, and its limits") {
  check("pid p=2 i=0.5 d=3 filter=0.25", kStep, [](double t) {
    return t < 1 ? 0 : 100 * (2 + 0.5 * (t - 1) + 3 / 0.25 * std::exp(-(t - 1) / 0.25));
  });
  // The integral part stays within the limits: it leaves them when the error changes its sign.
  check("pid p=1 i=1 low=0 high=10", kPulse, [](double t) {
    if (t < 1) return 0.0;
    if (t < 5) return std::min(10.0, 4 + 4 * (t - 1));
    return std::max(0.0, 10 - 2 * (t - 5) - 2);
  });
}

TEST_CASE("ramp: with a slope up and one down") {
  check("ramp up=2 down=0.5", kPulse, [](double t) {
    if (t < 5) return std::min(4.0, 2 * std::max(0.0, t - 1));
    return std::max(-2.0, 4 - 0.5 * (t - 5));
  });
}

TEST_CASE("hysteresis: between its thresholds it stays as it is") {
  check("hysteresis on=10 off=5", {{0, 7}, {2, 10}, {4, 5.5}, {6, 5}, {8, 9.9}, {10, 11}},
        [](double t) { return (t >= 2 && t < 6) || t >= 10 ? 1 : 0; });
}

TEST_CASE("A block says when its output changes next") {
  Block ramp = Block::parse("ramp up=4").block;
  ramp.put(0, 0);
  CHECK(ramp.moves_until() == 0);
  ramp.put(2, 1'000'000);
  CHECK(ramp.moves_until() == 1'500'000);
  Block integrator = Block::parse("integrator high=3").block;
  integrator.put(2, 500'000);
  CHECK(integrator.moves_until() == 2'000'000);
  Block later = Block::parse("dead-time time=2").block;
  later.put(0, 0);
  CHECK(later.next_step() == kNever);
  later.put(1, 300'000);
  CHECK(later.next_step() == 2'300'000);
  Block pid = Block::parse("pid i=1").block;
  pid.put(1, 0);
  CHECK(pid.moves_until() == kNever);
}

TEST_CASE("What is no block is refused with what it can be") {
  const auto problem = [](const char* text) { return Block::parse(text).problem; };
  CHECK(problem("") ==
        "block \"\": no such kind; there are pt1, integrator, dead-time, pid, ramp and hysteresis");
  CHECK(problem("pt2 time=1").starts_with("block \"pt2 time=1\": no such kind"));
  CHECK(problem("pt1 tme=1") == "block pt1: tme: no such key; there are time and start");
  CHECK(problem("pt1 time=0") == "block pt1: time: must be 0.000001..1e9");
  CHECK(problem("pid start=1") == "block pid: start: no such key; there are p, i, d, filter, low and high");
  CHECK(problem("pid p=1 p=2") == "block pid: p: is there twice; remove one");
  CHECK(problem("pid p=x") == "block pid: p: must be -1e9..1e9");
  CHECK(problem("ramp up=-1") == "block ramp: up: must be 0.000001..1e9");
  CHECK(problem("pid low=2 high=1") == "block pid: low is above high");
  CHECK(problem("hysteresis on=1 off=1") == "block hysteresis: off must be below on");
}

TEST_CASE("No input makes an output that is no number") {
  for (const char* text : {"pt1", "integrator", "dead-time", "pid i=1e9 d=1e9", "ramp", "hysteresis"}) {
    CAPTURE(text);
    Block block = Block::parse(text).block;
    Time now = 0;
    for (const double input : {0.0, 1e300, -1e300, std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(), -1.0}) {
      block.put(input, now += 1'000'000'000);
      CHECK(std::isfinite(block.at(now)));
      CHECK(std::isfinite(block.at(now + 1)));
    }
  }
}
