// SPDX-License-Identifier: MIT
#pragma once

/// PLCs that own their registers, and the module that polls them, in simulated time.

#include "cbcan/coprocessor/coprocessor.hpp"
#include "protocols/plc_exchange.hpp"
#include "support/register_file.hpp"
#include "support/scanner_plc.hpp"

namespace cbcan::io::test {

using namespace protocols;

using cbcan::test::CountingNode;
using cbcan::test::kScannedNode;
using cbcan::test::RegisterFile;
using cbcan::test::ScannerPlc;

/// A module with its registers, and node 5 on its bus.
struct ScannedModule final : CanPort {
  explicit ScannedModule(std::uint16_t sdo_timeout_ms)
      : coprocessor(registers.window(), registers.process(), *this, {.sdo_timeout_ms = sdo_timeout_ms},
                    registers.scanner()) {
    coprocessor.start(now);
    poll_when_due();
  }

  /// The bus.
  bool try_send(const Frame& frame) override {
    if (frame.id == 0x600u + kScannedNode) node.on_request(frame.data);
    while (due_.size() < node.responses.size())
      due_.push_back(now + node_delay);
    return true;
  }

  /// R3700 may have been written.
  void poll() {
    coprocessor.poll(now);
    poll_when_due();
  }

  /// One request of the PLC.
  void write(std::size_t first, std::span<const std::uint16_t> words) {
    registers.put(first, words);
    written(first, words.size());
  }
  void written(std::size_t first, std::size_t count) {
    coprocessor.on_registers_written(first, count, now);
    poll();
  }

  void deliver_response() {
    if (node.responses.empty()) return;
    const Frame frame{.id = 0x580u + kScannedNode, .length = 8, .data = node.responses.front()};
    lose_response();
    coprocessor.on_frame(frame, now);
    poll_when_due();
  }
  void lose_response() {
    if (node.responses.empty()) return;
    node.responses.pop_front();
    due_.pop_front();
  }

  /// Time passes without a response.
  void pass(Time duration) {
    now += duration;
    poll_when_due();
  }
  /// Time passes; the node responds after `node_delay`.
  void run(Time duration) {
    const Time end = now + duration;
    while (true) {
      const Time response = due_.empty() ? kNever : due_.front();
      if (earlier(coprocessor.deadline(), response) > end) break;
      now = std::max(now, earlier(coprocessor.deadline(), response));
      response <= now ? deliver_response() : poll_when_due();
    }
    pass(end - now);
  }

  RegisterFile registers;
  CountingNode node;
  Time node_delay = 0;
  Time now = 1000;
  Coprocessor coprocessor;

 private:
  void poll_when_due() {
    while (coprocessor.deadline() <= now)
      coprocessor.poll(now);
  }

  std::deque<Time> due_;  ///< times of the responses
};

/// The module as a Modbus client sees it.
struct ModuleUnit final : protocols::ModbusUnit {
  explicit ModuleUnit(ScannedModule& module) : module_(module) {}
  std::span<std::uint16_t> registers() override { return module_.registers.words; }
  modbus::Pdu handle(const protocols::ModbusRequest&, Room) override { return {}; }
  void on_taken(const modbus::Range& taken) override {
    taken.count != 0 ? module_.written(taken.first, taken.count) : module_.poll();
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
    registers_[0] = 0xCA0E;
    std::ranges::copy(requests_.next(), registers_.begin() + 1);
    waiting_ = true;
    waited_ = 0;
  }
  void restart(bool cleared) override {
    if (cleared) std::ranges::fill(registers_, std::uint16_t{0});
    rest();
  }
  unsigned ended() const override { return requests_.ended; }
  void check() override { requests_.check(node_); }

 private:
  void wait() {
    if (registers_[0] != 0xCA0E) {
      waiting_ = false;
      requests_.take(registers_[0], registers_[5], registers_[6] | std::uint32_t{registers_[7]} << 16, true);
    } else if (++waited_ > patience_) {
      rest();
    }
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
  int waited_ = 0;
  cbcan::test::PlcRequests requests_;
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
