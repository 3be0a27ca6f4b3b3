// SPDX-License-Identifier: MIT
#include "descriptions/failures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/sdo/abort_code.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/sdo_abort_codes.hpp"

namespace cbcan::descriptions {

namespace {

struct Meaning {
  std::uint16_t code;
  std::uint16_t mask;  ///< which bits of a code are compared
  std::string_view words;
};

constexpr std::uint16_t kExactly = 0xFFFF;
constexpr std::uint16_t kClass = 0xFF00;
constexpr std::uint16_t kGroup = 0xF000;

/// CiA 301, table 26; the first row that matches is used. A class that is not listed belongs to its group:
/// 73xxh of drives to 70xxh.
constexpr std::array kMeanings{
    Meaning{0x8110, kExactly, "CAN overrun, objects lost"},
    Meaning{0x8120, kExactly, "CAN in error passive mode"},
    Meaning{0x8130, kExactly, "life guard error or heartbeat error"},
    Meaning{0x8140, kExactly, "recovered from bus off"},
    Meaning{0x8150, kExactly, "CAN-ID collision"},
    Meaning{0x8210, kExactly, "PDO not processed due to length error"},
    Meaning{0x8220, kExactly, "PDO length exceeded"},
    Meaning{0x8230, kExactly, "DAM MPDO not processed, destination object not available"},
    Meaning{0x8240, kExactly, "unexpected SYNC data length"},
    Meaning{0x8250, kExactly, "RPDO timeout"},
    Meaning{0x2100, kClass, "current, input side"},
    Meaning{0x2200, kClass, "current inside the device"},
    Meaning{0x2300, kClass, "current, output side"},
    Meaning{0x3100, kClass, "mains voltage"},
    Meaning{0x3200, kClass, "voltage inside the device"},
    Meaning{0x3300, kClass, "output voltage"},
    Meaning{0x4100, kClass, "ambient temperature"},
    Meaning{0x4200, kClass, "device temperature"},
    Meaning{0x6100, kClass, "internal software"},
    Meaning{0x6200, kClass, "user software"},
    Meaning{0x6300, kClass, "data set"},
    Meaning{0x8100, kClass, "communication"},
    Meaning{0x8200, kClass, "protocol error"},
    Meaning{0xFF00, kClass, "device-specific"},
    Meaning{0x0000, kGroup, "no error, or an error has ended"},
    Meaning{0x1000, kGroup, "generic error"},
    Meaning{0x2000, kGroup, "current"},
    Meaning{0x3000, kGroup, "voltage"},
    Meaning{0x4000, kGroup, "temperature"},
    Meaning{0x5000, kGroup, "device hardware"},
    Meaning{0x6000, kGroup, "device software"},
    Meaning{0x7000, kGroup, "additional modules"},
    Meaning{0x8000, kGroup, "monitoring"},
    Meaning{0x9000, kGroup, "external error"},
    Meaning{0xF000, kGroup, "additional functions"},
};

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

EmergencyMessage emergency_from(std::span<const std::uint8_t, EmergencyMessage::kSize> bytes) {
  EmergencyMessage message;
  message.code = static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
  message.error_register = bytes[2];
  std::copy(bytes.begin() + 3, bytes.end(), message.info.begin());
  return message;
}

std::string_view emergency_meaning(std::uint16_t code) {
  for (const Meaning& row : kMeanings)
    if ((code & row.mask) == row.code) return row.words;
  return "a code that CiA 301 reserves";
}

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
