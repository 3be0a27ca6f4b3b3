// SPDX-License-Identifier: MIT
#include "sim/signal.hpp"

#include "sim/number.hpp"
#include "support/catch.hpp"

namespace cbcan::test {

namespace {

using sim::Constant;
using sim::Noise;
using sim::Ramp;
using sim::Replay;
using sim::Signal;
using sim::Sine;

Signal signal(sim::Shape shape, Time sample_period = 10 * kMillisecond) {
  return {0x6401, 1, sample_period, std::move(shape)};
}

Replay replay(Replay::Between between, bool repeat) {
  return {{{2 * kSecond, 10}, {4 * kSecond, 30}, {8 * kSecond, -10}}, between, repeat};
}

/// The value at each of these seconds.
std::vector<double> values(const Signal& signal, std::initializer_list<double> seconds) {
  std::vector<double> found;
  for (const double second : seconds)
    found.push_back(signal.value_at(static_cast<Time>(second * 1e6)));
  return found;
}

using List = std::vector<double>;

void check_problem(std::string_view text, std::size_t line, const std::string& problem) {
  INFO(text);
  const sim::CsvPoints found = sim::parse_csv_points(text);
  CHECK(found.line == line);
  CHECK(found.problem == problem);
}

}  // namespace

TEST_CASE("a constant is sampled once") {
  const Signal constant = signal(Constant{4.5});
  CHECK(constant.value_at(0) == 4.5);
  CHECK(constant.value_at(kNever - 1) == 4.5);
  CHECK(constant.next_sample(0) == kNever);
}

TEST_CASE("a ramp that holds") {
  const Signal ramp = signal(Ramp{100, 20, 4 * kSecond, Ramp::Then::kHold}, 3 * kSecond);
  CHECK(values(ramp, {0, 1, 2, 4, 5, 1000}) == List{100, 80, 60, 20, 20, 20});
  CHECK(ramp.next_sample(0) == 3 * kSecond);
  CHECK(ramp.next_sample(3 * kSecond) == 6 * kSecond);  // samples the final value
  CHECK(ramp.next_sample(6 * kSecond) == kNever);
}

TEST_CASE("a ramp that repeats, and one that goes back and forth") {
  const Signal saw = signal(Ramp{0, 8, 4 * kSecond, Ramp::Then::kRepeat});
  CHECK(values(saw, {0, 1, 3, 4, 5, 41}) == List{0, 2, 6, 0, 2, 2});
  CHECK(saw.next_sample(1000 * kSecond) == 1000 * kSecond + 10 * kMillisecond);
  const Signal triangle = signal(Ramp{0, 8, 4 * kSecond, Ramp::Then::kBackAndForth});
  CHECK(values(triangle, {0, 1, 4, 5, 7, 8, 9}) == List{0, 2, 8, 6, 2, 0, 2});
}

TEST_CASE("a ramp without a duration is at its end") {
  for (const auto then : {Ramp::Then::kHold, Ramp::Then::kRepeat, Ramp::Then::kBackAndForth}) {
    const Signal ramp = signal(Ramp{1, 2, 0, then});
    CHECK(values(ramp, {0, 1}) == List{2, 2});
    CHECK(ramp.next_sample(0) == kNever);
  }
}

TEST_CASE("a sine") {
  const Signal sine = signal(Sine{50, 10, 4 * kSecond, 0});
  const List found = values(sine, {0, 1, 2, 3, 4, 4000001});
  const List expected{50, 60, 50, 40, 50, 60};
  for (std::size_t i = 0; i < expected.size(); ++i)
    CHECK(found[i] == Approx(expected[i]).margin(1e-9));
  CHECK(signal(Sine{50, 10, 4 * kSecond, 90}).value_at(0) == Approx(60));
  CHECK(signal(Sine{50, 10, 4 * kSecond, -90}).value_at(0) == Approx(40));
  CHECK(signal(Sine{50, 10, 12 * kSecond, 0}).value_at(kSecond) == Approx(55));  // sin 30 degrees
  CHECK(sine.next_sample(15 * kMillisecond) == 20 * kMillisecond);
}

TEST_CASE("a sine without a period is its mean") {
  const Signal sine = signal(Sine{50, 10, 0, 90});
  CHECK(sine.value_at(7) == 50);
  CHECK(sine.next_sample(0) == kNever);
}

TEST_CASE("noise is SplitMix64 of the seed and the sample's number") {
  // The first output for seed 0 is E220A8397B1DCDAFh; the others were computed by a program in another language.
  const Signal uniform = signal(Noise{10, 2, 0, Noise::Distribution::kUniform});
  const List expected{11.53324323285457, 9.72611198819404, 8.105735086370391};
  const Signal normal = signal(Noise{100, 3, 42, Noise::Distribution::kNormal});
  const List expected_normal{102.6467467186668, 98.64745037284342, 100.56505790234779};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(uniform.value_at(i * 10 * kMillisecond) == Approx(expected[i]).epsilon(1e-14));
    CHECK(normal.value_at(i * 10 * kMillisecond) == Approx(expected_normal[i]).epsilon(1e-12));
  }
  CHECK(uniform.next_sample(0) == 10 * kMillisecond);
}

TEST_CASE("noise is the same for a whole sample, in whatever order it is asked for") {
  const Signal noise = signal(Noise{0, 1, 7, Noise::Distribution::kNormal});
  const double late = noise.value_at(1000 * kSecond);
  const double first = noise.value_at(0);
  CHECK(noise.value_at(9999) == first);
  CHECK(noise.value_at(10000) != first);
  CHECK(noise.value_at(1000 * kSecond) == late);
  CHECK(signal(Noise{0, 1, 8, Noise::Distribution::kNormal}).value_at(0) != first);
}

