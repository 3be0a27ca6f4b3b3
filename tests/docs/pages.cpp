// SPDX-License-Identifier: MIT
// cbcan-pages PAGE: prints the page, with the text between `<!-- generated: WHAT -->` and `<!-- end -->`
// generated from the tables of the program. tools/dev/update rewrites the pages.

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/command.hpp"
#include "base/error.hpp"
#include "base/read_file.hpp"
#include "base/text.hpp"
#include "cbcan/mistakes.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/sdo_abort_codes.hpp"
#include "config/plant_settings.hpp"
#include "config/run_options.hpp"
#include "descriptions/network_file.hpp"
#include "plant/control.hpp"
#include "scenario/scenario.hpp"
#include "scenario/search/search_settings.hpp"

namespace {

namespace regmap = cbcan::regmap;
using cbcan::base::Row;
using Words = std::vector<std::string_view>;

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error(why);
}

std::string sentences(std::string_view first, std::string_view more) {
  return fmt::format("{}.{}{}", first, more.empty() ? "" : " ", more);
}

/// Such as "sine, noise".
std::string shapes_of(cbcan::base::Kinds kinds) {
  std::string names;
  for (std::size_t shape = kinds.first; shape <= kinds.last; ++shape)
    names.append(names.empty() ? "" : ", ").append(cbcan::config::kShapeNames[shape]);
  return names;
}

std::string meaning(const Row& row) {
  return sentences(row.help, row.more);
}

/// settings TABLE: its keys; for signals those of all shapes, and with "shapes" those of each shape.
std::string settings(const Words& words) {
  const bool of_shapes = words.size() > 2;
  std::string rows = fmt::format("| {}Key | Value | Default | Meaning |\n|{}---|---|---|---|\n",
                                 of_shapes ? "Shape | " : "", of_shapes ? "---|" : "");
  cbcan::config::for_each_setting([&](const auto& row) {
    const bool of_all = row.kinds == cbcan::base::Kinds();
    if (cbcan::base::table_of(row.key) != words[1] || of_all == of_shapes) return;
    const std::string shape = of_shapes ? shapes_of(row.kinds) + " | " : "";
    rows += fmt::format("| {}`{}` | {} | {} | {} |\n", shape, row.key, domain_of(row),
                        cbcan::config::standard_of(row), meaning(row));
  });
  return rows;
}

/// network-keys TABLE
std::string network_keys(const Words& words) {
  std::string table = "| Key | Value | Default | Meaning |\n|---|---|---|---|\n";
  const auto add = [&table](const auto& rows, const auto& standard) {
    for (const auto& row : rows)
      table += fmt::format("| `{}` | {} | {} | {} |\n", row.key, domain_of(row),
                           row.example.empty() ? text_in(row, standard, standard) : "required", meaning(row));
  };
  if (words.at(1) == "network") add(cbcan::descriptions::kNetworkRows, cbcan::descriptions::PlannedNetwork());
  if (words.at(1) == "node") add(cbcan::descriptions::kNodeRows, cbcan::descriptions::PlannedNode());
  if (words.at(1) == "pdos") add(cbcan::descriptions::kPdoRows, cbcan::descriptions::PlannedPdo());
  return table;
}

/// The row of a kind of fault, by its number in the table.
std::size_t kind_of(std::string_view name) {
  const auto rows = cbcan::sim::fault_rows();
  const auto row = std::ranges::find(rows, name, &cbcan::sim::FaultRow::name);
  if (row == rows.end()) refuse(fmt::format("{}: no such fault", name));
  return static_cast<std::size_t>(row - rows.begin());
}

/// fault-keys KIND KEY...: these keys of the kind, which others share.
std::string fault_keys(const Words& words) {
  const cbcan::sim::FaultRow& row = cbcan::sim::fault_rows()[kind_of(words.at(1))];
  std::string table = "| Key | Value | Default | Meaning |\n|---|---|---|---|\n";
  for (const auto* key : keys_of(row))
    if (std::ranges::find(words.begin() + 2, words.end(), key->key) != words.end())
      table += fmt::format("| `{}` | {} | {} | {} |\n", key->key, domain_of(*key),
                           text_in(*key, row.standard, row.standard), meaning(*key));
  return table;
}

