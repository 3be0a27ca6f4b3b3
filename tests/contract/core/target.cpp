// SPDX-License-Identifier: MIT
// The suite's target "core": the coprocessor in this process, in virtual time.

#include "contract/target.hpp"
#include "cbcan/coprocessor/further_channels.hpp"
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

/// The scanner windows of all channels, and memory for all except the first.
struct Channels {
  static constexpr std::size_t kCount = regmap::kMostChannels;

  Channels() {
    for (std::size_t i = 0; i < kCount; ++i)
      scanners.emplace_back(out.at(i), in.at(i));
  }

  std::array<std::array<std::uint16_t, regmap::kScannerOutWords>, kCount> out{};
  std::array<std::array<std::uint16_t, regmap::kScannerInWords>, kCount> in{};
  std::vector<ScannerWindow> scanners;
  std::array<FurtherChannels::Memory, FurtherChannels::kMost> more{};
};

struct CoreTarget final : Target, private test::StackRig<Coprocessor> {
  explicit CoreTarget(const Settings& settings) : StackRig(coprocessor_), settings_(settings) {
    coprocessor_.use_network(network_, 0);
    coprocessor_.show_status_in(status_, requests_);
    now = 1000;
    coprocessor_.start(now);
    port.sent.clear();
  }

  std::string lacks(Ability ability) const override {
    return ability == Ability::kMorePdos ? "the core alone has 16 PDOs each way" : "";
  }

  void write(unsigned first, const Words& words) override { write_and_read(first, words, first, 0); }
  Words read(unsigned first, std::size_t count) override { return write_and_read(first, {}, first, count); }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) override {
    for (std::size_t k = 0; k < words.size(); ++k)
      reg(to + static_cast<unsigned>(k)) = words[k];
    Words seen;
    while (seen.size() < count)
      seen.push_back(reg(from++));
    coprocessor_.on_plc(client_, to, words.size(), now);
    if (!words.empty()) coprocessor_.on_registers_written(to, words.size(), now);
    coprocessor_.poll(now);
    StackRig::pass(0);
    return seen;
  }

  Words read_as_another(unsigned first, std::size_t count) override {
    client_ = 2;
    const Words seen = read(first, count);
    client_ = 1;
    return seen;
  }

  std::string next_frame() override {
    if (port.sent.empty()) return {};
    std::string frame = port.sent.front();
    port.sent.pop_front();
    return frame;
  }
  void arrive(const std::string& frame) override { StackRig::arrive(frame); }

  void pass(Duration duration) override { StackRig::pass(static_cast<Time>(duration.count())); }
  Duration precision() const override { return 1us; }

  void set_bus_state(BusState state) override { coprocessor_.on_bus_state(core_state(state), now); }
  void refuse_frames(bool refuse) override { port.refuse_next = refuse ? test::RecordingPort::kAlways : 0; }

  Words first_done(const std::function<void()>& ending) override {
    std::array<std::uint16_t, regmap::kWindowWords> seen;
    if (!registers_.run(PROT_READ, ending, [&] { seen = registers_.words(); })) return {};
    Words words(seen.begin(), seen.end());
    words[0] = reg(regmap::kExecuteFlag);
    return words;
  }

 private:
  std::uint16_t& reg(unsigned address) {
    const auto in = [address](const auto& range, unsigned begin) { return address - begin < range.size(); };
    if (in(status_, regmap::kStatusFirst)) return status_.at(address - regmap::kStatusFirst);
    if (in(requests_, regmap::kNodeRequest)) return requests_.at(address - regmap::kNodeRequest);
    if (in(process_, settings_.process_first)) return process_.at(address - settings_.process_first);
    for (std::size_t i = 0; i < Channels::kCount; ++i) {
      const auto behind = static_cast<unsigned>(200 * i);
      if (in(channels_.out.at(i), settings_.scanner_out_first + behind))
        return channels_.out.at(i).at(address - settings_.scanner_out_first - behind);
      if (in(channels_.in.at(i), settings_.scanner_in_first + behind))
        return channels_.in.at(i).at(address - settings_.scanner_in_first - behind);
    }
    return registers_.words().at(address - regmap::kWindowFirst);
  }

  WatchedRegisters<regmap::kWindowWords, 0> registers_;
  Channels channels_;
  std::array<std::uint16_t, regmap::kStatusWords> status_{};
  std::array<std::uint16_t, 2> requests_{};
  std::uint32_t client_ = 1;
  std::array<std::uint16_t, regmap::kProcessWords> process_{};
  std::array<std::uint8_t, 1024> network_{};
  Settings settings_;
  Coprocessor coprocessor_{RegisterWindow(RegisterWindow::Words(registers_.words())), process_, port,
                           core_settings(settings_), channels_.scanners[0]};
  FurtherChannels further_{coprocessor_, std::span(channels_.scanners).subspan(1), channels_.more};
};

}  // namespace

std::unique_ptr<Target> make_target(const Settings& settings) {
  return std::make_unique<CoreTarget>(settings);
}

}  // namespace cbcan::contract
