// SPDX-License-Identifier: MIT
#include "session/addresses.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "base/utf8.hpp"
#include "base/words.hpp"
#include "plant/command_words.hpp"

namespace cbcan::session {

namespace {

constexpr std::string_view kSocketCan = "socketcan:";

/// "can=virtual slcan=127.0.0.1:29536"
std::string where_of(const NetworkAddresses& network) {
  const std::string prefix = plant::prefix_of(network.number);
  const auto server = [&prefix](std::string_view name, const std::optional<base::StreamAddress>& served) {
    return served ? fmt::format(" {}{}={}", prefix, name, to_string(*served)) : "";
  };
  return fmt::format("{0}can={1}{2}{3}{4}", prefix, network.can, server("slcan", network.slcan),
                     server("socketcand", network.socketcand),
                     network.plc.empty() ? "" : fmt::format(" {}plc={}", prefix, network.plc));
}

std::string ways_into(const NetworkAddresses& network) {
  std::string lines;
  const auto logger = [&](std::string_view client, const std::string& arguments) {
    lines +=
        fmt::format("{}{}: python3 -m can.logger -i {}\n", network.name, client, base::to_utf8(arguments));
  };
  const auto& slcan = network.slcan;
  const auto& socketcand = network.socketcand;
  if (slcan && slcan->path.empty())
    logger("slcan", "slcan -c socket://" + to_string(*slcan));
  else if (slcan && slcan->is_pty)
    logger("slcan", "slcan -c " + slcan->path);
  if (socketcand && socketcand->path.empty())
    logger("socketcand",
           fmt::format("socketcand -c can0 --host={} --port={}", socketcand->tcp.host, socketcand->tcp.port));
  if (network.can.starts_with(kSocketCan))
    lines += fmt::format("{}socketcan: candump {}\n", network.name, network.can.substr(kSocketCan.size()));
  return lines;
}

}  // namespace

std::string Addresses::where() const {
  std::string text;
  if (modbus) text += "modbus=" + to_string(*modbus) + " ";
  if (!rtu.empty()) text += "rtu=" + rtu + " ";
  if (rtu_tcp) text += "rtu_tcp=" + to_string(*rtu_tcp) + " ";
  for (const NetworkAddresses& network : networks)
    text += (network.number == 1 ? "" : " ") + where_of(network);
  if (control) text += " control=" + to_string(*control);
  if (http) text += " http=" + to_string(*http);
  return text;
}

std::string Addresses::ways_in() const {
  std::string lines;
  for (const NetworkAddresses& network : networks)
    lines += ways_into(network);
  return lines;
}

std::vector<std::string> Addresses::environment() const {
  std::vector<std::string> lines;
  const std::string text = where();
  for (const std::string_view word : base::words_of(text)) {
    const auto [name, value] = base::split(word, '=').value_or(std::pair(word, std::string_view()));
    const auto [number, key] = base::split(name, '/').value_or(std::pair(std::string_view(), name));
    std::string line = fmt::format("CBCAN_{}{}{}=", key, number.empty() ? "" : "_", number);
    std::ranges::transform(line, line.begin(), [](char c) {
      return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    lines.push_back(line.append(value));
  }
  return lines;
}

}  // namespace cbcan::session
