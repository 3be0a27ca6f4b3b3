// SPDX-License-Identifier: MIT
// Many nodes at once through the channels of a module, in virtual time.
#include "cbcanctl/channels.hpp"

#include <cbcan/sim.hpp>

#include "support/catch.hpp"

using namespace cbcan::tools;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using cbcan::Plant;

namespace {

class PlantRegisters final : public RegisterAccess {
 public:
  explicit PlantRegisters(const std::string& toml)
      : plant(Plant::from_text(toml, CBCAN_SOURCE_DIR "/plants/demo")) {}

  cbcan::window::Response exchange(const cbcan::window::Request& request) override {
    std::vector<std::uint16_t> sent = request.words;
    if (sent.size() > 6 && sent[1] == 5066 && sent[2] == distorted) sent[6] ^= 8;
    if (!sent.empty()) plant.write(request.write_address, sent);
    if (request.count == 0) return {};
    return {.words = plant.registers(request.read_address, request.count)};
  }
  void wait() override {
    if (plant.now() >= give_up_at) throw std::runtime_error("given up");
    plant.advance(50us);
  }

  void progress(std::size_t ended) override {
    CHECK(ended >= told);
    told = ended;
  }

  Plant plant;
  std::size_t told = 0;      ///< jobs that have ended
  unsigned distorted = 128;  ///< a node that stores different values
  Plant::Duration give_up_at = 60s;
};

/// A plan with `writes` writes to 2001h..2004h of each node.
std::string plan_of(unsigned nodes, unsigned writes) {
  std::string toml;
  for (unsigned node = 1; node <= nodes; ++node) {
    toml += "[[node]]\nid = " + std::to_string(node) + "\ndevice_type = 0\nidentity = [0]\nobjects = [\n";
    for (unsigned i = 0; i < writes; ++i)
      toml += "{ index = " + std::to_string(0x2001 + i % 4) + ", value = " + std::to_string(i / 4) +
              ", type = \"u" + std::to_string(8 * (i % 4 + 1)) + "\" },\n";
    toml += "]\n";
  }
  return toml;
}

std::string page() {
  std::ifstream file(CBCAN_SOURCE_DIR "/docs/reference/cbcanctl.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// "0.95 s"
std::string seconds(Plant::Duration time) {
  const auto hundredths = (time + 5ms) / 10ms;
  return std::to_string(hundredths / 100) + "." + std::to_string(100 + hundredths % 100).substr(1) + " s";
}

/// Jobs for a plan, and their results.
struct Jobs {
  explicit Jobs(const std::string& toml, bool verify = true) : plan(read(toml)) {
    for (const PlannedNode& node : plan)
      list.push_back(&nodes.emplace_back(node, verify));
  }

  static std::vector<PlannedNode> read(const std::string& toml) {
    std::vector<std::string> remarks;
    const auto files = [&toml](const std::string& path) {
      return path == "plan.toml" ? std::optional(toml) : std::nullopt;
    };
    return read_network("plan.toml", files, remarks).all;
  }

  std::vector<PlannedNode> plan;
  std::deque<NodeConfiguration> nodes;
  std::vector<Job*> list;
};

std::string nodes(unsigned count, const std::string& more = "") {
  std::string toml = more + "[can]\nspec = \"virtual\"\nbit_rate = 1000000\n";
  for (unsigned node = 1; node <= count; ++node)
    toml += "[[node]]\nid = " + std::to_string(node) + "\neds = \"generic.eds\"\n";
  return toml;
}

}  // namespace

TEST_CASE("126 nodes, 20 writes each: checked, written and started within a second of 1 Mbit/s") {
  const bool verify = GENERATE(false, true);
  PlantRegisters registers(nodes(126));
  registers.plant.advance(50ms);  // the boot-up messages
  Jobs jobs(plan_of(126, verify ? 8 : 20), verify);
  const auto begin = registers.plant.now();
  REQUIRE(run(registers, jobs.list));
  CHECK(registers.told == 126);
  registers.plant.advance(1ms);  // the last frame
  const auto took = registers.plant.now() - begin;
  CHECK(took < 1s);
  CHECK_THAT(page(),
             Contains((verify ? "| 8 writes, and reading back | " : "| 20 writes | ") + seconds(took)));
  for (int node = 1; node <= 126; ++node) {
    CHECK(jobs.nodes[static_cast<std::size_t>(node - 1)].problem().empty());
    CHECK(registers.plant.holds("state " + std::to_string(node) + " operational"));
  }
  CHECK(registers.plant.command("get 126 0x2004") == (verify ? "1" : "4"));
}

TEST_CASE("a node that is another one, that refuses or that keeps another value is not started; others are") {
  PlantRegisters registers(nodes(4));
  registers.plant.advance(10ms);
  registers.plant.command("fault 1 abort code=0x06040043 index=0x2002 count=1");
  registers.distorted = 3;
  Jobs jobs(plan_of(4, 4));
  jobs.plan[1].identity[0].value[0] = 7;
  REQUIRE(run(registers, jobs.list));
  registers.plant.advance(1ms);
  CHECK(jobs.nodes[0].problem() == "node 1: 2002h:00");
  CHECK(jobs.nodes[0].refusal()->abort_code == 0x06040043);
  CHECK(jobs.nodes[1].problem() == "node 2: 1000h:00 is 00 00 00 00, not 07 00 00 00");
  CHECK(!jobs.nodes[1].refusal());
  CHECK(jobs.nodes[2].problem() == "node 3: 2001h:00 is 08, not 00");
  CHECK(jobs.nodes[3].problem().empty());
  CHECK(registers.plant.holds("state 1 pre-operational"));
  CHECK(registers.plant.holds("state 2 pre-operational"));
  CHECK(registers.plant.holds("state 4 operational"));
}

TEST_CASE("a client that gives up leaves no request in progress") {
  PlantRegisters registers(nodes(1));
  registers.plant.advance(10ms);
  registers.plant.command("fault 1 response-never");
  registers.give_up_at = 20ms;
  Jobs jobs(plan_of(1, 1));
  CHECK_THROWS_WITH(run(registers, jobs.list), "given up");
  registers.plant.advance(1ms);
  CHECK(registers.plant.frames().back() == "601#8000100000000008");
}

TEST_CASE("an object that can only be read has to have its value already") {
  const auto [value, problem] = GENERATE(
      table<int, std::string>({{0x12345678, ""}, {1, "node 1: 2200h:00 is 78 56 34 12, not 01 00 00 00"}}));
  const bool verify = GENERATE(false, true);
  PlantRegisters registers(nodes(1));
  registers.plant.advance(10ms);
  Jobs jobs("[[node]]\nid = 1\nobjects = [{ index = 0x2200, value = " + std::to_string(value) +
                ", type = 'u32' }]\n",
            verify);
  REQUIRE(run(registers, jobs.list));
  CHECK(jobs.nodes[0].problem() == problem);
}

TEST_CASE("126 nodes asked with an SDO timeout of 100 ms, which is put back, whatever happens") {
  PlantRegisters registers(nodes(6));
  registers.plant.advance(10ms);
  std::deque<ReadJob> jobs;
  std::vector<Job*> list;
  for (std::uint16_t node = 1; node <= 126; ++node)
    list.push_back(&jobs.emplace_back(node, std::vector<ObjectPlace>{{0x1000, 0}, {0x1001, 0}}));
  const auto begin = registers.plant.now();
  const bool given_up = GENERATE(false, true);
  if (given_up) {
    registers.give_up_at = begin + 50ms;
    CHECK_THROWS_WITH(run(registers, list, 100), "given up");
    registers.give_up_at = 60s;
  } else {
    REQUIRE(run(registers, list, 100));
    CHECK_THAT(page(), Contains("With 6 of the 126 other nodes present a scan takes " +
                                seconds(registers.plant.now() - begin)));
    CHECK(jobs[5].results()[0].data == Bytes{0, 0, 0, 0});
    CHECK(jobs[5].results()[1].data == Bytes{0});
    CHECK(jobs[6].silent());
    CHECK(jobs[6].results().size() == 1);
  }
  registers.told = 0;
  ReadJob timeout(0, {{0x3003, 0}});
  Job* const asks[] = {&timeout};
  REQUIRE(run(registers, asks));
  CHECK(timeout.results()[0].data == Bytes{0xE8, 0x03});
}
