// SPDX-License-Identifier: MIT
#include "sim/wire.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/text.hpp"

namespace cbcan::sim {

namespace {

using BlockParameters = Block::Parameters;

struct BlockKey {
  std::string_view name;
  double BlockParameters::*member;
  bool is_positive = false;  ///< else any number
};
constexpr BlockKey kStart{"start", &BlockParameters::start}, kLow{"low", &BlockParameters::low},
    kHigh{"high", &BlockParameters::high}, kTime{"time", &BlockParameters::time, true};

struct BlockRow {
  std::string_view name;
  std::vector<BlockKey> keys;
};
/// Rows in the order of Kind.
const std::array<BlockRow, 6>& block_rows() {
  static const std::array<BlockRow, 6> kRows{{
      {"pt1", {kTime, kStart}},
      {"integrator", {{"gain", &BlockParameters::gain}, kLow, kHigh, kStart}},
      {"dead-time", {kTime, kStart}},
      {"pid",
       {{"p", &BlockParameters::p},
        {"i", &BlockParameters::i},
        {"d", &BlockParameters::d},
        {"filter", &BlockParameters::filter, true},
        kLow,
        kHigh}},
      {"ramp", {{"up", &BlockParameters::up, true}, {"down", &BlockParameters::down, true}, kStart}},
      {"hysteresis", {{"on", &BlockParameters::on}, {"off", &BlockParameters::off}, kStart}},
  }};
  return kRows;
}

/// Returns what is wrong with "key=number".
std::string store_key(const BlockRow& row, std::string_view word, BlockParameters& parameters) {
  constexpr double kMost = 1e9;
  const auto [name, value] = base::split(word, '=').value_or(std::pair(word, std::string_view()));
  const auto key = std::ranges::find(row.keys, name, &BlockKey::name);
  if (key == row.keys.end())
    return fmt::format("{}: no such key; there are {}", name,
                       base::listed(base::column(row.keys, &BlockKey::name), " and "));
  const auto number = base::parse<double>(value);
  if (!number || !(*number <= kMost && *number >= (key->is_positive ? 1e-6 : -kMost)))
    return fmt::format("{}: must be {}..1e9", name, key->is_positive ? "0.000001" : "-1e9");
  parameters.*key->member = *number;
  return {};
}

double given(double parameter, double standard) {
  return std::isnan(parameter) ? standard : parameter;
}

double lagged(double from, double to, double share) {
  return to + (from - to) * std::exp(-share);
}

/// Number of time constants after which a double no longer distinguishes a lag from its final value.
constexpr double kTimeConstants = 40;

double in_seconds(Time time) {
  return static_cast<double>(time) / kSecond;
}

/// The first microsecond after it; kNever if that is in more than a year.
Time after_seconds(Time since, double duration) {
  constexpr double kYear = 365.0 * 24 * 3600;
  return duration < kYear ? since + static_cast<Time>(std::ceil(duration * kSecond)) : kNever;
}

}  // namespace

Block::Parsed Block::parse(std::string_view text) {
  Parsed parsed;
  const std::vector<std::string_view> words = base::words_of(text);
  const auto row =
      words.empty() ? block_rows().end() : std::ranges::find(block_rows(), words[0], &BlockRow::name);
  if (row == block_rows().end()) {
    parsed.problem = fmt::format("block \"{}\": no such kind; there are {}", text,
                                 base::listed(base::column(block_rows(), &BlockRow::name), " and "));
    return parsed;
  }
  parsed.block.kind_ = static_cast<Kind>(row - block_rows().begin());
  BlockParameters& parameters = parsed.block.parameters_;
  std::vector<std::string_view> keys;
  for (std::size_t i = 1; i < words.size() && parsed.problem.empty(); ++i) {
    const std::string_view key = words[i].substr(0, words[i].find('='));
    parsed.problem = std::ranges::find(keys, key) == keys.end()
                         ? store_key(*row, words[i], parameters)
                         : fmt::format("{}: is there twice; remove one", key);
    keys.push_back(key);
  }
  if (parsed.problem.empty() && parameters.low > parameters.high) parsed.problem = "low is above high";
  if (parsed.problem.empty() && parameters.off >= parameters.on) parsed.problem = "off must be below on";
  if (!parsed.problem.empty()) parsed.problem = fmt::format("block {}: {}", row->name, parsed.problem);
  return parsed;
}

Block Block::lag(Time time) {
  Block block;
  block.parameters_.time = in_seconds(time);
  return block;
}

Block Block::dead_time(Time time) {
  Block block = lag(time);
  block.kind_ = Kind::kDeadTime;
  return block;
}

double Block::limited(double value) const {
  return std::clamp(value, parameters_.low, parameters_.high);
}

void Block::begin(double input, Time now) {
  begun_ = true;
  const bool follows = kind_ == Kind::kPt1 || kind_ == Kind::kDeadTime || kind_ == Kind::kRamp;
  state_ = {limited(given(parameters_.start, follows ? input : 0)), input};
  input_ = kind_ == Kind::kDeadTime ? state_.output : input;
  since_ = now;
}

void Block::put_later(double input, Time arrives) {
  if (!waiting_.empty() && waiting_.back().first == arrives) waiting_.pop_back();
  if (input != (waiting_.empty() ? state_.output : waiting_.back().second))
    waiting_.emplace_back(arrives, input);
}

void Block::put(double input, Time now) {
  input = std::isnan(input) ? 0 : std::clamp(input, -kMost, kMost);
  if (!begun_) begin(input, now);
  if (kind_ == Kind::kDeadTime) return put_later(input, after_seconds(now, parameters_.time - 1e-9));
  state_ = after(now - since_);
  since_ = now;
  input_ = input;
  if (kind_ == Kind::kHysteresis && (input >= parameters_.on || input <= parameters_.off))
    state_.output = input >= parameters_.on ? 1 : 0;
}

double Block::at(Time now) {
  for (; next_step() <= now; waiting_.pop_front())
    state_.output = waiting_.front().second;
  return shown(after(now - since_));
}

Block::State Block::after(Time elapsed) const {
  const double t = in_seconds(elapsed);
  const double way = input_ - state_.output;
  switch (kind_) {
    case Kind::kPt1:
      return {t >= kTimeConstants * parameters_.time ? input_
                                                     : lagged(state_.output, input_, t / parameters_.time)};
    case Kind::kIntegrator: return {limited(state_.output + parameters_.gain * input_ * t)};
    case Kind::kPid:
      return {limited(state_.output + parameters_.i * input_ * t),
              lagged(state_.filtered, input_, t / parameters_.filter)};
    case Kind::kRamp:
      return {state_.output +
              std::clamp(way, -given(parameters_.down, parameters_.up) * t, parameters_.up * t)};
    default: return state_;
  }
}

double Block::shown(const State& state) const {
  if (kind_ != Kind::kPid) return state.output;
  const double derivative = (input_ - state.filtered) / parameters_.filter;
  return limited(parameters_.p * input_ + state.output + parameters_.d * derivative);
}

Time Block::moves_until() const {
  const double rate = kind_ == Kind::kPid ? parameters_.i * input_ : parameters_.gain * input_;
  const double way = rate < 0 ? state_.output - parameters_.low : parameters_.high - state_.output;
  const double integrates = rate == 0 ? 0 : way / std::abs(rate);
  const double distance = input_ - state_.output;
  switch (kind_) {
    case Kind::kPt1: return distance == 0 ? since_ : after_seconds(since_, kTimeConstants * parameters_.time);
    case Kind::kIntegrator: return after_seconds(since_, integrates);
    case Kind::kPid: {
      const bool fades = parameters_.d != 0 && state_.filtered != input_;
      return after_seconds(since_, std::max(integrates, fades ? kTimeConstants * parameters_.filter : 0));
    }
    case Kind::kRamp:
      return after_seconds(since_, distance > 0 ? distance / parameters_.up
                                                : -distance / given(parameters_.down, parameters_.up));
    default: return since_;
  }
}

bool Block::is_immediate() const {
  return kind_ == Kind::kPid || kind_ == Kind::kHysteresis || parameters_.time == 0;
}

Wire::Wire(const TransferFunction& transfer)
    : transfer_(transfer),
      delay_(Block::dead_time(transfer.delay)),
      block_(transfer.block.empty() ? Block::lag(transfer.lag) : Block::parse(transfer.block).block) {}

double Wire::shaped(double value) const {
  if (transfer_.inverted) value = value == 0 ? 1 : 0;
  value = transfer_.scale * value + transfer_.offset;
  if (transfer_.low) value = std::max(value, *transfer_.low);
  if (transfer_.high) value = std::min(value, *transfer_.high);
  return std::isnan(value) ? 0 : value;
}

void Wire::put(double value, Time now) {
  const double next = shaped(value);
  delay_.put(next, now);
  if (!std::exchange(begun_, true)) block_.put(next, now);
}

double Wire::take(Time now) {
  for (Time arrived = delay_.next_step(); arrived <= now; arrived = delay_.next_step())
    block_.put(delay_.at(arrived), arrived);
  return block_.at(now);
}

Time Wire::next_change(Time now) const {
  const Time next = earlier(delay_.next_step(), block_.next_step());
  const Time until = block_.moves_until();
  if (now >= until) return next;
  const Time samples = (now - block_.since()) / transfer_.sample_period + 1;
  return earlier(next, std::min(until, block_.since() + samples * transfer_.sample_period));
}

}  // namespace cbcan::sim
