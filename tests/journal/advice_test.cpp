// SPDX-License-Identifier: MIT
// Modbus requests and commands, and the advice that they cause: advice.txt.
#include "plant/scripts.hpp"
#include "support/case_file.hpp"

namespace cbcan::plant::test {
namespace {

using namespace cbcan::test;

/// A plant with a Modbus server: the demo, or one whose lines begin with "+".
class Program {
 public:
  explicit Program(const FileCase& opening) {
    std::string text;
    for (const std::string& line : opening.given)
      if (line[0] == '+') text += line.substr(1) + "\n";
    plant_ = text.starts_with("demo\n") || text.empty()
                 ? demo(text.substr(std::min<std::size_t>(5, text.size())))
                 : plant_of(text);
    plant_->control().journal();
    for (std::size_t network = 1; network <= plant_->control().networks(); ++network)
      units_.push_back(&plant_->control().network(network));
    server_.emplace(units_, modbus::DeviceIdentity{"", "", ""});
  }

  /// The advice after these lines, without the lines known before.
  Lines play(const FileCase& each) {
    std::string asks = "advice";
    for (const std::string& line : each.given) {
      CAPTURE(line);
      if (line[0] == '+') continue;
      if (line == "end") {
        asks += " end";
        continue;
      }
      const auto words = base::words_of(line);
      if (words[0] == "fc")
        request(words);
      else
        CHECK_FALSE(plant_->execute(line).starts_with("error"));
    }
    Lines all = lines_of(plant_->execute(asks));
    all.pop_back();
    Lines since = all;
    std::erase_if(since, [this](const std::string& line) { return std::ranges::count(known_, line) != 0; });
    known_ = all;
    return since;
  }

 private:
  /// "fc CLIENT UNIT FUNCTION REGISTER WORD...": of FC 3 and 22 the words are as in the PDU.
  void request(const std::vector<std::string_view>& words) {
    std::vector<std::uint16_t> numbers;
    for (const std::string_view word : std::span(words).subspan(1))
      numbers.push_back(static_cast<std::uint16_t>(base::parse_integer(word).value()));
    const auto function = static_cast<std::uint8_t>(numbers[2]);
    std::vector<std::uint8_t> pdu{function};
    const auto add = [&pdu](std::uint16_t word) {
      pdu.push_back(static_cast<std::uint8_t>(word >> 8));
      pdu.push_back(static_cast<std::uint8_t>(word));
    };
    add(numbers[3]);
    const auto values = std::span(numbers).subspan(4);
    if (function == 16) {
      add(static_cast<std::uint16_t>(values.size()));
      pdu.push_back(static_cast<std::uint8_t>(2 * values.size()));
    }
    std::ranges::for_each(values, add);
    std::vector<std::uint8_t> adu{
        0, 1, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), static_cast<std::uint8_t>(numbers[1])};
    adu.insert(adu.end(), pdu.begin(), pdu.end());
    server_->execute(numbers[0], adu);
  }

  std::unique_ptr<VirtualPlant> plant_;
  std::vector<protocols::ModbusUnit*> units_;
  std::optional<protocols::ModbusServer> server_;
  Lines known_;
};

TEST_CASE("each mistake has its advice, and what is right has none") {
  std::optional<Program> program;
  for (const FileCase& each : cases_of("tests/journal/advice.txt")) {
    INFO(each.place);
    if (each.first) program.emplace(each);
    each.check(program->play(each));
  }
}

}  // namespace
}  // namespace cbcan::plant::test
