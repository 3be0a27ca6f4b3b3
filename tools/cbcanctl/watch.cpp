// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <iostream>
#include <thread>

#include "cbcanctl/commands.hpp"

namespace cbcan::ctl {

namespace {

std::string_view name_of(std::uint16_t address) {
  for (const regmap::RegisterRow& row : regmap::kWindow)
    if (address >= row.first && address <= row.last) return row.name;
  return {};
}

std::string json(std::uint16_t address, std::uint16_t word) {
  return fmt::format(R"({{"register": {}, "name": {}, "value": {}}})", address,
                     tools::json_string(name_of(address)), word);
}

std::string describe(std::uint16_t address, std::uint16_t word) {
  std::string text;
  if (address == regmap::kExecuteFlag) {
    if (word == regmap::kExecute) text = "execute";
    for (const regmap::NamedNumber& row : regmap::kResults)
      if (row.value == word) text = row.name;
  }
  for (const regmap::NamedNumber& row : regmap::kCommands)
    if (address == regmap::kCommand && row.value == word) text = row.name;
  std::string result = fmt::format("R{} {} {:16} {:5} {:04X}h {}", address, regmap::modicon_number(address),
                                   name_of(address), word, word, text);
  while (result.ends_with(' '))
    result.pop_back();
  return result;
}

}  // namespace

void watch(const Options& options) {
  constexpr std::chrono::milliseconds kInterval{10};
  window::Client client = connect(options);
  std::vector<std::uint16_t> before = client.read(regmap::kWindowFirst, regmap::kWindowWords);
  int printed = 0;
  while (!interrupted()) {
    const std::vector<std::uint16_t> after = client.read(regmap::kWindowFirst, regmap::kWindowWords);
    for (std::size_t i = 0; i < after.size(); ++i) {
      if (after[i] == before[i]) continue;
      const auto address = static_cast<std::uint16_t>(regmap::kWindowFirst + i);
      std::cout << (options.json ? json(address, after[i]) : describe(address, after[i])) << std::endl;
      if (++printed == options.count) return;
    }
    before = after;
    std::this_thread::sleep_for(kInterval);
  }
}

}  // namespace cbcan::ctl
