// SPDX-License-Identifier: MIT
// The models of plants/: each within 0.1 % of its analytic solution, and independent of the steps of time.

#include "scripts.hpp"

namespace cbcan::plant::test {
namespace {

std::unique_ptr<VirtualPlant> model(std::string_view name, std::string_view more = "") {
  return plant_of(fmt::format("[[node]]\nid = 20\ndevice = \"plants/{0}.lua\"\n{1}", name, more));
}

double number(VirtualPlant& plant, std::string_view object) {
  return std::stod(run(plant, fmt::format("get 20 {}", object)));
}

/// To this time in seconds: in steps of this many microseconds with a read after each, or in one step.
void pass(VirtualPlant& plant, double to, Time step) {
  const auto end = static_cast<Time>(std::llround(to * 1e6));
  while (step != 0 && plant.now() + step < end) {
    plant.advance_to(plant.now() + step);
    number(plant, "0x2000");
  }
  plant.advance_to(end);
}

constexpr std::array<Time, 3> kSteps{0, 1'000'000, 377'777};

/// Commands at their times, and the analytic solution in between.
struct Event {
  double at;
  const char* command;
};
struct Answer {
  double at;
  double value;
  const char* object = "0x2000";
};
void check(std::string_view name, const std::vector<Event>& events, const std::vector<Answer>& answers) {
  for (const Time step : kSteps) {
    CAPTURE(step);
    const auto plant = model(name);
    auto event = events.begin();
    for (const Answer& answer : answers) {
      for (; event != events.end() && event->at <= answer.at; ++event) {
        pass(*plant, event->at, step);
        CHECK(run(*plant, event->command) == "");
      }
      pass(*plant, answer.at, step);
      CAPTURE(answer.at, answer.object);
      CHECK(number(*plant, answer.object) == Approx(answer.value).epsilon(0.001).margin(1e-6));
    }
  }
}

TEST_CASE("the models declare what they have") {
  const auto points = [](std::string_view name) { return run(*model(name), "points 20"); };
  CHECK(points("tank") ==
        "input 0x2001:0 0 % \"inlet\"\n"
        "input 0x2002:0 0 % \"outlet\"\n"
        "output 0x2000:0 0 mm \"level\"\n"
        "output 0x2003:0 2 \"marks\"\n"
        "curve 0x2000:0 0 mm \"level\"\nok");
  CHECK(points("thermal").starts_with("input 0x2001:0 0 % \"heater\"\n"));
  CHECK(points("conveyor").find("output 0x2003:0 0 \"photo cells\"\n") != std::string::npos);
}

TEST_CASE("tank: filling, Torricelli's outflow, both, full, and a leak") {
  const double k = 0.0008 * std::sqrt(2 * 9.81);  // per opening, m2.5/s
  const auto emptied = [k](double from, double opening, double t) {
    const double root = std::sqrt(from) - opening * k * t / (2 * 0.2);
    return 1000 * root * root;
  };
  // Inlet 30 % is 3 l/s on 0.2 m2: 15 mm/s.
  check("tank", {{1, "set 20 0x2001 30"}, {21, "set 20 0x2001 0"}, {21, "set 20 0x2002 50"}},
        {{1, 0},
         {2, 15},
         {12.345, 170.175},
         {21, 300},
         {41, emptied(0.3, 0.5, 20)},
         {71, emptied(0.3, 0.5, 50)},
         {400, 0},
         {400, 2, "0x2003"}});
  // Both open: towards (q / k)^2 = (0.003 / 0.003543)^2 m, where it stays.
  check("tank", {{0, "set 20 0x2001 30"}, {0, "set 20 0x2002 100"}}, {{1000, 1000 * std::pow(0.003 / k, 2)}});
  check("tank", {{0, "set 20 0x2001 100"}, {40, "set 20 0x2001 0"}, {40, "incident 20 leak on"}},
        {{19.99, 999.5}, {20.01, 1000}, {30, 1, "0x2003"}, {50, emptied(1, 0.1, 10)}});
  // The way there, by the Runge-Kutta method in steps of 1 ms.
  double level = 1e-9;
  for (int i = 0; i < 60'000; ++i) {
    const auto rate = [k](double l) { return (0.003 - k * std::sqrt(l)) / 0.2; };
    const double a = rate(level), b = rate(level + a * 5e-4), c = rate(level + b * 5e-4),
                 d = rate(level + c * 1e-3);
    level += (a + 2 * b + 2 * c + d) / 6000;
  }
  check("tank", {{0, "set 20 0x2001 30"}, {0, "set 20 0x2002 100"}}, {{60, 1000 * level}});
}

TEST_CASE("thermal: a lagging heater and a body with losses") {
  // 50 % of 2000 W, 20 W/K: up to 70 degrees with 500 s, less what the heater's 5 s cost.
  const auto heated = [](double t) {
    return 70 - 50 * (500 * std::exp(-t / 500) - 5 * std::exp(-t / 5)) / 495;
  };
  check(
      "thermal", {{10, "set 20 0x2001 50"}},
      {{10, 20}, {15, heated(5)}, {15, 632.12, "0x2003"}, {60, heated(50)}, {510, heated(500)}, {3510, 70}});
  const double warm = heated(300);
  check("thermal", {{0, "set 20 0x2001 50"}, {300, "incident 20 door-open on"}, {300, "set 20 0x2002 5"}},
        {{300, warm}, {2300, 5 + 1000.0 / 60}});
  // 60 W/K: from there to the final value with 10000 / 60 s.
  check("thermal", {{0, "set 20 0x2001 50"}, {300, "incident 20 door-open on"}},
        {{400, 20 + 1000.0 / 60 + (warm - 20 - 1000.0 / 60) * std::exp(-100 * 60 / 10000.0)}});
}

TEST_CASE("conveyor: photo cells see the edges of a piece at their microsecond") {
  // 1000 mm/s2 up to 500 mm/s: 125 mm in 0.5 s. The cell at 200 mm sees from 200 to 350 mm.
  check("conveyor", {{1, "set 20 0x2002 1"}, {1, "set 20 0x2001 500"}},
        {{1.25, 250},
         {1.649'99, 0, "0x2003"},
         {1.650'01, 1, "0x2003"},
         {1.949'99, 1, "0x2003"},
         {1.950'01, 0, "0x2003"},
         {3.249'99, 0, "0x2003"},
         {3.250'01, 2, "0x2003"},
         {5.349'99, 4, "0x2003"},
         {5.350'01, 0, "0x2003"},
         {5.549'99, 0, "0x2004"},
         {5.550'01, 1, "0x2004"}});
  // Blocked for 2 s at 150 mm, then from 0 up again: 125 mm in 0.5 s.
  check("conveyor",
        {{1, "set 20 0x2002 1"},
         {1, "set 20 0x2001 500"},
         {1.55, "incident 20 blocked on"},
         {3.55, "incident 20 blocked off"}},
        {{3.5, 0}, {3.866'22, 0, "0x2003"}, {3.866'24, 1, "0x2003"}});  // 50 mm at 1000 mm/s2: 0.316228 s
  // Back over the cell: 200 mm at 1.65 s with 500 mm/s, to -500 mm/s at 2.65 s, 200 mm again then.
  check("conveyor", {{1, "set 20 0x2002 1"}, {1, "set 20 0x2001 500"}, {1.65, "set 20 0x2001 -500"}},
        {{1.7, 1, "0x2003"}, {2.649'99, 1, "0x2003"}, {2.650'02, 0, "0x2003"}});
}

TEST_CASE("a tank's loop is closed by wires, and the same however time is cut") {
  constexpr std::string_view kLoop = R"([[node]]
id = 66
eds = "demo:/io_module.eds"
[[wire]]
from = "66:output:1"
to = "20:0x2001"
scale = 100
delay_ms = 30
[[wire]]
from = "20:0x2000"
to = "66:analogue-input:1"
scale = 16
lag_ms = 200
)";
  std::string known;
  for (const Time step : kSteps) {
    const auto plant = model("tank", kLoop);
    run(*plant, "nmt start 66");
    run(*plant, "trigger write 66 0x6200 1 1 1");
    pass(*plant, 10.0, step);
    // 50 mm/s since 0.03 s, and 200 ms behind: 488.5 mm.
    const double shown = std::stod(run(*plant, "get 66 0x6401:1"));
    CHECK(shown == Approx(16 * (498.5 - 10)).epsilon(0.001));
    if (known.empty()) known = run(*plant, "get 66 0x6401:1");
    CHECK(run(*plant, "get 66 0x6401:1") == known);
  }
}

TEST_CASE("a wire takes the names of points, as commands do") {
  const auto wire = [](std::string_view from, std::string_view to) {
    return fmt::format("[[wire]]\nfrom = \"{}\"\nto = \"{}\"\n", from, to);
  };
  const std::string module = "[[node]]\nid = 66\neds = \"demo:/io_module.eds\"\n";
  const auto plant =
      model("tank", module + wire("66:output:1", "20:inlet") + wire("20:level", "66:analogue-input:1"));
  run(*plant, "nmt start 66");
  run(*plant, "trigger write 66 0x6200 1 1 1");
  run(*plant, "pass 20s");
  CHECK(run(*plant, "nodes").find("20 pre-operational lua \"Tank\"\n") != std::string::npos);
  CHECK(run(*plant, "get 20 inlet") == "1");
  CHECK(run(*plant, "get 66 analogue-input:1") == "10");  // 1 % of 50 mm/s
  CHECK(run(*plant, "get 20 levl") == "error: \"levl\": the node has no such object; did you mean level?");
}

TEST_CASE("a drive moves a conveyor: the axis of the plant file, and a wire") {
  const auto plant = model("conveyor", R"([[node]]
id = 16
eds = "demo:/drive.eds"
axis = { inertia_kgcm2 = 10, friction_mnm = 50 }
[[wire]]
from = "16:0x606C"
to = "20:0x2001"
scale = 0.01
)");
  for (const char* line : {"set 16 0x6087 0", "set 16 0x6071 300", "set 16 0x6060 4", "set 16 0x6040 6",
                           "set 16 0x6040 7", "set 16 0x6040 15"})
    CHECK(run(*plant, line) == "");
  pass(*plant, 0.5, 0);
  CHECK(std::stod(run(*plant, "get 16 0x606C")) == Approx(198'944).epsilon(0.001));  // 250 rad/s2 for 0.5 s
  CHECK(number(*plant, "0x2001") == 1989);
  const Built wrong = build("[[node]]\nid = 5\neds = \"demo:/io_module.eds\"\naxis = {}\n", reader());
  CHECK(wrong.build.lines ==
        std::vector<std::string>{"plant.toml:1: node 5: axis: the device cia401 has none; a cia402 has one"});
}

}  // namespace
}  // namespace cbcan::plant::test
