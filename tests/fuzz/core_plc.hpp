// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "cbcan/regmap.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

inline constexpr std::uint16_t kExecute = 0xCA0E;

inline bool is_nmt_service(std::uint16_t code) {
  constexpr std::array<std::uint16_t, 10> kCodes{1, 2, 4, 5, 6, 7, 127, 128, 129, 130};
  return std::ranges::find(kCodes, code) != kCodes.end();
}

/// What a PLC program may rely on (docs/reference/contract.md), checked after every call of the core: which registers
/// have changed, and to what.
struct Plc {
  enum class Kind : std::uint8_t { kRefused, kNmt, kNodeState, kLocal, kSdo };

  /// The current or last transaction, as in the registers when it began.
  struct Request {
    std::uint16_t command, node, index, sub, size;
    std::array<std::uint16_t, regmap::kDataWords> data;
    Kind kind;
    std::uint16_t result;      ///< of kRefused
    std::uint32_t abort_code;  ///< of kRefused with result 4
    bool is_read() const { return command == 5055; }
    std::uint8_t byte(std::size_t at) const {
      return static_cast<std::uint8_t>(data[at / 2] >> (at % 2 * 8));
    }
  };

  explicit Plc(std::uint8_t own_node) : own_node_(own_node) {}

  std::uint16_t& reg(unsigned address) { return registers.at(address - 3700); }

  /// Another window is used too: a transaction may begin late, with the values in the registers then.
  bool shared = false;

  /// Call them before and after each call of the core; only a poll reads R3700.
  void before_poll() {
    seen_ = registers;
    const bool wanted = word(3700) == kExecute;
    if (wanted && !busy_) begin();
    if (!wanted) busy_ = false;
  }
  void before_frame() { seen_ = registers; }
  void after() {
    const bool ended = busy_ && word(3700) != kExecute;
    if (!ended) {
      require(registers == seen_, "the registers change only when a transaction ends");
      require(!busy_ || shared || (request_.kind != Kind::kRefused && request_.kind != Kind::kLocal),
              "what needs no bus is done at once");
      return;
    }
    busy_ = false;
    result_ = word(3700);
    if (!shared) return check_end();
    require(result_ <= 2 || result_ == 4, "a result code is 0, 1, 2 or 4");
    require(unchanged(3701, 3704), "what the PLC alone writes stays");
  }

  bool busy() const { return busy_; }
  const Request& request() const { return request_; }
  /// Number of transactions.
  unsigned number() const { return number_; }
  /// R3700 of the last transaction that was not cancelled; CA0Eh = none yet.
  std::uint16_t result() const { return result_; }

  std::array<std::uint16_t, regmap::kWindowWords> registers{};

 private:
  void begin() {
    ++number_;
    busy_ = true;
    result_ = kExecute;
    request_ = {word(3701), word(3702), word(3703), word(3704), word(3705), {}, Kind::kRefused, 0, 0};
    std::copy(registers.begin() + 6, registers.end(), request_.data.begin());
    request_.kind = kind_of(request_);
  }
  /// The checks of the contract, in its order.
  Kind kind_of(Request& request) const {
    const bool write = request.command == 5066;
    if (!write && !request.is_read()) return refuse(request, 1, 0);
    if (write && request.index == 0x1F82) {
      if (request.sub == 0 || request.sub > 128) return refuse(request, 4, 0x06090011);
      return is_nmt_service(request.data[0]) ? Kind::kNmt : refuse(request, 4, 0x06090030);
    }
    if (request.node > 127) return refuse(request, 2, 0);
    if (!write && request.index == 0x300C && request.sub == 0) return Kind::kNodeState;
    if (request.sub > 255) return refuse(request, 4, 0x06090011);
    if (request.size == 0 || request.size > 128) return refuse(request, 4, 0x06040047);
    return request.node == 0 || request.node == own_node_ ? Kind::kLocal : Kind::kSdo;
  }
  Kind refuse(Request& request, std::uint16_t result, std::uint32_t code) const {
    request.result = result;
    request.abort_code = code;
    return Kind::kRefused;
  }
  void check_end() {
    if (request_.kind == Kind::kRefused)
      require(result_ == request_.result, "a bad request has its result code");
    if (request_.kind == Kind::kNodeState) require(result_ == 0, "a node state is always told");
    if (result_ == 4) return check_failure();
    require(unchanged(3701, 3704), "what the PLC alone writes stays");
    if (result_ != 0 || !request_.is_read()) {
      require(result_ == 0 || request_.kind == Kind::kRefused, "a result code is 0, 1, 2 or 4");
      return require(unchanged(3705, 3769), "a good write and a bad request change R3700 alone");
    }
    check_good_read();
  }
  void check_failure() const {
    const std::uint32_t code = word(3706) | std::uint32_t{word(3707)} << 16;
    require(code != 0, "a failure has an abort code");
    require(request_.kind != Kind::kRefused || code == request_.abort_code,
            "a bad request has its abort code");
    require(request_.kind != Kind::kNmt || code == 0x05040000, "an NMT service fails by time alone");
    require(unchanged(3701, 3705) && unchanged(3708, 3769), "a failure changes R3700, R3706 and R3707");
  }
  void check_good_read() const {
    const std::size_t size = word(3705);
    const bool state = request_.kind == Kind::kNodeState;
    require(size <= (state ? 1u : request_.size), "not more bytes than there is room");
    if (state) {
      const std::uint16_t told = word(3706);
      require(size == 1 && (told == 4 || told == 5 || told == 6 || told == 127),
              "a node state is one of four");
    }
    const auto words = static_cast<unsigned>((size + 1) / 2);
    require(unchanged(3706 + words, 3769), "words past the last byte stay");
    require(size % 2 == 0 || word(3705 + words) < 256, "the unused high byte is 0");
  }
  bool unchanged(std::size_t first, std::size_t last) const {
    for (std::size_t i = first - 3700; i <= last - 3700; ++i)
      if (registers[i] != seen_[i]) return false;
    return true;
  }
  std::uint16_t word(unsigned address) const { return registers[address - 3700]; }

  std::uint8_t own_node_;
  std::array<std::uint16_t, regmap::kWindowWords> seen_{};
  Request request_{};
  unsigned number_ = 0;
  std::uint16_t result_ = 0xCA0E;
  bool busy_ = false;
};

}  // namespace cbcan::fuzz
