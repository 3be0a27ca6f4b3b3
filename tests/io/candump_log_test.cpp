// SPDX-License-Identifier: MIT
#include "io/files/captures.hpp"

#include <sys/stat.h>

#include "temporary_folder.hpp"

namespace cbcan::io {
namespace {

struct LogFile : test::TemporaryFolder {
  std::string path() const { return file("log"); }
  std::string text() const { return test::text_of(path()); }
};

constexpr Frame kSync{0x080, 0, 0, {}};

TEST_CASE("frames are in the file after the flush, with the wall clock's time") {
  const LogFile file;
  CandumpLog log({.path = file.path(), .interface = "can3", .wall_offset = 1'700'000'000 * kSecond},
                 [](const std::string& line) { FAIL(line); });
  log.on_bus_frame({0x605, 2, 0, {0xAA, 0x55}}, 1'500'000);
  CHECK(file.text().empty());
  log.flush();
  CHECK(file.text() == "(1700000001.500000) can3 605#AA55\n");
  log.on_bus_frame(kSync, 2'000'000);
  log.flush();
  log.flush();
  CHECK(file.text() == "(1700000001.500000) can3 605#AA55\n(1700000002.000000) can3 080#\n");
}

TEST_CASE("what was not flushed is in the file when the log goes, and an old file is replaced") {
  const LogFile file;
  std::ofstream(file.path()) << "old";
  { CandumpLog({.path = file.path()}, nullptr).on_bus_frame(kSync, 0); }
  CHECK(file.text() == "(0000000000.000000) virtual 080#\n");
}

constexpr auto kKept = Output::Content::kKept;

TEST_CASE("an existing file gets longer if it is kept") {
  const LogFile file;
  std::ofstream(file.path()) << "old\n";
  { CandumpLog({.path = file.path(), .content = kKept}, nullptr).on_bus_frame(kSync, 0); }
  CHECK(file.text() == "old\n(0000000000.000000) virtual 080#\n");
}

TEST_CASE("another program cuts the file: the log goes on at its end") {
  const LogFile file;
  CandumpLog log({.path = file.path()}, nullptr);
  log.on_bus_frame(kSync, 1);
  log.flush();
  REQUIRE(truncate(file.path().c_str(), 0) == 0);
  log.on_bus_frame(kSync, 2);
  log.flush();
  CHECK(file.text() == "(0000000000.000002) virtual 080#\n");
}

TEST_CASE("another program renames the file: reopen() begins a new one, and keeps one that is there") {
  const LogFile file;
  CandumpLog log({.path = file.path()}, nullptr);
  log.on_bus_frame(kSync, 1);
  REQUIRE(rename(file.path().c_str(), file.file("moved").c_str()) == 0);
  CHECK(log.reopen());
  log.on_bus_frame(kSync, 2);
  CHECK(log.reopen());
  log.on_bus_frame(kSync, 3);
  log.flush();
  CHECK(test::text_of(file.file("moved")) == "(0000000000.000001) virtual 080#\n");
  CHECK(file.text() == "(0000000000.000002) virtual 080#\n(0000000000.000003) virtual 080#\n");
}

TEST_CASE("a log that cannot be opened again ends until it can") {
  const LogFile file;
  std::vector<std::string> warnings;
  CandumpLog log({.path = file.path()}, [&](const std::string& text) { warnings.push_back(text); });
  REQUIRE(unlink(file.path().c_str()) == 0);
  REQUIRE(mkdir(file.path().c_str(), 0700) == 0);
  CHECK(log.reopen());
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].starts_with("log " + file.path() + ": Is a directory; the log ends here"));
  REQUIRE(rmdir(file.path().c_str()) == 0);
  log.on_bus_frame(kSync, 1);
  CHECK(log.reopen());
  log.on_bus_frame(kSync, 2);
  log.flush();
  CHECK(file.text() == "(0000000000.000002) virtual 080#\n");
  CHECK_FALSE(CandumpLog({.path = "/dev/null"}, nullptr).reopen());
}

TEST_CASE("a file that is full becomes path.1, counting what it had at the start") {
  constexpr std::size_t kLine = 33;  // "(0000000000.000000) virtual 080#\n"
  const LogFile file;
  std::ofstream(file.path()) << std::string(kLine, 'x');
  CandumpLog log({.path = file.path(), .content = kKept, .most = 2 * kLine}, nullptr);
  for (Time at = 1; at <= 4; ++at) {
    log.on_bus_frame(kSync, at);
    log.flush();
  }
  CHECK(test::text_of(file.path() + ".1") ==
        "(0000000000.000002) virtual 080#\n(0000000000.000003) virtual 080#\n");
  CHECK(file.text() == "(0000000000.000004) virtual 080#\n");
}

TEST_CASE("where path.1 cannot be, the log is started again in its place") {
  const LogFile file;
  std::vector<std::string> warnings;
  REQUIRE(mkdir((file.path() + ".1").c_str(), 0700) == 0);
  CandumpLog log({.path = file.path(), .most = 40},
                 [&](const std::string& text) { warnings.push_back(text); });
  for (Time at = 1; at <= 2; ++at) {
    log.on_bus_frame(kSync, at);
    log.flush();
  }
  CHECK(file.text() == "(0000000000.000002) virtual 080#\n");
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0] == "log " + file.path() + ": Is a directory; it begins again in the same place");
}

TEST_CASE("a burst does not pile up in memory until the flush") {
  const LogFile file;
  CandumpLog log({.path = file.path()}, nullptr);
  for (int i = 0; i < 10'000; ++i)
    log.on_bus_frame(kSync, 0);
  CHECK(file.text().size() > 200'000);
}

TEST_CASE("a full disk is reported once, and the bus goes on") {
  std::vector<std::string> warnings;
  CandumpLog log({.path = "/dev/full"}, [&](const std::string& text) { warnings.push_back(text); });
  for (int turn = 0; turn < 3; ++turn) {
    log.on_bus_frame(kSync, 0);
    log.flush();
  }
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0] ==
        "log /dev/full: No space left on device; the log ends here, the simulation goes on; make room, or "
        "write it to another disk");
}

}  // namespace
}  // namespace cbcan::io
