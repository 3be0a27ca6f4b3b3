// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "io/can/candump_log.hpp"
#include "support/catch.hpp"

namespace cbcan::io {
namespace {

TEST_CASE("a log that nobody reads in time: what is missing is told once for each time") {
  std::string folder = "/tmp/cbcan_fifo_XXXXXX";
  REQUIRE(mkdtemp(folder.data()) != nullptr);
  const std::string path = folder + "/log";
  REQUIRE(mkfifo(path.c_str(), 0600) == 0);
  const Descriptor reader(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  std::vector<std::string> warnings;
  std::optional<CandumpLog> log;
  log.emplace(path, "can0", 0, [&](const std::string& line) { warnings.push_back(line); });
  const auto fill = [&](std::uint64_t dropped) {
    while (log->counters().dropped < dropped)
      log->on_bus_frame({0x080, 0, 0, {}}, 0);
  };
  const auto read_all = [&] {
    std::vector<char> some(1 << 16);
    ssize_t count = 0;
    do {
      count = ::read(reader.get(), some.data(), some.size());
      log->flush();
    } while (count > 0);
  };
  fill(3);
  read_all();
  CHECK(warnings == std::vector{"log " + path + ": 3 frames are missing: they were not read in time"});
  log->flush();
  CHECK(warnings.size() == 1);
  fill(5);
  read_all();
  REQUIRE(warnings.size() == 2);
  CHECK(warnings[1] == "log " + path + ": 2 frames are missing: they were not read in time");
  log.reset();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace cbcan::io
