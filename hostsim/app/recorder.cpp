// SPDX-License-Identifier: MIT
#include "app/recorder.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "cbcan/regmap.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::app {

namespace {

using journal::Kind;

/// As TOML writes a text.
std::string toml_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text)
    result.append(c == '"' || c == '\\' ? "\\" : "") += c == '\t' ? ' ' : c;
  return result + '"';
}

}  // namespace

std::string plant_in_scenario(const std::string& plant_file) {
  if (plant_file.empty() || plant_file == "demo") return plant_file;
  return std::filesystem::absolute(plant_file).string();
}

Recorder::Recorder(const std::string& path, const std::string& plant, scenario::Control& control)
    : control_(control),
      file_(io::Output::open("record", path)),
      cursor_(control.journal(), journal::kinds_of({Kind::kEnded, Kind::kCommand})) {
  file_.add(plant.empty() ? "" : fmt::format("plant = {}\n", toml_text(plant)));
  file_.flush();
}

void Recorder::add_step(Time at, std::string_view keys) {
  file_.add(fmt::format("\n[[step]]\nat = \"{}us\"\n{}", at, keys));
  file_.flush();
}

void Recorder::on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words) {
  look();
  add_step(control_.now(),
           fmt::format("do = \"write {}{} {}\"\n", scenario::prefix_of(network), first, text::joined(words)));
}

void Recorder::look() {
  cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    if (event.kind == Kind::kEnded) on_ended(event);
    if (event.kind == Kind::kCommand)
      add_step(event.at, fmt::format("do = {}\n", toml_text(control_.journal().text(event))));
    return true;
  });
}

void Recorder::on_ended(const journal::Event& event) {
  const std::string prefix = scenario::prefix_of(event.network);
  const auto registers = control_.read(event.network, regmap::kWindowFirst, regmap::kWindowWords);
  const bool is_read = registers[regmap::kCommand - regmap::kWindowFirst] == regmap::kSdoRead;
  const std::uint16_t result = registers[0];
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
