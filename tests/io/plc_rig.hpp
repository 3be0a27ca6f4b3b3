// SPDX-License-Identifier: MIT
#pragma once

/// PLCs that own their registers, and the module that polls them, in simulated time.

#include "cbcan/coprocessor/coprocessor.hpp"
#include "io/modbus/plc_exchange.hpp"
#include "support/scanner_plc.hpp"

namespace cbcan::io::test {

using cbcan::test::CountingNode;
using cbcan::test::kScannedNode;
using cbcan::test::scanned_value;
using cbcan::test::ScannerPlc;

/// A module with its registers, and node 5 on its bus.
struct ScannedModule final : CanPort {
  explicit ScannedModule(std::uint16_t sdo_timeout_ms) {
    Coprocessor::Settings settings;
    settings.sdo_timeout_ms = sdo_timeout_ms;
    const std::span<std::uint16_t, regmap::kRegisterFileWords> all(registers);
    coprocessor.emplace(RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
                        all.subspan<regmap::kProcessFirst, regmap::kProcessWords>(), *this, settings,
                        ScannerWindow(all.subspan<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
                                      all.subspan<regmap::kScannerInFirst, regmap::kScannerInWords>()));
    coprocessor->start(now);
    poll();
  }

  /// The bus.
  bool try_send(const Frame& frame) override {
    if (frame.id == 0x600u + kScannedNode) node.on_request(frame.data);
    while (due_.size() < node.responses.size())
      due_.push_back(now + node_delay);
    return true;
  }

  void poll() {
    while ((deadline_ = coprocessor->poll(now)) <= now) {
    }
  }

  void written(std::size_t first, std::size_t count) {
    coprocessor->on_registers_written(first, count, now);
    poll();
  }

  /// One request of the PLC.
  void write(std::size_t first, std::span<const std::uint16_t> words) {
    std::ranges::copy(words, registers.begin() + static_cast<std::ptrdiff_t>(first));
    written(first, words.size());
  }

  void deliver_response() {
    if (node.responses.empty()) return;
    const Frame frame{.id = 0x580u + kScannedNode, .length = 8, .data = node.responses.front()};
    lose_response();
    coprocessor->on_frame(frame, now);
    poll();
  }
  void lose_response() {
    if (node.responses.empty()) return;
    node.responses.pop_front();
    due_.pop_front();
  }

  /// Time passes without a response.
  void pass(Time duration) {
    now += duration;
    poll();
  }
  /// Time passes; the node responds after `node_delay`.
  void run(Time duration) {
    const Time end = now + duration;
    while (true) {
      const Time next = earlier(deadline_, due_.empty() ? kNever : due_.front());
      if (next > end) break;
      now = std::max(now, next);
      if (!due_.empty() && due_.front() <= now)
        deliver_response();
      else
        poll();
    }
    pass(end - now);
  }

  std::array<std::uint16_t, regmap::kRegisterFileWords> registers{};
  CountingNode node;
  Time node_delay = 0;
  std::optional<Coprocessor> coprocessor;
  Time now = 1000;

 private:
  std::deque<Time> due_;  ///< times of the responses
  Time deadline_ = 0;
};

/// The module as a Modbus client sees it.
struct ModuleUnit final : protocols::ModbusUnit {
  explicit ModuleUnit(ScannedModule& module) : module_(module) {}
  std::span<std::uint16_t> registers() override { return module_.registers; }
  modbus::Pdu handle(const protocols::ModbusRequest&, Room) override { return {}; }
  void on_taken(const modbus::Range& taken) override {
    module_.poll();
    if (taken.count != 0) module_.written(taken.first, taken.count);
  }

 private:
  ScannedModule& module_;
};

/// A program in a PLC, on its registers.
struct PlcProgram {
  virtual ~PlcProgram() = default;
  virtual void scan() = 0;
  /// Restarts the program; `cleared`: the registers are 0 again.
  virtual void restart(bool cleared) = 0;
  virtual unsigned ended() const = 0;
  /// Nothing was executed twice, no result was accepted without execution, none was inconsistent.
  virtual void check() = 0;
};

/// R3700 as intended: CA0Eh until the module has written a result. After a cancel or a start the program
/// leaves it at 0 for three polls.
struct FlagProgram final : PlcProgram {
  FlagProgram(std::span<std::uint16_t> registers, const CountingNode& node, const unsigned& polls,
              int patience)
      : registers_(registers), node_(node), polls_(polls), patience_(patience) {}

