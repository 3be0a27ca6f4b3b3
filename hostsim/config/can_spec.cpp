// SPDX-License-Identifier: MIT
#include "config/can_spec.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/slcan/slcan.hpp"

namespace cbcan::config {
namespace {

/// Linux: IFNAMSIZ is 16 with the terminating zero.
constexpr std::size_t kLongestInterfaceName = 15;
constexpr std::size_t kLongestBusName = 16;
constexpr std::uint32_t kBitsPerKbit = 1000;

constexpr std::array<std::string_view, 4> kKinds{"socketcan", "slcan", "socketcand", "virtual"};
/// Examples in messages about missing parts.
constexpr std::array<std::string_view, 3> kExamples{"socketcan:vcan0", "slcan:/dev/ttyACM0",
                                                    "socketcand:127.0.0.1:29536/can0"};

[[noreturn]] void refuse(const std::string& why) {
  throw base::UsageError(why);
}

bool looks_like_interface(std::string_view text) {
  return text.starts_with("can") || text.starts_with("vcan") || text.starts_with("slcan");
}

/// `spec` is `kind`, or begins with `kind` and ":".
[[noreturn]] void refuse_kind(std::string_view spec, std::string_view kind) {
  const std::string_view meant = base::nearest(kind, kKinds);
  if (meant == kKinds.back()) refuse("no such bus; did you mean virtual?");
  if (looks_like_interface(spec)) refuse(fmt::format("no such bus; did you mean socketcan:{}?", spec));
  if (meant.empty()) refuse("no such bus; write virtual or socketcan:vcan0");
  const auto place = static_cast<std::size_t>(std::ranges::find(kKinds, meant) - kKinds.begin());
  const std::string tail(spec == kind ? kExamples[place].substr(meant.size()) : spec.substr(kind.size()));
  refuse(fmt::format("no such bus; did you mean {}{}?", meant, tail));
}

std::string interface_of(std::string_view name) {
  if (name.empty()) refuse("the interface is missing; write socketcan:vcan0");
  if (name.size() > kLongestInterfaceName) refuse("interface names have at most 15 characters");
  if (name.find_first_of(" \t/:") != std::string_view::npos)
    refuse("interface names have no blank, slash or colon; write socketcan:vcan0");
  return std::string(name);
}

base::ListenAddress remote_of(std::string_view text, std::string_view example) {
  base::ListenAddress address;
  if (!text.empty()) address = base::parse_listen_address(text, 0);
  if (address.port == 0) refuse(fmt::format("the address is missing, or its port; write {}", example));
  return address;
}

std::uint16_t kbit_of(std::string_view text) {
  const auto rate = base::parse<std::uint32_t>(text);
  if (rate && *rate % kBitsPerKbit == 0 &&
      std::ranges::find(slcan::kBitRates, *rate / kBitsPerKbit) != slcan::kBitRates.end())
    return static_cast<std::uint16_t>(*rate / kBitsPerKbit);
  refuse(fmt::format(
      "\"{}\" is no bit rate of an adapter; those are 10000, 20000, 50000, 100000, 125000, 250000, "
      "500000, 800000 and 1000000",
      text));
}

CanSpec adapter_of(std::string_view text) {
  CanSpec spec{.kind = CanSpec::Kind::kSlcan, .name = {}, .remote = {}};
  if (const std::size_t at = text.rfind('@'); at != std::string_view::npos) {
    spec.kbit = kbit_of(text.substr(at + 1));
    text = text.substr(0, at);
  }
  if (text.starts_with('/'))
    spec.name = text;
  else
    spec.remote = remote_of(text, "slcan:/dev/ttyACM0 or slcan:HOST:PORT");
  return spec;
}

CanSpec socketcand_of(std::string_view text) {
  const auto [address, bus] = base::split(text, '/').value_or(std::pair(text, std::string_view()));
  if (bus.empty() || bus.size() > kLongestBusName || bus.find_first_of(" \t<>") != std::string_view::npos)
    refuse("the remote bus is missing, has a blank or more than 16 characters; write " +
           std::string(kExamples[2]));
  return {CanSpec::Kind::kSocketcand, std::string(bus), remote_of(address, kExamples[2])};
}

}  // namespace

CanSpec parse_can_spec(std::string_view spec) {
  const auto [kind, rest] = base::split(spec, ':').value_or(std::pair(spec, std::string_view()));
  if (kind == kKinds[0]) return {CanSpec::Kind::kSocketCan, interface_of(rest), {}};
  if (kind == kKinds[1]) return adapter_of(rest);
  if (kind == kKinds[2]) return socketcand_of(rest);
  if (kind == kKinds.back()) refuse("the virtual bus has no interface; write virtual");
  refuse_kind(spec, kind);
}

}  // namespace cbcan::config
