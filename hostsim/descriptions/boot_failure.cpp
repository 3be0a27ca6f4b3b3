// SPDX-License-Identifier: MIT
#include "descriptions/boot_failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/sdo_abort_codes.hpp"

namespace cbcan::descriptions {

namespace {

constexpr auto kTimeOut = static_cast<std::uint32_t>(AbortCode::kTimeOut);

// Values in regmap::kBootSteps.
constexpr unsigned kRuns = 1;
constexpr unsigned kCheck = 3;
constexpr unsigned kConfiguration = 4;
constexpr unsigned kAwaitsStart = 6;
constexpr unsigned kAwaitsData = 7;

constexpr std::array<std::pair<char, std::string_view>, 12> kSubjects{{
    {'C', "device type"},
    {'D', "vendor-ID"},
    {'M', "product code"},
    {'N', "revision number"},
    {'O', "serial number"},
    {'B', "no response"},
    {'J', "configuration failed"},
    {'K', "no heartbeat"},
    {'F', "no response to node guarding"},
    {BootFailure::kAlike,
     "modules without a node ID differ in the serial number only: give it, or connect one at a time"},
    {BootFailure::kKept, "already Operational, so it has not been configured"},
    {BootFailure::kLost, "lost: no heartbeat"},
}};
constexpr std::size_t kChecks = 5;  // first rows of kSubjects

/// A lost node.
bool is_guarded(const BootFailure& failure) {
  return failure.letter == BootFailure::kLost && failure.index == object::kGuardTime;
}

std::string cause(const BootFailure& failure) {
  const auto row = std::ranges::find(kSubjects, failure.letter, &decltype(kSubjects)::value_type::first);
  std::string text(row == kSubjects.end() ? "failed" : row->second);
  if (is_guarded(failure)) text = "lost: no response to node guarding";
  const bool is_silent = failure.letter == 'F' || failure.letter == 'K';
  if (is_silent && failure.step == kAwaitsStart) text += " that reports Operational";
  if (failure.silent_ms != 0) return text + fmt::format(" for {} ms", failure.silent_ms);
  if (failure.seen)
    return text + fmt::format(" {:08X}h, the network file wants {:08X}h", *failure.seen, failure.wanted);
  if (failure.code == 0)
    return row < kSubjects.begin() + kChecks ? text + " differs from the network file" : text;
  if (failure.letter == 'B' && failure.index == object::kDeviceType && failure.code == kTimeOut)
    return failure.step == kConfiguration ? "no boot-up message after its reset" : text;
  return text + fmt::format(" at {:04X}h:{:02X}{}{}: {}", failure.index, failure.sub,
                            failure.name.empty() ? "" : " ", failure.name, abort_text(failure.code));
}

/// NET-13: what a time-out or an abort 0800 002xh reports may pass.
std::string_view what_next(const BootFailure& failure) {
  const bool waits = failure.letter == 'B' && failure.step != kCheck && failure.step != kConfiguration;
  const bool may_pass = std::string_view("BFK").find(failure.letter) != std::string_view::npos ||
                        failure.code == kTimeOut || failure.code >> 4 == 0x0800002;
  if (failure.is_own || failure.letter == BootFailure::kKept) return "";
  if (is_guarded(failure)) return "; it is asked again each guard time";
  if (failure.letter == BootFailure::kLost || failure.letter == BootFailure::kAlike)
    return "; it is looked for each second";
  if (!may_pass) return "; it is not started";
  if (failure.step == 0) return "; it is tried again";
  return waits ? "; it is looked for each second" : "; it is tried again after 1, 2, 4 .. 60 s";
}

}  // namespace

std::string abort_text(std::uint32_t code) {
  const regmap::AbortRow* const row = regmap::find_abort(code);
  return fmt::format("{:04X} {:04X}h {}", code >> 16, code & 0xFFFF,
                     row == nullptr ? "an abort code of the node's own" : row->meaning);
}

BootFailure boot_failure_from(std::span<const std::uint8_t, 8> bytes) {
  return {.letter = static_cast<char>(bytes[7]),
          .index = static_cast<std::uint16_t>(bytes[4] | bytes[5] << 8),
          .sub = bytes[6],
          .code = load_word(bytes.data())};
}

std::string failure_text(const BootFailure& failure) {
  const std::string letter = failure.letter == BootFailure::kLost ? "" : fmt::format(" ({})", failure.letter);
  return cause(failure) + letter + std::string(what_next(failure));
}

std::string boot_step_text(unsigned word) {
  const unsigned step = word >> 8;
  if ((step >= 'A' && step <= 'O') || step == BootFailure::kAlike)
    return failure_text({.letter = static_cast<char>(step)});
  const std::string_view name = regmap::meaning_of(regmap::kBootSteps, step);
  const bool unwatched = word == kRuns << 8 || word == kAwaitsData << 8;
  return name.empty() ? fmt::format("unknown step {:02X}h", step)
                      : fmt::format("{}{}", name, unwatched ? ", not watched" : "");
}

}  // namespace cbcan::descriptions
