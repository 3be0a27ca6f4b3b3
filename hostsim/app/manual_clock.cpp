// SPDX-License-Identifier: MIT
#include "app/manual_clock.hpp"

#include <charconv>

#include "io/errors.hpp"

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
  Time count = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), count);
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  const Time unit = unit_of(rest);
  if (error != std::errc{} || unit == 0 || count > kMost / unit) refuse(line);
  return count * unit;
}

std::string seconds_text(Time now) {
  const std::string fraction = std::to_string(now % kSecond);
  return std::to_string(now / kSecond) + "." + std::string(6 - fraction.size(), '0') + fraction;
}

}  // namespace cbcan::app
