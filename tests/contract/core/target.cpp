// SPDX-License-Identifier: MIT
// The suite's target "core": the coprocessor in this process, in virtual time.

#include "contract/target.hpp"
#include "contract/core/watched_registers.hpp"
#include "support/bench.hpp"

namespace cbcan::contract {

namespace {

Coprocessor::Settings core_settings(const Settings& settings) {
  Coprocessor::Settings core;
  core.state_fresh_for = static_cast<Time>(settings.state_fresh_for.count());
  core.guard_timeout = static_cast<Time>(settings.guard_timeout.count());
  core.process_first = static_cast<std::uint16_t>(settings.process_first);
  core.scanner_out_first = static_cast<std::uint16_t>(settings.scanner_out_first);
  core.scanner_in_first = static_cast<std::uint16_t>(settings.scanner_in_first);
  core.plc_timeout_ms = static_cast<std::uint16_t>(settings.plc_timeout / 1ms);
  if (settings.plc_lost_stopped) core.plc_lost = nmt::Command::kStop;
  return core;
}

cbcan::BusState core_state(BusState state) {
  switch (state) {
    case BusState::kOverflow: return cbcan::BusState::kOverflow;
    case BusState::kErrorPassive: return cbcan::BusState::kErrorPassive;
    case BusState::kBusOff: return cbcan::BusState::kBusOff;
    default: return cbcan::BusState::kActive;
  }
}

struct CoreTarget final : Target {
  explicit CoreTarget(const Settings& settings)
      : bench_(new test::Bench(registers_.words(), core_settings(settings))), settings_(settings) {}

  std::string lacks(Ability /*ability*/) const override { return {}; }

  void write(unsigned first, const Words& words) override { write_and_read(first, words, first, 0); }
  Words read(unsigned first, std::size_t count) override { return write_and_read(first, {}, first, count); }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) override {
    for (std::size_t k = 0; k < words.size(); ++k)
      reg(to + static_cast<unsigned>(k)) = words[k];
    Words seen;
    while (seen.size() < count)
      seen.push_back(reg(from++));
    bench_->coprocessor.on_plc(bench_->now);
    if (!words.empty()) bench_->coprocessor.on_registers_written(to, words.size(), bench_->now);
    bench_->poll();
    return seen;
  }

  std::string next_frame() override {
    if (bench_->port.sent.empty()) return {};
    std::string frame = bench_->port.sent.front();
    bench_->port.sent.pop_front();
    return frame;
  }
  void arrive(const std::string& frame) override { bench_->arrive(frame); }

  void pass(Duration duration) override { bench_->pass(static_cast<Time>(duration.count())); }
  Duration precision() const override { return 1us; }

  void set_bus_state(BusState state) override {
    bench_->coprocessor.on_bus_state(core_state(state), bench_->now);
  }
  void refuse_frames(bool refuse) override {
    bench_->port.refuse_next = refuse ? test::RecordingPort::kAlways : 0;
  }

  Words first_done(const std::function<void()>& ending) override {
    test::Registers seen;
    if (!registers_.watch(ending, seen)) return {};
    Words words(seen.begin(), seen.end());
    words[0] = bench_->reg(regmap::kExecuteFlag);
    return words;
  }

 private:
  std::uint16_t& reg(unsigned address) {
    const auto in = [address](const auto& range, unsigned begin) { return address - begin < range.size(); };
    if (in(bench_->process, settings_.process_first))
      return bench_->process.at(address - settings_.process_first);
    if (in(bench_->out, settings_.scanner_out_first))
      return bench_->out.at(address - settings_.scanner_out_first);
    if (in(bench_->in, settings_.scanner_in_first))
      return bench_->in.at(address - settings_.scanner_in_first);
    return bench_->reg(address);
  }

  WatchedRegisters registers_;
  std::unique_ptr<test::Bench> bench_;
  Settings settings_;
};

}  // namespace

std::unique_ptr<Target> make_target(const Settings& settings) {
  return std::make_unique<CoreTarget>(settings);
}

}  // namespace cbcan::contract
