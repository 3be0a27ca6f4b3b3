// SPDX-License-Identifier: MIT
#pragma once

/// The soak's PLCs: each at a door of its network's module, one transaction after the other, each result held
/// against what the nodes have executed.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/soak_plant.hpp"

namespace cbcan::test {

struct SoakRequest {
  enum class Kind { kRead, kWrite, kClock, kMissing, kAbsent, kNmt, kMode };

  /// As in R3701..R3769.
  std::array<std::uint16_t, 5> head() const { return {command, node, index, sub, size}; }

  Kind kind = Kind::kRead;
  std::uint16_t command = 0;
  std::uint16_t node = 0;
  std::uint16_t index = 0;
  std::uint16_t sub = 0;
  std::uint16_t size = 0;
  std::uint32_t id = 0;  ///< of a write
  Bytes data;
};

struct SoakResult {
  std::uint16_t code = 0;
  std::uint16_t size = 0;
  std::array<std::uint16_t, regmap::kDataWords> words{};

  Bytes bytes() const {
    Bytes bytes;
    for (std::size_t i = 0; i < size; ++i)
      bytes.push_back(static_cast<std::uint8_t>(words.at(i / 2) >> 8 * (i % 2)));
    return bytes;
  }
  /// A value of four bytes, or an abort code.
  std::uint32_t number() const { return words[0] | std::uint32_t{words[1]} << 16; }
};

/// Where a PLC's requests go in and results come out.
struct Door {
  virtual ~Door() = default;
  virtual void begin(const SoakRequest& request) = 0;
  virtual std::optional<SoakResult> look() = 0;
  /// False: there will be no result.
  virtual bool cancel() = 0;
  /// The PLC has been switched on; true when it may begin.
  virtual void switch_on() = 0;
  virtual bool ready() = 0;
  /// The PLC knows that the module has restarted, and that a request is lost by it.
  virtual bool notices_restart() const = 0;
};

/// R3700.
struct FlagDoor final : Door {
  explicit FlagDoor(SoakNetwork& network) : network_(network) {}

  void begin(const SoakRequest& request) override;
  std::optional<SoakResult> look() override;
  bool cancel() override {
    flag() = 0;
    network_.written(regmap::kExecuteFlag, 1);
    return false;
  }
  void switch_on() override { cancel(); }
  bool ready() override { return true; }
  bool notices_restart() const override { return true; }

 private:
  std::uint16_t& flag() { return network_.registers.at(regmap::kExecuteFlag); }

  SoakNetwork& network_;
};

/// The scanner window, by the program of docs/scanner.md: it exchanges whole blocks, and knows nothing else.
struct ScannerDoor final : Door {
  explicit ScannerDoor(SoakNetwork& network) : network_(network) {}

  void begin(const SoakRequest& request) override;
  std::optional<SoakResult> look() override;
  bool cancel() override {
    out_[0] = 0;
    exchange();
    return true;
  }
  void switch_on() override {
    in_.fill(0);
    out_.fill(0);
  }
  bool ready() override {
    exchange();
    number_ = in_[2];
    return in_[1] != 0 || in_[2] != 0;
  }
  bool notices_restart() const override { return false; }

 private:
  void exchange();

  SoakNetwork& network_;
  std::uint16_t number_ = 0;
  std::array<std::uint16_t, regmap::kScannerOutWords> out_{};
  std::array<std::uint16_t, regmap::kScannerInWords> in_{};
};

struct SoakPlc {
  /// `place` is 0 or 1. It gives a request up after `patience`.
  SoakPlc(SoakNetwork& network, Door& door, std::uint16_t place, std::uint64_t seed, Time patience)
      : network_(network), door_(door), place_(place), random_(seed), patience_(patience) {}

  Time wake() const { return wake_; }
  void act();

  std::uint64_t ended = 0;
  std::uint64_t good = 0;
  std::uint64_t failed = 0;        ///< as the faults explain
  std::uint64_t unknown = 0;       ///< no result, by a cancel or a restart
  std::vector<std::string> wrong;  ///< what must not be

 private:
  enum class Phase { kStarting, kIdle, kWaiting };

  SoakRequest choose();
  SoakRequest choose_transfer(bool write);
  void begin();
  void wait();
  void end_without_result();
  void go_on();
  void judge(const SoakResult& result);
  void judge_good(const SoakResult& result);
  void judge_abort(std::uint32_t code);
  bool was_there(const Bytes& bytes) const;
  bool is_now(const SoakResult& result) const;
  void complain(const std::string& what);

  SoakNetwork& network_;
  Door& door_;
  std::uint16_t place_;
  sim::Random random_;
  Time patience_;
  Phase phase_ = Phase::kStarting;
  Time wake_ = 0;
  Time period_ = 0;
  SoakRequest request_;
  Time begun_ = 0;
  bool cancelled_ = false;
  std::uint64_t begun_in_ = 0;   ///< in which of the module's lives the request has begun
  std::uint64_t result_in_ = 0;  ///< and the last result has come
  std::uint32_t id_ = 0;
};

}  // namespace cbcan::test
