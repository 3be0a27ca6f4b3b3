// SPDX-License-Identifier: MIT
#include "app/manual_clock.hpp"

#include <algorithm>

#include "io/errors.hpp"
#include "text/numbers.hpp"

namespace cbcan::app {
namespace {

constexpr std::string_view kPass = "pass ";
constexpr Time kMost = 365 * 24 * 3600 * kSecond;

/// 0 = no such unit.
Time unit_of(std::string_view text) {
  if (text == "us") return 1;
  if (text == "ms") return kMillisecond;
  return text == "s" ? kSecond : 0;
}

[[noreturn]] void refuse(std::string_view line) {
  throw io::UsageError("standard input: \"" + std::string(line) +
                       "\": write pass and how long, a whole number of us, ms or s, such as pass 100ms");
}

}  // namespace

bool is_pass(std::string_view line) {
  return line.substr(0, line.find(' ')) == "pass";
}

Time parse_pass(std::string_view line) {
  std::string_view rest = line;
  if (rest.ends_with('\r')) rest.remove_suffix(1);
  if (!rest.starts_with(kPass)) refuse(line);
  rest.remove_prefix(kPass.size());
  const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  const auto count = text::parse<Time>(rest.substr(0, digits));
  const Time unit = unit_of(rest.substr(digits));
  if (!count || unit == 0 || *count > kMost / unit) refuse(line);
  return *count * unit;
}

std::string seconds_text(Time now) {
  const std::string fraction = std::to_string(now % kSecond);
  return std::to_string(now / kSecond) + "." + std::string(6 - fraction.size(), '0') + fraction;
}

}  // namespace cbcan::app
