// SPDX-License-Identifier: MIT
// Commands at run time and what they cause; most of them: sessions.txt.
#include "journal_lines.hpp"
#include "scripts.hpp"
#include "support/case_file.hpp"

namespace cbcan::plant::test {
namespace {

using namespace cbcan::test;

/// The plants that sessions name.
const std::string kDevices = R"([module]
enabled = false
[[node]]
id = 0x42
eds = "demo:/io_module.eds"
name = "I/O"
[[node]]
id = 16
eds = "demo:/drive.eds"
)";
const std::string kNetworks = kDevices + R"([[network]]
[network.module]
enabled = false
[[network.node]]
id = 16
eds = "demo:/drive.eds"
name = "Other"
[[network.node]]
lss = true
eds = "demo:/drive.eds"
)";

/// A plant from the lines after "+", with the script t.lua from those after "|"; without any, the demo plant.
class Session {
 public:
  explicit Session(const FileCase& opening) : plant_(of(opening)) {}

  /// Executes the commands; the lines of the last response.
  Lines play(const FileCase& each) {
    Lines response;
    for (const std::string& line : each.given) {
      if (line[0] == '+' || line[0] == '|') continue;
      CAPTURE(line, response);
      CHECK((response.empty() || !response[0].starts_with("error")));
      response = line == "frames"    ? frames()
                 : line == "journal" ? journal_lines()
                                     : lines_of(plant_->execute(line));
    }
    return response;
  }

 private:
  static std::string after(char mark, const FileCase& opening) {
    std::string text;
    for (const std::string& line : opening.given)
      if (line[0] == mark) text += line.substr(1) + "\n";
    return text;
  }
  static std::unique_ptr<VirtualPlant> of(const FileCase& opening) {
    std::string text = after('+', opening);
    if (text.empty()) return demo();
    if (text.starts_with("demo\n")) return demo(text.substr(5));
    if (text == "@devices\n") text = kDevices;
    if (text == "@networks\n") text = kNetworks;
    return plant_of(text, script(after('|', opening)));
  }
  /// Those since the last call, in one line.
  Lines frames() {
    const Lines seen = std::exchange(frames_.seen, {});
    return seen.empty() ? Lines{} : Lines{fmt::format("{}", fmt::join(seen, " "))};
  }
  Lines journal_lines() {
    if (!journal_) journal_.emplace(*plant_);
    return journal_->lines();
  }

  std::unique_ptr<VirtualPlant> plant_;
  Frames frames_{*plant_};
  std::optional<JournalLines> journal_;
};

TEST_CASE("each command of the sessions has its response") {
  std::optional<Session> session;
  for (const FileCase& each : cases_of("tests/plant/sessions.txt")) {
    INFO(each.place);
    if (each.first) session.emplace(each);
    each.check(session->play(each));
  }
}

TEST_CASE("help lists the commands; a line without a command has no response") {
  const auto plant = demo();
  const std::string help = plant->execute("help");
  CHECK(help.starts_with("nodes "));
  CHECK(help.ends_with("\nok\n"));
  CHECK(plant->execute("").empty());
  CHECK(plant->execute("  ").empty());
}

TEST_CASE("a text that is no line of a response is shown as bytes") {
  const auto plant = demo();
  ObjectDictionary& dictionary = plant->control().world(1).nodes()[0]->device().dictionary();
  ObjectEntry entry{};
  REQUIRE(dictionary.find(0x1008, 0, entry) == AbortCode::kNone);
  dictionary.store(entry, 0, std::array<std::uint8_t, 3>{'a', '\n', 'b'});
  CHECK(plant->execute("get #1 0x1008") == "ok \"hex:61 0A 62\"\n");
}

TEST_CASE("a long list of faults is cut with a word") {
  const auto plant = plant_of(kDevices);
  for (int i = 0; i < 600; ++i) {
    plant->execute("fault 66 response-never");
    plant->execute("fault 16 response-never");
  }
  const std::string list = plant->execute("faults");
  CHECK(std::ranges::count(list, '\n') == 1002);
  CHECK(list.ends_with("\n#2 400 response-never occasions=0 fired=0\nand 200 more\nok\n"));
  CHECK(plant->execute("faults 66").ends_with("\n66 600 response-never occasions=0 fired=0\nok\n"));
}

TEST_CASE("control characters do not come back") {
  const auto plant = demo();
  CHECK(plant->execute("\x1b[31m\x7f") == "error: \" [31m \": no such command; help lists them\n");
  CHECK(plant->execute("get \a1 0x6041") == "error: node \" 1\": must be 1..127\n");
}

TEST_CASE("a listener hears each frame of each network once, also when it comes again") {
  const auto plant = plant_of(kNetworks);
  Lines seen;
  for (int i = 0; i < 2; ++i) {
    const Frames frames(*plant);
    plant->execute("send 123#");
    plant->execute("send 2/124#");
    seen.insert(seen.end(), frames.seen.begin(), frames.seen.end());
  }
  plant->execute("send 2/125#");
  CHECK(seen == Lines{"123#", "2/124#", "123#", "2/124#"});
}

TEST_CASE("shutdown is for the owner of the plant") {
  const auto plant = demo();
  CHECK(plant->control().execute("shutdown", 0).shutdown);
  CHECK_FALSE(plant->control().execute("time", 0).shutdown);
}

}  // namespace
}  // namespace cbcan::plant::test