  void scan() override {
    if (waiting_) return wait();
    if (polls_ < rest_until_) return;
    ++id_;
    write_ = id_ % 2 == 0;
    const auto low = static_cast<std::uint16_t>(id_);
    const auto high = static_cast<std::uint16_t>(id_ >> 16);
    const std::array<std::uint16_t, 8> words =
        write_
            ? std::array<std::uint16_t, 8>{0xCA0E, 5066, kScannedNode, 0x2000, 0, 4, low, high}
            : std::array<std::uint16_t, 8>{0xCA0E, 5055, kScannedNode, index(), std::uint16_t(id_ & 0xFF), 4};
    std::ranges::copy(words, registers_.begin());
    waiting_ = true;
    waited_ = 0;
  }

  void restart(bool cleared) override {
    if (cleared) std::ranges::fill(registers_, std::uint16_t{0});
    rest();
  }

  unsigned ended() const override { return ended_; }

  void check() override {
    for (const auto* counts : {&node_.written, &node_.read})
      for (const auto& [id, times] : *counts)
        if (times != 1) wrong.push_back(id);
    for (const auto& [write, id] : done_)
      if (!(write ? node_.written : node_.read).contains(id)) wrong.push_back(id);
    CHECK(wrong.empty());
  }

  std::vector<std::uint32_t> wrong;
  std::map<std::uint16_t, unsigned> results;

 private:
  std::uint16_t index() const { return static_cast<std::uint16_t>(id_ >> 8); }

  void wait() {
    if (registers_[0] == 0xCA0E) {
      if (++waited_ > patience_) rest();
      return;
    }
    waiting_ = false;
    ++results[registers_[0]];
    ++ended_;
    if (registers_[0] != 0) return;
    done_.emplace_back(write_, id_);
    const std::uint32_t value = registers_[6] | std::uint32_t{registers_[7]} << 16;
    const std::uint32_t right = write_ ? id_ : scanned_value(index(), static_cast<std::uint8_t>(id_));
    if (registers_[5] != 4 || value != right) wrong.push_back(id_);
  }

  void rest() {
    registers_[0] = 0;
    waiting_ = false;
    rest_until_ = polls_ + 3;
  }

  std::span<std::uint16_t> registers_;
  const CountingNode& node_;
  const unsigned& polls_;
  int patience_;
  unsigned rest_until_ = 0;
  bool waiting_ = false;
  bool write_ = false;
  int waited_ = 0;
  std::uint32_t id_ = 0x200000;
  unsigned ended_ = 0;
  std::vector<std::pair<bool, std::uint32_t>> done_;
};

/// The scanner window's program, on blocks in the PLC's memory.
struct ScannerProgram final : PlcProgram {
  ScannerProgram(std::span<std::uint16_t> registers, const CountingNode& node, int patience)
      : registers_(registers), node_(node), plc(patience) {}

  void scan() override {
    std::copy_n(registers_.begin() + regmap::kScannerOutWords, plc.in.size(), plc.in.begin());
    plc.scan();
    std::ranges::copy(plc.out, registers_.begin());
  }
  void restart(bool cleared) override {
    if (cleared) std::ranges::fill(registers_, std::uint16_t{0});
    plc.restart();
    std::fill_n(registers_.begin() + regmap::kScannerOutWords, plc.in.size(), std::uint16_t{0});
    std::ranges::copy(plc.out, registers_.begin());
  }
  unsigned ended() const override { return plc.ended; }
  void check() override { plc.check(node_); }

 private:
  std::span<std::uint16_t> registers_;
  const CountingNode& node_;

 public:
  ScannerPlc plc;
};

/// Registers of both layouts.
inline constexpr std::size_t kPlcWords = regmap::kScannerOutWords + regmap::kScannerInWords;

inline std::unique_ptr<PlcExchange> make_exchange(bool scanner, protocols::ModbusUnit& unit,
                                                  std::uint16_t first) {
  if (scanner)
    return std::make_unique<ScannerExchange>(unit, first, regmap::kScannerOutFirst, regmap::kScannerInFirst);
  return std::make_unique<WindowExchange>(unit, first);
}

inline std::unique_ptr<PlcProgram> make_program(bool scanner, std::span<std::uint16_t> registers,
                                                const CountingNode& node, const unsigned& polls,
                                                int patience) {
  if (scanner) return std::make_unique<ScannerProgram>(registers, node, patience);
  return std::make_unique<FlagProgram>(registers, node, polls, patience);
}

}  // namespace cbcan::io::test
