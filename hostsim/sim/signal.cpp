// SPDX-License-Identifier: MIT
#include "sim/signal.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "base/text.hpp"
#include "sim/random.hpp"

namespace cbcan::sim {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegree = kTurn / 360;

double part(Time of, Time whole) {
  return static_cast<double>(of) / static_cast<double>(whole);
}

double between(double from, double to, double share) {
  return from + (to - from) * share;
}

/// Mean 0, standard deviation 1 (Box and Muller).
double normal(std::uint64_t seed, std::uint64_t sample) {
  Random random(seed, 2 * sample);
  const double radius = std::sqrt(-2 * std::log(1 - random.fraction()));
  return radius * std::cos(kTurn * random.fraction());
}

struct ValueAt {
  Time time;
  Time sample_period;

  double operator()(const Constant& constant) const { return constant.value; }

  double operator()(const Ramp& ramp) const {
    const Time length = ramp.duration;
    if (length == 0 || (ramp.then == Ramp::Then::kHold && time >= length)) return ramp.to;
    if (ramp.then != Ramp::Then::kBackAndForth)
      return between(ramp.from, ramp.to, part(time % length, length));
    const Time phase = time % (2 * length);
    return between(ramp.from, ramp.to, part(phase <= length ? phase : 2 * length - phase, length));
  }

  double operator()(const Sine& sine) const {
    if (sine.period == 0) return sine.mean;
    const double angle = kTurn * part(time % sine.period, sine.period) + kDegree * sine.phase;
    return sine.mean + sine.amplitude * std::sin(angle);
  }

  double operator()(const Noise& noise) const {
    const std::uint64_t sample = time / sample_period;
    const double unit = noise.distribution == Noise::Distribution::kNormal
                            ? normal(noise.seed, sample)
                            : 2 * Random(noise.seed, sample).fraction() - 1;
    return noise.mean + noise.deviation * unit;
  }

  double operator()(const Replay& replay) const {
    const std::vector<Replay::Point>& points = replay.points;
    const Time length = points.back().at;
    const Time at = replay.repeat && length != 0 ? time % length : time;
    const auto later = std::ranges::upper_bound(points, at, {}, &Replay::Point::at);
    if (later == points.begin()) return points.front().value;
    const Replay::Point& last = *(later - 1);
    if (later == points.end() || replay.between == Replay::Between::kStep) return last.value;
    return between(last.value, later->value, part(at - last.at, later->at - last.at));
  }
};

/// The time from which the value no longer changes.
struct SettledAt {
  Time operator()(const Constant&) const { return 0; }
  Time operator()(const Ramp& ramp) const {
    return ramp.duration == 0 || ramp.then == Ramp::Then::kHold ? ramp.duration : kNever;
  }
  Time operator()(const Sine& sine) const { return sine.period == 0 ? 0 : kNever; }
  Time operator()(const Noise&) const { return kNever; }
  Time operator()(const Replay& replay) const {
    const Time length = replay.points.back().at;
    return replay.repeat && length != 0 ? kNever : length;
  }
};

std::optional<double> number(std::string_view text) {
  const auto value = base::parse<double>(base::trim(text));
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Seconds of a hundred years: longer than any run, and exact to the microsecond in a double.
constexpr double kLongest = 3.2e9;

/// Appends the point of one line to `points`. Returns what is wrong with the line; empty = nothing.
std::string add_point(std::string_view line, std::vector<Replay::Point>& points) {
  const auto sides = base::split(line, ',');
  if (!sides)
    return fmt::format("`{}`: must be a time in seconds and a value with a comma between them", line);
  const std::string_view time = base::trim(sides->first);
  const std::optional<double> seconds = number(time);
  if (!seconds || *seconds < 0 || *seconds > kLongest)
    return fmt::format("time `{}`: must be seconds, from 0 to 3.2e9", time);
  const std::optional<double> value = number(sides->second);
  if (!value) return fmt::format("value `{}`: must be one number", base::trim(sides->second));
  const auto at = static_cast<Time>(std::llround(*seconds * 1e6));
  if (!points.empty() && at <= points.back().at)
    return fmt::format("time `{}`: must be later than the one before", time);
  points.push_back({at, *value});
  return {};
}

/// Column names: neither part of the line is a number.
bool is_header(std::string_view line) {
  const auto sides = base::split(line, ',');
  return sides ? !number(sides->first) && !number(sides->second) : !number(line);
}

}  // namespace

double Signal::value_at(Time since_start) const {
  return std::visit(ValueAt{since_start, sample_period}, shape);
}

Time Signal::next_sample(Time since_start) const {
  if (since_start >= std::visit(SettledAt{}, shape)) return kNever;
  return (since_start / sample_period + 1) * sample_period;
}

CsvPoints parse_csv_points(std::string_view text) {
  CsvPoints found;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  bool first = true;
  while (!text.empty()) {
    ++found.line;
    const std::string_view line = base::trim(base::take_line(text));
    if (line.empty() || line.front() == '#') continue;
    if (std::exchange(first, false) && is_header(line)) continue;
    found.problem = add_point(line, found.points);
    if (!found.problem.empty()) return found;
  }
  if (!found.points.empty()) return found;
  found.line = 1;
  found.problem = "no point in it: one `seconds,value` is needed at least";
  return found;
}

}  // namespace cbcan::sim
