// SPDX-License-Identifier: MIT
#pragma once

/// What is exchanged with a PLC that owns its registers, request by request: no socket, no time. An exchange
/// is a round of requests, started by begin(): next() returns a request, and responded() or lost() takes its
/// result. The module's registers are updated, and the module is notified of the changes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"
#include "protocols/modbus_server.hpp"

namespace cbcan::protocols {

class PlcExchange {
 public:
  using Words = std::span<const std::uint16_t>;

  virtual ~PlcExchange() = default;

  /// Starts a round.
  virtual void begin() = 0;
  /// The next request; nullopt = the round has ended.
  virtual std::optional<window::Request> next() = 0;
  /// Takes the response to it; no words if it only wrote.
  virtual void responded(Words words) = 0;
  /// The request was not answered, or by an exception, which may come from a gateway: whether it was executed
  /// is unknown. The round ends.
  virtual void lost() = 0;
};

/// R3700..R3769 in the PLC, at `first`. A request is taken as a whole. R3700..R3705 are polled while it is in
/// progress, and again before the result is written: if they are cleared or different, the request was
/// cancelled, and nothing is written; otherwise the words that the contract changes are written, R3700 last.
class WindowExchange final : public PlcExchange {
 public:
  /// The unit outlives this. `refuses`: a request that is present at the first poll gets result 5.
  WindowExchange(protocols::ModbusUnit& module, std::uint16_t first, bool refuses = false)
      : module_(module), first_(first), refuses_(refuses) {}

  void begin() override {
    if (step_ == Step::kRest) step_ = taken_ && !unsure_ ? Step::kLook : Step::kRead;
  }
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override;

 private:
  /// kRest: until begin(), or a result of a request that the PLC still has.
  enum class Step : std::uint8_t { kRest, kRead, kLook, kWriteData, kWriteFlag };
  using Window = std::array<std::uint16_t, regmap::kWindowWords>;

  std::uint16_t& own(std::size_t address) const { return module_.registers()[address]; }
  bool done() const { return own(regmap::kExecuteFlag) != regmap::kExecute; }
  bool is_taken(Words words) const;
  void look(Words words);
  void take(Words words, bool refuses);
  void cancel(std::uint16_t flag);
  modbus::Range result_data() const;
  window::Request write(const modbus::Range& range) const;

  protocols::ModbusUnit& module_;
  std::uint16_t first_;
  Step step_ = Step::kRest;
  bool unsure_ = false;          ///< the PLC may have been restarted
  bool refuses_;                 ///< a request found by the next poll may have been executed before the start
  std::optional<Window> taken_;  ///< the request in progress, as it was read
};

/// The scanner window's blocks in the PLC: OUT at `first`, then IN. Each round reads OUT and the head of IN;
/// if the head differs from the module's, IN is written, its number last. So a PLC that has cleared IN gets
/// it again one round later.
class ScannerExchange final : public PlcExchange {
 public:
  /// `out_first` and `in_first` are the module's registers.
  ScannerExchange(protocols::ModbusUnit& module, std::uint16_t first, std::uint16_t out_first,
                  std::uint16_t in_first)
      : module_(module), first_(first), out_first_(out_first), in_first_(in_first) {}

  void begin() override {
    if (step_ == Step::kWait || step_ == Step::kRest) step_ = Step::kRead;
  }
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override { step_ = Step::kWait; }

 private:
  /// kWait: until begin(); kRest: until begin() or a result.
  enum class Step : std::uint8_t { kWait, kRest, kRead, kWriteRest, kWriteNumber };
  /// Number, result, number taken last, size: never all 0 in the module.
  using Head = std::array<std::uint16_t, regmap::kScannerData>;

  Words in() const { return module_.registers().subspan(in_first_, regmap::kScannerInWords); }
  void compare();

  protocols::ModbusUnit& module_;
  std::uint16_t first_;
  std::uint16_t out_first_;
  std::uint16_t in_first_;
  Step step_ = Step::kWait;
  Head told_{};                      ///< the PLC's head
  std::vector<std::uint16_t> in_{};  ///< snapshot of what is being written
};

/// Registers of the module that are written to the PLC, at `first`, as they change; from time to time all of
/// them, as the PLC may have lost them.
class CopyExchange final : public PlcExchange {
 public:
  /// `own_first` is the module's register.
  CopyExchange(protocols::ModbusUnit& module, std::uint16_t first, std::uint16_t own_first, std::size_t words)
      : module_(module), first_(first), own_first_(own_first), told_(words), written_(words) {}

  void begin() override;
  /// Writes a part that differs, at most as one request may have.
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override;

  /// All are to be written.
  bool forgotten() const { return rounds_ == 0; }
  bool differs() const { return changed().count != 0; }

 private:
  static constexpr unsigned kRoundsToRepeat = 100;

  Words own() const { return module_.registers().subspan(own_first_, told_.size()); }
  modbus::Range changed() const;

  protocols::ModbusUnit& module_;
  std::uint16_t first_;
  std::uint16_t own_first_;
  unsigned rounds_ = 0;                 ///< until all are written again
  std::vector<std::uint16_t> told_;     ///< the PLC's
  std::vector<std::uint16_t> written_;  ///< what is being written
  modbus::Range range_{};               ///< of it
};

/// Process data in the PLC, at `first`: outputs, and inputs as they change.
class ProcessExchange final : public PlcExchange {
 public:
  /// `own_first` is the module's register.
  ProcessExchange(protocols::ModbusUnit& module, std::uint16_t first, std::uint16_t own_first)
      : module_(module), first_(first), own_first_(own_first), inputs_(module, first, own_first, kWords) {}

  void begin() override;
  std::optional<window::Request> next() override;
  void responded(Words words) override;
  void lost() override;

 private:
  enum class Step : std::uint8_t { kRest, kRead, kWrite };
  static constexpr std::size_t kWords = regmap::kProcessWords / 2;  ///< each way

  protocols::ModbusUnit& module_;
  std::uint16_t first_;
  std::uint16_t own_first_;
  Step step_ = Step::kRest;
  CopyExchange inputs_;
};

}  // namespace cbcan::protocols