TEST_CASE("noise has the mean and the deviation that it says") {
  const auto check = [](Noise::Distribution distribution, double standard_deviation) {
    const Signal noise = signal(Noise{5, 2, 1, distribution}, 1);
    double sum = 0;
    double squares = 0;
    constexpr unsigned kSamples = 20000;
    for (Time t = 0; t < kSamples; ++t) {
      const double value = noise.value_at(t);
      if (distribution == Noise::Distribution::kUniform) REQUIRE((value >= 3 && value < 7));
      sum += value;
      squares += (value - 5) * (value - 5);
    }
    CHECK(sum / kSamples == Approx(5).margin(0.05));
    CHECK(std::sqrt(squares / kSamples) == Approx(standard_deviation).epsilon(0.02));
  };
  check(Noise::Distribution::kUniform, 1.1547);  // 2 / sqrt 3
  check(Noise::Distribution::kNormal, 2);
}

TEST_CASE("a replay in steps") {
  const Signal once = signal(replay(Replay::Between::kStep, false), kSecond);
  CHECK(values(once, {0, 2, 3.9, 4, 7, 8, 100}) == List{10, 10, 10, 30, 30, -10, -10});
  CHECK(once.next_sample(7 * kSecond) == 8 * kSecond);
  CHECK(once.next_sample(8 * kSecond) == kNever);
}

TEST_CASE("a replay along straight lines") {
  const Signal once = signal(replay(Replay::Between::kLinear, false));
  CHECK(values(once, {0, 2, 3, 4, 5, 6, 8, 9}) == List{10, 10, 20, 30, 20, 10, -10, -10});
}

TEST_CASE("a replay that repeats begins again at the time of its last point") {
  const Signal again = signal(replay(Replay::Between::kLinear, true));
  CHECK(values(again, {7, 8, 11, 12, 16}) == List{0, 10, 20, 30, 10});
  CHECK(again.next_sample(80 * kSecond) == 80 * kSecond + 10 * kMillisecond);
  const Signal one_point = signal(Replay{{{0, 3}}, Replay::Between::kStep, true});
  CHECK(values(one_point, {0, 5}) == List{3, 3});
  CHECK(one_point.next_sample(0) == kNever);
}

TEST_CASE("points from CSV") {
  const sim::CsvPoints found = sim::parse_csv_points(
      "\xEF\xBB\xBFtime,level\r\n# filling\n\n 0 , 1.5 \r\n0.0000015,-2\n\t\n1e1,+3e2\n3200000000,4");
  CHECK(found.problem == "value `+3e2`: must be one number");
  CHECK(found.line == 7);
  const sim::CsvPoints good = sim::parse_csv_points("0 , 1.5 \r\n0.0000015,-2\n1e1,3e2\n3200000000,4");
  CHECK(good.problem.empty());
  CHECK(good.points ==
        std::vector<Replay::Point>{{0, 1.5}, {2, -2}, {10'000'000, 300}, {3'200'000'000'000'000, 4}});
}

TEST_CASE("a first line of names is skipped, no other") {
  CHECK(sim::parse_csv_points("seconds,value\n1,2").points == std::vector<Replay::Point>{{1'000'000, 2}});
  CHECK(sim::parse_csv_points("# no names\nt\n1,2").points.size() == 1);
  check_problem("1,2\nseconds,value", 2, "time `seconds`: must be seconds, from 0 to 3.2e9");
  check_problem("x,2", 1, "time `x`: must be seconds, from 0 to 3.2e9");
}

TEST_CASE("what is wrong with a CSV text is said with its line") {
  check_problem("", 1, "no point in it: one `seconds,value` is needed at least");
  check_problem("time,value\n#\n", 1, "no point in it: one `seconds,value` is needed at least");
  check_problem("0,1\n\n1;2", 3, "`1;2`: must be a time in seconds and a value with a comma between them");
  check_problem("0,1\n-1,2", 2, "time `-1`: must be seconds, from 0 to 3.2e9");
  check_problem("3.3e9,2", 1, "time `3.3e9`: must be seconds, from 0 to 3.2e9");
  check_problem("0,1\n1,", 2, "value ``: must be one number");
  check_problem("0,1\n1,2,3", 2, "value `2,3`: must be one number");
  check_problem("0,1\n1,nan", 2, "value `nan`: must be one number");
  check_problem("0,1\n1,1e999", 2, "value `1e999`: must be one number");
  check_problem("0,1\n2,1\n2,1", 3, "time `2`: must be later than the one before");
  check_problem("1,1\n0.5,1", 2, "time `0.5`: must be later than the one before");
}

TEST_CASE("rounding into an object") {
  CHECK(sim::rounded<std::uint8_t>(254.5) == 255);
  CHECK(sim::rounded<std::uint8_t>(-0.4) == 0);
  CHECK(sim::rounded<std::int16_t>(-2.5) == -3);
  CHECK(sim::rounded<std::int16_t>(32766.5) == 32767);
  CHECK(sim::rounded<std::int16_t>(-32767.5) == -32768);
  CHECK(sim::rounded<std::int32_t>(0.49999999999999994) == 0);  // the largest number below 0.5; adding 0.5 rounds to 1
  CHECK(sim::rounded<std::int32_t>(-0.49999999999999994) == 0);
  CHECK(sim::rounded<std::int32_t>(1e300) == 2147483647);
  CHECK(sim::rounded<std::int32_t>(-1e300) == -2147483647 - 1);
  CHECK(sim::rounded<std::uint32_t>(4294967294.6) == 4294967295u);
  CHECK(sim::rounded<std::int32_t>(std::nan("")) == 0);
}

}  // namespace cbcan::test
