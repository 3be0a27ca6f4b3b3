// SPDX-License-Identifier: MIT
#include "io/files/parameter_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "io/loop/system.hpp"
#include "support/catch.hpp"
#include "support/complaint.hpp"
#include "temporary_folder.hpp"

using cbcan::io::ParameterFile;
using cbcan::io::test::TemporaryFolder;
using cbcan::io::test::text_of;
using cbcan::sim::parameter_text;
using cbcan::sim::parse_parameters;
using cbcan::sim::StoredParameters;

namespace {

const StoredParameters kParameters{
    .values = {{0x1017, 0, {0xE8, 0x03}}, {0x2010, 0x1F, {}}, {0x6207, 1, {0xAA}}}, .lss = {5, 250000}};

std::string complaint(const std::string& text) {
  return cbcan::test::complaint_of<cbcan::io::UsageError>([&] { parse_parameters(text, "drive.par"); });
}

}  // namespace

TEST_CASE("Stored parameters: a line for each value, low byte first") {
  const std::string text = parameter_text(kParameters);
  CHECK(text.front() == '#');
  CHECK(text.ends_with("\nnode-id = 5\nbit-rate = 250000\n1017:00 = E803\n2010:1F = \n6207:01 = AA\n"));
  CHECK(parse_parameters(text, "") == kParameters);
  CHECK(parse_parameters(" 1017 : 0=e803\r\n\n# no\n6207:1 = aa", "") ==
        StoredParameters{.values = {kParameters.values[0], kParameters.values[2]}, .lss = {}});
  CHECK(parameter_text({}).find('=') == parameter_text({}).rfind('='));  // the heading's
}

TEST_CASE("Stored parameters: errors are reported with file and line") {
  for (const char* const line :
       {"1017 = E803", "1017:00 E803", "1017:00 = E80", "10170:00 = 01", "1017:100 = 01",
        "= : ", "1017:00 = G0", "node-id = 0", "node-id = 128", "bit-rate = x"})
    CHECK(complaint(std::string("# heading\n") + line + "\n") ==
          "drive.par:2: \"" + std::string(line).substr(0, std::string(line).find_last_not_of(' ') + 1) +
              "\": write INDEX:SUB = BYTES in hexadecimal, such as 1017:00 = E803, node-id = 1..127 or "
              "bit-rate = 250000");
}

TEST_CASE("A parameter file that is not there is empty, and is made when something is stored") {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  ParameterFile file(folder.file("5.par"), [&](const std::string& line) { warnings.push_back(line); });
  CHECK(file.load() == StoredParameters{});
  CHECK(file.save(kParameters));
  CHECK(file.load() == kParameters);
  CHECK(file.save({}));
  CHECK(file.load() == StoredParameters{});
  CHECK(warnings.empty());
}

TEST_CASE("A link where the new file is made is not followed") {
  const TemporaryFolder folder;
  std::ofstream(folder.file("other")) << "other";
  REQUIRE(::symlink(folder.file("other").c_str(), folder.file("5.par.new").c_str()) == 0);
  ParameterFile file(folder.file("5.par"), [](const std::string& line) { FAIL(line); });
  CHECK(file.save(kParameters));
  CHECK(text_of(folder.file("other")) == "other");
  CHECK(file.load() == kParameters);
  struct stat status {};
  REQUIRE(::lstat(folder.file("5.par").c_str(), &status) == 0);
  CHECK(S_ISREG(status.st_mode));
}

TEST_CASE("Stored values that do not fit are reported") {
  std::vector<std::string> warnings;
  ParameterFile file("5.par", [&](const std::string& line) { warnings.push_back(line); });
  file.tell_left_out({{0x1017, 0, {1}}, {0x2010, 0x1F, {}}});
  file.tell_left_out(std::vector<cbcan::sim::StoredValue>(21, {0x1017, 0, {1}}));
  REQUIRE(warnings.size() == 2);
  CHECK(warnings[0] == "5.par: left out, as the node has no such parameter of this length: 1017:00, 2010:1F");
  CHECK(warnings[1].ends_with(", 1017:00 and 1 more"));
}
