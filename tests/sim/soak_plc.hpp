// SPDX-License-Identifier: MIT
#pragma once

/// The PLCs of the soak test: each has an access to the module of its network and runs one transaction after the
/// other. Each result is checked against what the nodes have executed.

#include "sim/soak_plant.hpp"

namespace cbcan::test {

inline constexpr std::uint16_t kReadCommand = 5055, kWriteCommand = 5066;
inline constexpr std::uint16_t kAbsentNode = 99, kNmtObject = 0x1F82, kModeObject = 0x3004;
inline constexpr Time kLongest = 60 * kSecond;  ///< longest transaction, whatever the faults
inline constexpr std::uint32_t kNoObject = 0x06020000, kTimeout = 0x05040000, kCancelled = 0x08000000;

inline std::uint16_t word_of(const Bytes& bytes, std::size_t k) {
  const auto at = [&](std::size_t i) { return i < bytes.size() ? bytes[i] : 0u; };
  return static_cast<std::uint16_t>(at(2 * k) | at(2 * k + 1) << 8);
}

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

/// Command, node, index, sub-index, size and data.
template <class Words>
inline std::size_t put(const SoakRequest& request, Words words) {
  const auto head = request.head();
  auto next = std::copy(head.begin(), head.end(), words);
  const std::size_t count = (request.data.size() + 1) / 2;
  for (std::size_t k = 0; k < count; ++k)
    *next++ = word_of(request.data, k);
  return head.size() + count;
}

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

/// How a PLC sends requests and gets results.
struct Access {
  virtual ~Access() = default;
  virtual void begin(const SoakRequest& request) = 0;
  virtual std::optional<SoakResult> look() = 0;
  /// False: there will be no result.
  virtual bool cancel() = 0;
  /// The PLC has been switched on; it may begin when ready() is true.
  virtual void switch_on() = 0;
  virtual bool ready() = 0;
  /// The PLC notices that the module has restarted and that its request is lost.
  virtual bool notices_restart() const = 0;
};

/// R3700.
struct FlagAccess final : Access {
  explicit FlagAccess(SoakNetwork& network) : network_(network) {}

  void begin(const SoakRequest& request) override {
    flag() = 0xCA0E;
    const std::size_t count = put(request, network_.registers.words.begin() + regmap::kCommand);
    network_.written(regmap::kExecuteFlag, 1 + count);
  }
  std::optional<SoakResult> look() override {
    if (flag() == 0xCA0E) return std::nullopt;
    SoakResult result{flag(), network_.registers[regmap::kDataSize]};
    std::copy_n(network_.registers.words.begin() + regmap::kData, regmap::kDataWords, result.words.begin());
    return result;
  }
  bool cancel() override {
    flag() = 0;
    network_.written(regmap::kExecuteFlag, 1);
    return false;
  }
  void switch_on() override { cancel(); }
  bool ready() override { return true; }
  bool notices_restart() const override { return true; }

 private:
  std::uint16_t& flag() { return network_.registers[regmap::kExecuteFlag]; }

  SoakNetwork& network_;
};

/// The scanner window, by the program of docs/how-to/scanner.md: it only exchanges whole blocks.
struct ScannerAccess final : Access {
  explicit ScannerAccess(SoakNetwork& network) : network_(network) {}

  void begin(const SoakRequest& request) override {
    number_ = number_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(number_ + 1);
    out_.fill(0);
    out_[0] = number_;
    put(request, out_.begin() + 1);
    exchange();
  }
  std::optional<SoakResult> look() override {
    exchange();
    if (in_[0] != number_) return std::nullopt;
    SoakResult result{in_[1], in_[3]};
    std::copy_n(in_.begin() + 4, regmap::kDataWords, result.words.begin());
    return result;
  }
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
  void exchange() {
    network_.registers.put(regmap::kScannerOutFirst, out_);
    network_.written(regmap::kScannerOutFirst, out_.size());
    std::copy_n(network_.registers.words.begin() + regmap::kScannerInFirst, in_.size(), in_.begin());
  }

