// SPDX-License-Identifier: MIT
// Many nodes at once through the channels of a module, in virtual time.
#include "cbcanctl/channels.hpp"

#include <cbcan/sim.hpp>

#include <deque>
#include <stdexcept>

#include "support/catch.hpp"

using namespace cbcan::tools;
using namespace std::chrono_literals;
using cbcan::Plant;

namespace {

class PlantRegisters final : public RegisterAccess {
 public:
  explicit PlantRegisters(const std::string& toml)
      : plant(Plant::from_text(toml, CBCAN_SOURCE_DIR "/plants/demo")) {}

  std::optional<std::vector<std::uint16_t>> look(std::uint16_t first, std::size_t count) override {
    return plant.registers(first, count);
  }
  void write(std::uint16_t first, std::span<const std::uint16_t> words) override {
    plant.write(first, {words.begin(), words.end()});
  }
  void wait() override {
    if (plant.now() >= give_up_at) throw std::runtime_error("given up");
    plant.advance(50us);
  }

  Plant plant;
  Plant::Duration give_up_at = 60s;
};

/// Writes 1, 2, 3... to 2004h of a node, reads it back, and starts the node.
class Configuration final : public Job {
 public:
  Configuration(std::uint16_t node, unsigned writes) : node_(node), writes_(writes) {}

  std::optional<Transaction> next() override {
    const auto value = static_cast<std::uint8_t>(++step_);
    if (step_ <= writes_) return Transaction{5066, node_, 0x2004, 0, 4, {value, 0, 0, 0}};
    if (step_ == writes_ + 1) return Transaction{5055, node_, 0x2004, 0, 8, {}};
    if (step_ == writes_ + 2) return Transaction{5066, 0, 0x1F82, node_, 1, {5}};
    return std::nullopt;
  }
  void ended(const Response& response) override { responses.push_back(response); }
  void check() const {
    REQUIRE(responses.size() == writes_ + 2);
    for (const Response& response : responses)
      REQUIRE(response.result == 0);
    REQUIRE(responses[writes_].data ==
            std::vector<std::uint8_t>{static_cast<std::uint8_t>(writes_), 0, 0, 0});
  }

  std::vector<Response> responses;

 private:
  std::uint16_t node_;
  unsigned writes_;
  unsigned step_ = 0;
};

std::string nodes(unsigned count, const std::string& more = "") {
  std::string toml = more + "[can]\nspec = \"virtual\"\nbit_rate = 1000000\n";
  for (unsigned node = 1; node <= count; ++node)
    toml += "[[node]]\nid = " + std::to_string(node) + "\neds = \"generic.eds\"\n";
  return toml;
}

}  // namespace

TEST_CASE("126 nodes, 20 writes each, read back and started: within a second of 1 Mbit/s") {
  PlantRegisters registers(nodes(126));
  registers.plant.advance(50ms);  // the boot-up messages
  std::deque<Configuration> configurations;
  std::vector<Job*> jobs;
  for (std::uint16_t node = 1; node <= 126; ++node)
    jobs.push_back(&configurations.emplace_back(node, 20u));
  const auto begin = registers.plant.now();
  REQUIRE(run(registers, jobs));
  registers.plant.advance(1ms);  // the last frame
  CHECK(registers.plant.now() - begin < 1s);
  for (const Configuration& each : configurations)
    each.check();
  for (int node = 1; node <= 126; ++node)
    CHECK(registers.plant.holds("state " + std::to_string(node) + " operational"));
}

TEST_CASE("aborts are the job's, and others go on") {
  PlantRegisters registers(nodes(2));
  registers.plant.advance(10ms);
  registers.plant.command("fault 1 abort code=0x06040043 after=1 count=1");
  Configuration one(1, 3), two(2, 3);
  Job* const jobs[]{&one, &two};
  REQUIRE(run(registers, jobs));
  two.check();
  REQUIRE(one.responses.size() == 5);
  CHECK(one.responses[1].result == 4);
  CHECK(one.responses[1].abort_code == 0x06040043);
}

TEST_CASE("who gives up leaves nothing under way") {
  PlantRegisters registers(nodes(1));
  registers.plant.advance(10ms);
  registers.plant.command("fault 1 response-never");
  registers.give_up_at = 20ms;
  Configuration one(1, 1);
  Job* const jobs[]{&one};
  CHECK_THROWS_WITH(run(registers, jobs), "given up");
  registers.plant.advance(1ms);
  CHECK(registers.plant.frames().back() == "601#8004200000000008");
}

TEST_CASE("a module with one channel") {
  PlantRegisters registers(nodes(1, "[module]\nchannels = 1\n"));
  Configuration one(1, 1);
  Job* const jobs[]{&one};
  CHECK_FALSE(run(registers, jobs));
  CHECK(one.responses.empty());
}
