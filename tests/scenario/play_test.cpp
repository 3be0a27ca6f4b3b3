// SPDX-License-Identifier: MIT
// Scenarios as text, and their results on a plant in this process.

#include "plant/demo.hpp"
#include "scenario/scenario.hpp"
#include "support/case_file.hpp"

namespace cbcan::plant::test {

using namespace cbcan::scenario;

namespace {

using Lines = std::vector<std::string>;

const base::FileReader kRead = config::with_demo_plant([](const std::string& path) {
  const std::map<std::string, std::string> files{{"dir/network.toml", "[network]\n"},
                                                 {"dir/tank.lua", "SETTINGS = {}\n"},
                                                 {"dir/other.toml", "[[step]]\n"}};
  const auto found = files.find(path);
  return found == files.end() ? std::nullopt : std::optional(found->second);
});

Scenario scenario(const std::string& text) {
  return read_scenario(text, "dir/s.toml", kRead);
}

Lines problems(const config::Diagnostics& found) {
  Lines lines;
  for (const config::Diagnostic& each : found)
    lines.push_back(to_string(each));
  return lines;
}

struct Stage {
  explicit Stage(const Scenario& scenario) : build(config::build_nodes(scenario.config, kRead)) {
    REQUIRE(build.good);
    plant.emplace(scenario.config, std::move(build));
  }
  config::PlantBuild build;
  std::optional<VirtualPlant> plant;
};

Outcome played(const std::string& text) {
  const Scenario made = scenario(text);
  REQUIRE(problems(made.problems).empty());
  Stage stage(made);
  REQUIRE(problems(check_steps(made, *stage.plant)).empty());
  stage.plant->start();
  return play(made, *stage.plant);
}

}  // namespace

TEST_CASE("scenarios: errors in a file are reported by line") {
  for (const cbcan::test::FileCase& each : cbcan::test::cases_of("tests/scenario/mistakes.txt"))
    each.check(cbcan::test::without("dir/s.toml:", problems(scenario(each.text()).problems)));
}

TEST_CASE("scenarios: invalid commands and conditions are reported before anything happens") {
  const Scenario made = scenario(
      "plant = \"demo\"\n[[step]]\ndo = [\"time\",\n \"tmie\"]\nwait = \"regster 1\"\nexpect = \"register "
      "99999 = 1\"\n");
  REQUIRE(made.problems.empty());
  Stage stage(made);
  const config::Diagnostics found = check_steps(made, *stage.plant);
  REQUIRE(found.size() == 3);
  CHECK(found[0].place.line == 4);
  CHECK(found[1].place.line == 5);
  CHECK(found[2].place.line == 6);
}

TEST_CASE("scenarios: steps let time pass by their keys") {
  for (const std::string command : {"pass 1s", "wait register 3700 = 0"}) {
    const Scenario made = scenario("plant = \"demo\"\n[[step]]\ndo = \"" + command + "\"\n");
    Stage stage(made);
    CHECK(problems(check_steps(made, *stage.plant)) ==
          Lines{"dir/s.toml:3: " + command.substr(0, 4) +
                ": a step lets time pass by its keys at, after and wait"});
  }
}

TEST_CASE("conditions and commands take as many words as they have, and no more") {
  const auto plant = demo();
  for (const char* line : {"wait state 66 operational x", "wait state 66", "time x", "trigger",
                           "trigger read", "pass", "pass 1s x"})
    CHECK(plant->execute(line).starts_with("error: "));
  CHECK_NOTHROW(make_condition("state 66 operational", plant->view()));
  for (const char* condition : {"state 66 operational x", "state 66", "register 3700 = 0 x", "register 3700"})
    CHECK_THROWS_AS(make_condition(condition, plant->view()), Refused);
  const auto bare = demo("[[network]]\n[network.module]\nenabled = false\n");
  CHECK(bare->execute("read 2/3700") == "error: network 2: there is no module, which has the registers\n");
  CHECK(plant->execute("trigger 5055") == "ok\n");
  CHECK(plant->execute("wait state 66 pre-operational").starts_with("ok "));
}

TEST_CASE("scenarios: a step that fails says where, what, when, the registers and the last frames") {
  const Outcome failed = played(
      "plant = \"demo\"\n[[step]]\nafter = \"250ms\"\ndo = \"trigger read 0x42 0x1000 0 4\"\n"
      "expect = \"register 3700 = 7\"\n");
  CHECK(failed.duration == 250 * kMillisecond);
  CHECK(failed.text.starts_with("dir/s.toml:5: expected register 3700 = 7: "));
  CHECK(failed.text.find("\n  at 0.250000\n  R3700..: 0 5055 66 4096 0 4 401 15 0 0\n"
                         "  the last frames:\n") != std::string::npos);
  CHECK(failed.text.ends_with("    0.250000 642#4000100000000000\n    0.250000 5C2#4300100091010F00\n"));
  const Outcome many = played(
      "plant = \"demo\"\n[[step]]\nevery = \"1ms\"\ndo = \"send 181#\"\n[[step]]\nafter = \"20ms\"\n"
      "expect = \"register 3700 = 7\"\n");
  const std::string frames = many.text.substr(many.text.find("the last frames:\n"));
  CHECK(std::ranges::count(frames, '\n') == 1 + 12);
}

TEST_CASE("scenarios: time is what at, after, every and within say") {
  CHECK(played("plant = \"demo\"\n[[step]]\nat = \"2s\"\n[[step]]\nafter = \"500ms\"\n").duration ==
        2'500 * kMillisecond);
  CHECK(played("plant = \"demo\"\n[[step]]\nat = \"2s\"\n[[step]]\nat = \"2s\"\n").text.empty());
  CHECK(played("plant = \"demo\"\n[[step]]\nat = \"2s\"\n[[step]]\nat = \"1s\"\n")
            .text.starts_with("dir/s.toml:4: at: it is 2.000000 already\n"));
  const Outcome waited =
      played("plant = \"demo\"\n[[step]]\nwait = \"register 3700 = 7\"\nwithin = \"3s\"\n");
  CHECK(waited.duration == 3 * kSecond);
  CHECK(waited.text.starts_with("dir/s.toml:3: not within 3.000000 s: register 3700 = 7: "));
  CHECK(played("plant = \"demo\"\n[[step]]\nwait = \"register 3700 = 7\"\n").duration == 60 * kSecond);
  // R3700 is 1 after a second without a node.
  const Outcome ended = played(
      "plant = \"demo\"\n[[step]]\ndo = \"trigger read 99 0x1000 0 4\"\nwait = \"register 3700 = 2\"\n");
  CHECK(ended.duration >= kSecond);
  // At 0, 100, 200 and 300 ms.
  CHECK(played("plant = \"demo\"\n[[step]]\nevery = \"100ms\"\ndo = \"send 181#\"\n[[step]]\n"
               "after = \"350ms\"\nexpect = \"3 frame 181#\"\n")
            .text.empty());
}

TEST_CASE("scenarios: a command that is refused while it is played") {
  const Outcome failed = played("plant = \"demo\"\n[[step]]\ndo = [\"time\",\n\"write 4167 1 2\"]\n");
  CHECK(failed.text.starts_with("dir/s.toml:4: write 4167 1 2: "));
}

}  // namespace cbcan::plant::test
