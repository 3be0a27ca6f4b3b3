// SPDX-License-Identifier: MIT
#include "session/session.hpp"

#include <cstring>

#include "config/command_line.hpp"
#include "config/plant_file.hpp"
#include "support/catch.hpp"

namespace cbcan::session {
namespace {

/// A host on a manual clock, without files.
struct Program final : Host {
  Time time = 0;
  std::string told;

  const Time& now() const override { return time; }
  bool clock_runs() const override { return false; }
  Time machine_now() const override { return 0; }
  Time wall_offset() const override { return 0; }
  void tell(std::string_view lines) override { told += lines; }
  void say(std::string_view /*lines*/) override {}
  sim::ParameterStore* store(const std::string& /*file*/) override { return nullptr; }
  Served served() const override { return {}; }
  void shut_down() override {}
  void fail(base::ExitCode /*code*/, const std::string& /*why*/) override {}
  void let_pass(Time /*duration*/) override {}
};

TEST_CASE("a fault that acts while the plant is made is reported, before there are views") {
  const char* const words[] = {"cbcan-sim", "--demo", "--fault",
                               "0x42:emcy-storm code=0x1000 interval_ms=1 count=1"};
  const base::FileReader read =
      config::with_demo_plant([](const std::string&) -> std::optional<std::string> { return std::nullopt; });
  const config::Start start = config::parse_command_line(4, words, read);
  REQUIRE(start.run);
  Program program;
  // In memory that is not 0, a member that is used too early has some value.
  const auto memory = std::make_unique<std::byte[]>(sizeof(Session));
  std::memset(memory.get(), 0xFF, sizeof(Session));
  std::destroy_at(new (memory.get())
                      Session(start.config, config::build_nodes(start.config, read), "demo", program));
  CHECK(program.told ==
        "cbcan-sim: 0.000000 node 66: fault 1: emcy-storm code=0x1000 interval_ms=1 count=1: "
        "0C2#0010010000000000\n");
}

}  // namespace
}  // namespace cbcan::session