/// fault-kinds FIRST LAST: these kinds with their own keys.
std::string fault_kinds(const Words& words) {
  std::string table = "| Kind | Own keys: value, default | What goes wrong |\n|---|---|---|\n";
  for (std::size_t kind = kind_of(words.at(1)); kind <= kind_of(words.at(2)); ++kind) {
    const cbcan::sim::FaultRow& row = cbcan::sim::fault_rows()[kind];
    std::string own;
    for (const auto& key : row.own)
      own += fmt::format("{}`{}` {}, {}: {}", own.empty() ? "" : "<br>", key.key, domain_of(key),
                         text_in(key, row.standard, row.standard), meaning(key));
    table += fmt::format("| `{}` | {} | {} |\n", row.name, own, row.meaning);
  }
  return table;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char letter : text)
    result.append(letter == '|' ? "\\" : "") += letter;
  return result;
}

std::string usages(std::string_view heading, const auto& rows) {
  std::string table = fmt::format("| {} | Meaning |\n|---|---|\n", heading);
  for (const cbcan::plant::Usage& row : rows)
    table += fmt::format("| `{}` | {} |\n", escaped(row.usage), sentences(row.meaning, row.more));
  return table;
}

/// Keys of a scenario's steps, or of [explore].
std::string line_keys(const auto& rows) {
  std::string table = "| Key | Value | Meaning |\n|---|---|---|\n";
  for (const Row& row : rows)
    table += fmt::format("| `{}` | {} | {} |\n", row.key, row.domain, meaning(row));
  return table;
}

/// explore-defaults: a line for each key with a list.
std::string explore_defaults() {
  const auto listed = [](const std::vector<std::string>& faults) {
    std::string list;
    for (const std::string& fault : faults)
      list += fmt::format("{}`{}`", list.empty() ? "" : ", ", fault);
    return list;
  };
  return fmt::format("| Key | Default |\n|---|---|\n| `faults` | {} |\n| `survive` | {} |\n",
                     listed(cbcan::search::default_faults()), listed(cbcan::search::default_survive()));
}

std::string exit_codes() {
  std::string table = "| Code | Program | Meaning |\n|---|---|---|\n";
  for (const cbcan::base::ExitCodeRow& row : cbcan::base::kExitCodes)
    table += fmt::format("| {} | {} | {} |\n", static_cast<int>(row.code), row.programs, row.meaning);
  return table;
}

// ---- The registers

/// registers TABLE: for the window also who writes them.
std::string registers(const Words& words) {
  static const std::map<std::string_view, std::span<const regmap::RegisterRow>> kTables{
      {"window", regmap::kWindow},
      {"scanner", regmap::kScanner},
      {"process-data", regmap::kProcessData},
      {"status", regmap::kStatus},
      {"diagnostics", regmap::kDiagnostics},
      {"board", regmap::kBoard}};
  const bool has_writer = words.at(1) == "window";
  std::string table = fmt::format("| Register | Name | {}Values | Meaning |\n|---|---|{}---|---|\n",
                                  has_writer ? "Written by | " : "", has_writer ? "---|" : "");
  for (const regmap::RegisterRow& row : kTables.at(words.at(1)))
    table += fmt::format("| R{}{} | {} | {}{} | {} |\n", row.first,
                         row.last == row.first ? "" : fmt::format("..R{}", row.last), row.name,
                         has_writer ? fmt::format("{} | ", name_of(row.writer)) : "", row.range, row.meaning);
  return table;
}

/// numbers TABLE
std::string numbers(const Words& words) {
  static const std::map<std::string_view, std::span<const regmap::NamedNumber>> kTables{
      {"commands", regmap::kCommands},
      {"results", regmap::kResults},
      {"scanner-results", regmap::kScannerResults},
      {"mistakes", regmap::kMistakes},
      {"status-bits", regmap::kStatusBits},
      {"boot-steps", regmap::kBootSteps},
      {"node-requests", regmap::kNodeRequests},
      {"node-states", regmap::kNodeStates}};
  std::string table = "| Value | Name | Meaning |\n|---|---|---|\n";
  for (const regmap::NamedNumber& row : kTables.at(words.at(1)))
    table += fmt::format("| {} | {} | {} |\n", row.value, row.name, row.meaning);
  return table;
}

