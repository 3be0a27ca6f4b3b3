// SPDX-License-Identifier: MIT
#include "io/files/captures.hpp"

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
  CandumpLog log(file.path(), "can3", 1'700'000'000 * kSecond, [](const std::string& line) { FAIL(line); });
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
  { CandumpLog(file.path(), "can3", 0, nullptr).on_bus_frame(kSync, 0); }
  CHECK(file.text() == "(0000000000.000000) can3 080#\n");
}

TEST_CASE("a burst does not pile up in memory until the flush") {
  const LogFile file;
  CandumpLog log(file.path(), "can3", 0, nullptr);
  for (int i = 0; i < 10'000; ++i)
    log.on_bus_frame(kSync, 0);
  CHECK(file.text().size() > 200'000);
}

TEST_CASE("a full disk is reported once, and the bus goes on") {
  std::vector<std::string> warnings;
  CandumpLog log("/dev/full", "can3", 0, [&](const std::string& text) { warnings.push_back(text); });
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
