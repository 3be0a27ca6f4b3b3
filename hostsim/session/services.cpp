// SPDX-License-Identifier: MIT
#include "session/services.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/address.hpp"
#include "base/text.hpp"
#include "plant/command_words.hpp"

namespace cbcan::session {

namespace {

/// The command by which a program joins the bus; empty = there is none.
std::string way_in(const Service& service) {
  constexpr std::string_view kSocketCan = "socketcan:";
  if (service.place.empty()) return {};
  if (service.name == "can")
    return service.place.starts_with(kSocketCan)
               ? "socketcan: candump " + service.place.substr(kSocketCan.size())
               : "";
  const base::StreamAddress address = base::parse_stream_address(service.place);
  constexpr std::string_view kLogger = "python3 -m can.logger -i";
  if (service.name == "socketcand" && address.path.empty())
    return fmt::format("socketcand: {} socketcand -c can0 --host={} --port={}", kLogger, address.tcp.host,
                       address.tcp.port);
  if (service.name != "slcan" || (!address.path.empty() && !address.is_pty)) return {};
  return fmt::format("slcan: {} slcan -c {}", kLogger,
                     address.is_pty ? address.path : "socket://" + service.place);
}

}  // namespace

std::string key_of(const Service& service) {
  return (service.network == 0 ? "" : plant::prefix_of(service.network)).append(service.name);
}

const Service& Services::at(std::string_view name, std::size_t network) const {
  return *std::ranges::find_if(
      *this, [&](const Service& service) { return service.name == name && service.network == network; });
}

std::string Services::where() const {
  std::string text;
  for (const Service& service : *this)
    if (!service.place.empty())
      text += fmt::format("{}{}={}", text.empty() ? "" : " ", key_of(service), service.place);
  return text;
}

std::string Services::ways_in() const {
  std::string lines;
  const bool is_one = std::ranges::none_of(*this, [](const Service& each) { return each.network > 1; });
  for (const Service& bus : *this) {
    if (bus.name != "can") continue;
    for (const std::string_view name : {"slcan", "socketcand", "can"}) {
      const std::string way = way_in(at(name, bus.network));
      if (way.empty()) continue;
      lines += fmt::format("{}{}\n", is_one ? "" : fmt::format("network {}: ", bus.network),
                           cbcan::base::to_utf8(way));
    }
  }
  return lines;
}

std::vector<std::string> Services::environment() const {
  std::vector<std::string> lines;
  for (const Service& service : *this) {
    if (service.place.empty()) continue;
    std::string line = fmt::format("CBCAN_{}", service.name);
    if (service.network > 1) line += fmt::format("_{}", service.network);
    std::ranges::transform(line, line.begin(), [](char c) {
      return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    lines.push_back(line + "=" + service.place);
  }
  return lines;
}

}  // namespace cbcan::session