std::string nmt_services() {
  std::string table = "| R3706 | or | Command specifier | Service |\n|---|---|---|---|\n";
  for (const regmap::NmtRow& row : regmap::kNmtCommands)
    table += fmt::format("| {} | {} | {:02X}h | {} |\n", row.state_code, row.command_code, row.specifier,
                         row.name);
  return table;
}

std::string abort_codes() {
  std::string table = "| Code | Name | Meaning | Table 3 |\n|---|---|---|---|\n";
  for (const regmap::AbortRow& row : regmap::kAbortCodes)
    table += fmt::format("| {:04X} {:04X}h | {} | {} | {} |\n", row.code >> 16, row.code & 0xFFFF, row.name,
                         row.meaning, row.in_table_3 ? "yes" : "");
  return table;
}

/// editions: the settings that the npm package has not, or not alone.
std::string editions() {
  const std::map<std::string_view, std::string_view> dependencies{
      {"rtu.device", "`serialport`"},
      {"plc.address", "`jsmodbus`"},
      {"plc.device", "`jsmodbus` and `serialport`"},
      {"can.spec", "`serialport` for a serial port"},
  };
  std::string table = "| Setting | In the npm package |\n|---|---|\n";
  const auto add = [&](const Row& row) {
    const auto by = dependencies.find(row.key);
    std::string cell = by == dependencies.end() ? "" : fmt::format("with {}", by->second);
    if (!row.instead.empty())
      cell += fmt::format("{}: {}", cell.empty() ? "no" : "; no `socketcan`", row.instead);
    if (row.form == cbcan::base::Form::kAddress) cell = "`HOST:PORT` alone";
    const std::string name(row.option.empty() ? row.key : cbcan::base::option_name(row.option));
    if (!cell.empty()) table += fmt::format("| `{}` | {} |\n", name, cell);
  };
  for (const auto& row : cbcan::config::kPlantSettings)
    add(row);
  for (const auto& row : cbcan::config::kNetworkSettings)
    add(row);
  for (const auto& row : cbcan::config::kRunSettings)
    add(row);
  return table;
}

std::string generated(const Words& words) {
  const std::string_view what = words.at(0);
  if (what == "settings") return settings(words);
  if (what == "network-keys") return network_keys(words);
  if (what == "fault-keys") return fault_keys(words);
  if (what == "fault-kinds") return fault_kinds(words);
  if (what == "commands") return usages("Command", cbcan::plant::command_usages());
  if (what == "conditions") return usages("Condition", cbcan::plant::condition_usages());
  if (what == "step-keys") return line_keys(cbcan::scenario::kStepKeys);
  if (what == "explore-defaults") return explore_defaults();
  if (what == "explore-keys") return line_keys(cbcan::search::kExploreKeys);
  if (what == "exit-codes") return exit_codes();
  if (what == "editions") return editions();
  if (what == "registers") return registers(words);
  if (what == "numbers") return numbers(words);
  if (what == "nmt-services") return nmt_services();
  if (what == "abort-codes") return abort_codes();
  refuse(fmt::format("generated: {}: nothing is generated under this name", what));
}

std::string renewed(std::string_view page) {
  constexpr std::string_view kBegin = "<!-- generated: ";
  constexpr std::string_view kEnd = " -->";
  constexpr std::string_view kOver = "<!-- end -->";
  std::string text;
  while (!page.empty()) {
    const std::string_view line = cbcan::base::take_line(page);
    text.append(line).append("\n");
    if (!line.starts_with(kBegin)) continue;
    if (!line.ends_with(kEnd)) refuse(fmt::format("{}: write <!-- generated: WHAT -->", line));
    text += generated(
        cbcan::base::words_of(line.substr(kBegin.size(), line.size() - kBegin.size() - kEnd.size())));
    const auto over = page.find(kOver);
    if (over == std::string_view::npos) refuse(fmt::format("{}: no {} below it", line, kOver));
    page.remove_prefix(over);
  }
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const auto page = argc == 2 ? cbcan::base::read_file(argv[1]) : std::nullopt;
    if (!page) refuse("usage: cbcan-pages PAGE");
    std::cout << renewed(*page);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "cbcan-pages: " << error.what() << "\n";
    return 1;
  }
}