  SoakNetwork& network_;
  std::uint16_t number_ = 0;
  std::array<std::uint16_t, regmap::kScannerOutWords> out_{};
  std::array<std::uint16_t, regmap::kScannerInWords> in_{};
};

struct SoakPlc {
  /// `place` is 0 or 1. The PLC abandons a request after `patience`.
  SoakPlc(SoakNetwork& network, Access& access, std::uint16_t place, std::uint64_t seed, Time patience)
      : network_(network), access_(access), place_(place), random_(seed), patience_(patience) {}

  Time wake() const { return wake_; }
  void act() {
    wake_ = network_.now + period_;
    switch (phase_) {
      case Phase::kStarting:
        if (access_.ready()) go_on();
        break;
      case Phase::kIdle: begin(); break;
      case Phase::kWaiting: wait(); break;
    }
  }

  std::uint64_t ended = 0;
  std::uint64_t good = 0;
  std::uint64_t failed = 0;        ///< because of faults
  std::uint64_t unknown = 0;       ///< without a result, because of a cancel or a restart
  std::vector<std::string> wrong;  ///< violations

 private:
  enum class Phase { kStarting, kIdle, kWaiting };

  SoakRequest choose() {
    using Kind = SoakRequest::Kind;
    constexpr std::array<std::uint8_t, 4> kServices{1, 128, 129, 130};
    const std::uint32_t chance = random_.below(1000);
    SoakRequest request = choose_transfer(chance % 2 == 0 && chance >= 30);
    if (chance < 20) {
      request.kind = Kind::kMissing;
      request.index = 0x2FFF;
    } else if (chance < 26) {
      request.kind = Kind::kAbsent;
      request.node = kAbsentNode;
    } else if (chance < 28) {
      request = {
          Kind::kNmt, kWriteCommand, 0, kNmtObject, request.node, 1, 0, {kServices.at(random_.below(4))}};
    } else if (chance < 30) {
      constexpr std::array<std::uint8_t, 3> kModes{0, 2, 3};
      request = {Kind::kMode, kWriteCommand, 0, kModeObject, 0, 1, 0, {kModes.at(random_.below(3))}};
    } else if (request.kind == Kind::kRead && chance < 500) {
      request = {Kind::kClock, kReadCommand, request.node, SoakObjects::kClock, 0, 4, 0, {}};
    }
    return request;
  }
  SoakRequest choose_transfer(bool write) {
    const bool number = random_.below(2) == 0;
    SoakRequest request;
    request.kind = write ? SoakRequest::Kind::kWrite : SoakRequest::Kind::kRead;
    request.command = write ? kWriteCommand : kReadCommand;
    request.node = SoakNetwork::kNodes.at(random_.below(3));
    request.index =
        static_cast<std::uint16_t>((number ? SoakObjects::kNumbers : SoakObjects::kTexts) + place_);
    request.sub = static_cast<std::uint16_t>(1 + random_.below(SoakObjects::kSubs));
    request.size = number ? 4 : SoakObjects::kMostBytes;
    if (!write) return request;
    if (!number) request.size = static_cast<std::uint16_t>(5 + random_.below(SoakObjects::kMostBytes - 4));
    request.id = ++id_;
    request.data = written_by(request.id, request.size);
    return request;
  }
  void begin() {
    request_ = choose();
    begun_ = network_.now;
    begun_in_ = network_.lives;
    cancelled_ = false;
    phase_ = Phase::kWaiting;
    if (request_.kind == SoakRequest::Kind::kNmt) network_.harm();
    access_.begin(request_);
  }
  void wait() {
    const Time waited = network_.now - begun_;
    const bool restarted = begun_in_ != network_.lives;
    const bool switched_off = random_.below(20'000) == 0;
    if ((restarted && access_.notices_restart()) || switched_off) {
      end_without_result();
      access_.switch_on();
      phase_ = Phase::kStarting;
      wake_ = network_.now + 3 * kSecond;
    } else if (const auto result = access_.look()) {
      judge(*result);
      result_in_ = network_.lives;
      ++ended;
      go_on();
    } else if (waited > kLongest) {
      complain("no result");
      end_without_result();
    } else if (waited > patience_ && !cancelled_) {
      cancelled_ = true;
      if (!access_.cancel()) end_without_result();
    }
  }
  void end_without_result() {
    ++ended;
    ++unknown;
    go_on();
  }
  void go_on() {
    phase_ = Phase::kIdle;
    period_ = (5 + random_.below(60)) * kMillisecond;
    wake_ = network_.now + random_.below(1050) * kMillisecond;
  }
  void judge(const SoakResult& result) {
    if (result.code == 0) return judge_good(result);
    if (result.code == 4) return judge_abort(result.number());
    const bool first_of_module = result.code == 5 && !access_.notices_restart() && result_in_ != network_.lives;
    if (!first_of_module) return complain("result " + std::to_string(result.code));
    ++unknown;
  }
  void judge_good(const SoakResult& result) {
    ++good;
    switch (request_.kind) {
      case SoakRequest::Kind::kRead:
        if (!was_there(result.bytes())) complain("read a wrong value");
        break;
      case SoakRequest::Kind::kWrite:
        if (!was_there(request_.data)) complain("believed a write that was not executed");
        break;
      case SoakRequest::Kind::kClock:
        if (!is_now(result)) complain("read an old value");
        break;
      case SoakRequest::Kind::kNmt:
      case SoakRequest::Kind::kMode: break;
      case SoakRequest::Kind::kMissing:
      case SoakRequest::Kind::kAbsent: complain("found what is not there"); break;
    }
  }
  void judge_abort(std::uint32_t code) {
    ++failed;
    if (code == 0) return complain("an abort without a code");
    if (cancelled_ && code == kCancelled) return;
    if (request_.kind == SoakRequest::Kind::kAbsent && code == kTimeout) return;
    if (request_.kind == SoakRequest::Kind::kMissing && code == kNoObject) return;
    if (network_.quiet_since(begun_)) complain("abort " + std::to_string(code) + " where nothing goes wrong");
  }
  bool was_there(const Bytes& bytes) const {
    return network_.node(static_cast<std::uint8_t>(request_.node))
        .had(request_.index, static_cast<std::uint8_t>(request_.sub), bytes, begun_);
  }
  /// The node's clock, in 32 bits, has been read since the request began.
  bool is_now(const SoakResult& result) const {
    const std::uint32_t age = static_cast<std::uint32_t>(network_.now) - result.number();
    return result.size == 4 && age <= network_.now - begun_;
  }
  void complain(const std::string& what) {
    constexpr std::size_t kEnough = 20;
    if (wrong.size() == kEnough) return;
    wrong.push_back("PLC " + std::to_string(place_) + ", " + std::to_string(network_.now) + " us, node " +
                    std::to_string(request_.node) + ", object " + std::to_string(request_.index) + ":" +
                    std::to_string(request_.sub) + ", begun " + std::to_string(begun_) + ": " + what);
  }

  SoakNetwork& network_;
  Access& access_;
  std::uint16_t place_;
  sim::Random random_;
  Time patience_;
  Phase phase_ = Phase::kStarting;
  Time wake_ = 0;
  Time period_ = 0;
  SoakRequest request_;
  Time begun_ = 0;
  bool cancelled_ = false;
  std::uint64_t begun_in_ = 0;   ///< SoakNetwork::lives when the request began
  std::uint64_t result_in_ = 0;  ///< SoakNetwork::lives at the last result
  std::uint32_t id_ = 0;
};

}  // namespace cbcan::test
