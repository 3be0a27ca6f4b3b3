// SPDX-License-Identifier: MIT
#pragma once

/// What is exchanged with a PLC that owns its registers, request by request: no socket, no time. Each of them
/// is a round of requests, begun by begin(): next() says what to ask, and responded() or lost()
/// what has become of that. The registers are the module's, which is told what has been put into them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "adapters/modbus_unit.hpp"
#include "cbcan/regmap.hpp"
#include "window/request.hpp"

namespace cbcan::io {

class PlcExchange {
 public:
  using Words = std::span<const std::uint16_t>;

  virtual ~PlcExchange() = default;

  /// It is time to look again.
  virtual void begin() = 0;
  /// The next request; none = the round is over.
  virtual std::optional<window::Request> next() = 0;
  /// The response to it; without words, if it only wrote.
  virtual void responded(Words words) = 0;
  /// It was not answered, or by an exception, which may come from a gateway: it may have been executed, or
  /// not. The round is over.
  virtual void lost() = 0;
};

/// R3700..R3769 in the PLC, at `first`. A request is taken whole. While it is under way R3700..R3705 are
/// looked at, and again before the result is written: gone or different means cancelled, and nothing is
/// written; else the words that the contract changes are, R3700 last.
class WindowExchange final : public PlcExchange {
 public:
  /// The unit is the caller's. `refuses`: a request that is there at the first look has the result 5.
  WindowExchange(adapters::ModbusUnit& module, std::uint16_t first, bool refuses = false)
      : module_(module), first_(first), refuses_(refuses) {}

  void begin() override;
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override;

 private:
  enum class Step : std::uint8_t { kRest, kRead, kLook, kWriteData, kWriteFlag };
  using Window = std::array<std::uint16_t, regmap::kWindowWords>;

  std::uint16_t& own(std::size_t address) const { return module_.registers()[address]; }
  bool done() const { return own(regmap::kExecuteFlag) != regmap::kExecute; }
  bool is_taken(Words words) const;
  void look(Words words);
  void take(Words words, bool refuses);
  void cancel(std::uint16_t flag);
  void wait();
  adapters::ModbusRange result_data() const;
  window::Request write(const adapters::ModbusRange& range) const;

  adapters::ModbusUnit& module_;
  std::uint16_t first_;
  Step step_ = Step::kRest;
  bool waits_ = true;            ///< for begin()
  bool unsure_ = false;          ///< the PLC may have been started anew
  bool refuses_;                 ///< what the next look finds may have been executed before the start
  std::optional<Window> taken_;  ///< the request under way, as it was read
};

/// The scanner window's blocks in the PLC: OUT at `first`, IN behind it. Each round reads OUT and the head of
/// IN; where that is not the module's, IN is written, its number last. So a PLC that has cleared IN has it
/// again one round later.
class ScannerExchange final : public PlcExchange {
 public:
  /// `out_first` and `in_first` are the module's registers.
  ScannerExchange(adapters::ModbusUnit& module, std::uint16_t first, std::uint16_t out_first,
                  std::uint16_t in_first)
      : module_(module), first_(first), out_first_(out_first), in_first_(in_first) {}

  void begin() override;
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override { wait(); }

 private:
  enum class Step : std::uint8_t { kRest, kRead, kWriteRest, kWriteNumber };
  /// Number, result, number taken last, size: never all 0 in the module.
  using Head = std::array<std::uint16_t, regmap::kScannerData>;

  Words in() const { return module_.registers().subspan(in_first_, regmap::kScannerInWords); }
  void compare();
  void wait();

  adapters::ModbusUnit& module_;
  std::uint16_t first_;
  std::uint16_t out_first_;
  std::uint16_t in_first_;
  Step step_ = Step::kRest;
  bool waits_ = true;                ///< for begin()
  Head told_{};                      ///< what the PLC has in its head
  std::vector<std::uint16_t> in_{};  ///< what is being written, as it was at once
};

/// Process data in the PLC, at `first`: inputs as they change, and now and then all of them, as the PLC may
/// have lost them; outputs.
class ProcessExchange final : public PlcExchange {
 public:
  /// `own_first` is the module's register.
  ProcessExchange(adapters::ModbusUnit& module, std::uint16_t first, std::uint16_t own_first)
      : module_(module), first_(first), own_first_(own_first) {}

  void begin() override;
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override;

 private:
  enum class Step : std::uint8_t { kRest, kRead, kWrite };
  static constexpr std::size_t kWords = regmap::kProcessWords / 2;  ///< each way
  static constexpr unsigned kRoundsToRepeat = 100;

  adapters::ModbusRange changed() const;

  adapters::ModbusUnit& module_;
  std::uint16_t first_;
  std::uint16_t own_first_;
  Step step_ = Step::kRest;
  unsigned rounds_ = 0;                          ///< since all inputs have been written
  std::array<std::uint16_t, kWords> told_{};     ///< inputs that the PLC has
  std::array<std::uint16_t, kWords> written_{};  ///< and those that it is about to have
};

}  // namespace cbcan::io
