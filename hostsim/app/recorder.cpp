// SPDX-License-Identifier: MIT
#include "app/recorder.hpp"

#include <fcntl.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>

#include "cbcan/regmap.hpp"
#include "io/errors.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

io::Descriptor open_file(const std::string& path) {
  constexpr mode_t kMode = 0644;
  io::Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode));
  if (!file) throw io::EnvironmentError("record " + path + ": " + io::reason(errno) + "; write another file");
  return file;
}

/// As TOML writes a text.
std::string toml_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text)
    result.append(c == '"' || c == '\\' ? "\\" : "") += c == '\t' ? ' ' : c;
  return result + '"';
}

/// Commands that change something.
bool is_recorded(std::string_view name) {
  static constexpr std::array<std::string_view, 9> kKnown{"set",   "incident", "power", "fault", "clear",
                                                          "write", "trigger",  "send",  "nmt"};
  return std::ranges::find(kKnown, name) != kKnown.end();
}

}  // namespace

Recorder::Recorder(const std::string& path, const std::string& plant, scenario::Control& control)
    : control_(control),
      file_(open_file(path)),
      transactions_(control, {"transactions"}, [this](std::string_view line) { on_event(line); }) {
  const std::string place =
      plant.empty() || plant == "demo" ? plant : std::filesystem::absolute(plant).string();
  file_.add(place.empty() ? "" : fmt::format("plant = {}\n", toml_text(place)));
  file_.flush();
}

void Recorder::add_step(std::string_view keys) {
  file_.add(fmt::format("\n[[step]]\nat = \"{}us\"\n{}", control_.now(), keys));
  file_.flush();
}

void Recorder::on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words) {
  add_step(fmt::format("do = \"write {}{} {}\"\n", scenario::prefix_of(network), first, text::joined(words)));
}

void Recorder::on_command(std::string_view line) {
  const auto words = text::words_of(line);
  if (!words.empty() && is_recorded(words.front()))
    add_step(fmt::format("do = {}\n", toml_text(text::trim(line))));
}

void Recorder::look() {
  transactions_.look();
}

/// "at 1.000000 transaction 2/ended"
void Recorder::on_event(std::string_view line) {
  const std::string_view what = text::words_of(line).back();
  if (!what.ends_with("ended")) return;
  const std::size_t network = scenario::where(what, control_.networks()).network;
  const auto registers = control_.read(network, regmap::kWindowFirst, regmap::kWindowWords);
  const bool is_read = registers[regmap::kCommand - regmap::kWindowFirst] == regmap::kSdoRead;
  const std::uint16_t result = registers[0];
  const std::string prefix = scenario::prefix_of(network);
  std::string expected = fmt::format("\"register {}{} = {}\"", prefix, regmap::kWindowFirst, result);
  const auto expect = [&](std::uint16_t first, std::size_t count) {
    const auto words = std::span(registers).subspan(first - regmap::kWindowFirst, count);
    expected += fmt::format(", \"register {}{} = {}\"", prefix, first, text::joined(words));
  };
  const std::size_t bytes =
      std::min<std::size_t>(registers[regmap::kDataSize - regmap::kWindowFirst], regmap::kMaxDataBytes);
  if (result == 0 && is_read) expect(regmap::kDataSize, 1 + (bytes + 1) / 2);
  if (result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError)) expect(regmap::kData, 2);
  file_.add(fmt::format("\n[[step]]\nwait = \"register {}{} != {}\"\nexpect = [{}]\n", prefix,
                        regmap::kWindowFirst, regmap::kExecute, expected));
  file_.flush();
}

}  // namespace cbcan::app
