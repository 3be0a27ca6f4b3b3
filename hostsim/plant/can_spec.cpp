// SPDX-License-Identifier: MIT
#include "plant/can_spec.hpp"

#include <fmt/format.h>

#include <array>

#include "text/suggestion.hpp"
#include "text/words.hpp"

namespace cbcan::plant {
namespace {

constexpr std::string_view kVirtual = "virtual";
constexpr std::string_view kSocketCan = "socketcan";
constexpr std::array<std::string_view, 2> kKinds{kVirtual, kSocketCan};

/// Linux: IFNAMSIZ is 16 with the terminating zero.
constexpr std::size_t kLongestInterfaceName = 15;

bool looks_like_interface(std::string_view text) {
  return text.starts_with("can") || text.starts_with("vcan") || text.starts_with("slcan");
}

/// `spec` is `kind`, with ":" and an interface behind it or not.
std::string unknown_kind(std::string_view spec, std::string_view kind) {
  const std::string_view meant = text::nearest(kind, kKinds);
  const std::string_view tail = spec == kind ? ":vcan0" : spec.substr(kind.size());
  if (meant == kSocketCan) return fmt::format("no such bus; did you mean socketcan{}?", tail);
  if (meant == kVirtual) return "no such bus; did you mean virtual?";
  if (looks_like_interface(spec)) return fmt::format("no such bus; did you mean socketcan:{}?", spec);
  return "no such bus; write virtual or socketcan:vcan0";
}

std::string bad_interface(std::string_view name) {
  if (name.empty()) return "the interface is missing; write socketcan:vcan0";
  if (name.size() > kLongestInterfaceName) return "interface names have at most 15 characters";
  if (name.find_first_of(" \t/:") != std::string_view::npos) {
    return "interface names have no blank, slash or colon; write socketcan:vcan0";
  }
  return {};
}

}  // namespace

std::string check_can_spec(const Value& value) {
  const std::string_view spec = std::get<std::string>(value);
  const auto sides = text::split(spec, ':');
  const std::string_view kind = sides ? sides->first : spec;
  if (kind == kVirtual) return sides ? "the virtual bus has no interface; write virtual" : "";
  return kind == kSocketCan ? bad_interface(sides ? sides->second : "") : unknown_kind(spec, kind);
}

}  // namespace cbcan::plant
