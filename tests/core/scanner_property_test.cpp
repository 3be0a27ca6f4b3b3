// SPDX-License-Identifier: MIT
// A PLC that keeps to the handshake of the scanner window, between exchanges, restarts and losses that come
// at random: no old result is believed, nothing is executed twice, nothing is torn.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "coprocessor/coprocessor.hpp"
#include "support/catch.hpp"

using namespace cbcan;

namespace {

constexpr std::uint8_t kNode = 5;

/// What stands in an object is a number of its address that nobody else has.
std::uint32_t value_of(std::uint16_t index, std::uint8_t sub) {
  return (std::uint32_t{index} << 8 | sub) * 2654435761u;
}

std::uint32_t load32(const Frame& frame) {
  return frame.data[4] | std::uint32_t{frame.data[5]} << 8 | std::uint32_t{frame.data[6]} << 16 |
         std::uint32_t{frame.data[7]} << 24;
}

/// Node 5 on a wire: expedited transfers of four bytes. Counts what it is asked to do, by the 32-bit number
/// that makes each request another one: the value written, or index and sub-index read.
class Wire final : public CanPort {
 public:
  bool try_send(const Frame& frame) override {
    if (frame.id != 0x600u + kNode) return true;
    const std::uint8_t command = frame.data[0];
    const auto index = static_cast<std::uint16_t>(frame.data[1] | frame.data[2] << 8);
    Frame response{.id = 0x580u + kNode, .length = 8};
    std::copy_n(frame.data.begin() + 1, 3, response.data.begin() + 1);
    if (command == 0x23) {
      ++written[load32(frame)];
      response.data[0] = 0x60;
    } else if (command == 0x40) {
      const std::uint32_t value = value_of(index, frame.data[3]);
      ++read[std::uint32_t{index} << 8 | frame.data[3]];
      response.data[0] = 0x43;
      for (unsigned i = 0; i < 4; ++i)
        response.data[4 + i] = static_cast<std::uint8_t>(value >> 8 * i);
    } else {
      return true;  // an abort: nobody waits any more
    }
    under_way.push_back(response);
    return true;
  }

  std::map<std::uint32_t, int> written;
  std::map<std::uint32_t, int> read;
  std::vector<Frame> under_way;
};

/// A module with its registers, which may be switched off and on.
struct Module {
  std::array<std::uint16_t, regmap::kRegisterFileWords> registers{};
  Wire wire;
  std::optional<Coprocessor> coprocessor;
  Time now = 1000;

  Module() { power_on(); }

  void power_on() {
    registers.fill(0);
    wire.under_way.clear();
    const std::span<std::uint16_t, regmap::kRegisterFileWords> all(registers);
    Coprocessor::Settings settings;
    settings.sdo_timeout_ms = 50;
    coprocessor.emplace(RegisterWindow(all.subspan<regmap::kWindowFirst, regmap::kWindowWords>()),
                        all.subspan<regmap::kProcessFirst, regmap::kProcessWords>(), wire, settings,
                        ScannerWindow(all.subspan<regmap::kScannerOutFirst, regmap::kScannerOutWords>(),
                                      all.subspan<regmap::kScannerInFirst, regmap::kScannerInWords>()));
    coprocessor->start(now);
    poll();
  }
  void poll() {
    while (coprocessor->poll(now) <= now) {
    }
  }
  void write(std::size_t first, std::span<const std::uint16_t> words) {
    std::copy(words.begin(), words.end(), registers.begin() + static_cast<std::ptrdiff_t>(first));
    coprocessor->on_registers_written(first, words.size(), now);
    poll();
  }
  void deliver_response() {
    if (wire.under_way.empty()) return;
    const Frame frame = wire.under_way.front();
    wire.under_way.erase(wire.under_way.begin());
    coprocessor->on_frame(frame, now);
    poll();
  }
  void lose_response() {
    if (!wire.under_way.empty()) wire.under_way.erase(wire.under_way.begin());
  }
  void pass(Time duration) {
    now += duration;
    poll();
  }
};

/// The recipe of docs/ladder.md, with its image of both blocks; requests with a number of their own each.
class Plc {
 public:
  static constexpr std::size_t kOut = 8;
  static constexpr std::size_t kIn = 6;
  static constexpr int kPatience = 40;  ///< scans

  struct Done {
    bool write;
    std::uint32_t id;
  };

  void restart() {
    in.fill(0);
    out.fill(0);
    phase_ = Phase::kStarting;
  }

  /// One scan of the program. What it believes to be done is in `done`.
  void scan() {
    switch (phase_) {
      case Phase::kStarting:
        out[0] = 0;
        if (in[1] != 0 || in[2] != 0) {
          number_ = in[2];
          phase_ = Phase::kIdle;
        }
        break;
      case Phase::kIdle: request(); break;
      case Phase::kWaiting:
        if (in[0] == number_) {
          take_result();
        } else if (++waited_ > kPatience) {
          out[0] = 0;
          phase_ = Phase::kCancelling;
        }
        break;
      case Phase::kCancelling:
        if (in[0] == number_ || in[1] == 5) phase_ = Phase::kIdle;
        break;
    }
  }

  std::array<std::uint16_t, kOut> out{};
  std::array<std::uint16_t, kIn> in{};
  std::vector<Done> done;
  std::map<std::uint16_t, int> results;

 private:
  enum class Phase { kStarting, kIdle, kWaiting, kCancelling };

  void request() {
    number_ = number_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(number_ + 1);
    ++id_;
    write_ = id_ % 2 == 0;
    const std::uint16_t low = static_cast<std::uint16_t>(id_);
    const std::uint16_t high = static_cast<std::uint16_t>(id_ >> 16);
    if (write_) {
      out = {number_, 5066, kNode, 0x2000, 0, 4, low, high};
    } else {
      out = {
          number_, 5055, kNode, static_cast<std::uint16_t>(id_ >> 8), static_cast<std::uint16_t>(id_ & 0xFF),
          4,       0,    0};
    }
    waited_ = 0;
    phase_ = Phase::kWaiting;
  }

  void take_result() {
    ++results[in[1]];
    phase_ = Phase::kIdle;
    if (in[1] != 0) return;
    done.push_back({write_, id_});
    if (write_) return;
    REQUIRE(in[3] == 4);
    const std::uint32_t value = in[4] | std::uint32_t{in[5]} << 16;
    REQUIRE(value == value_of(static_cast<std::uint16_t>(id_ >> 8), static_cast<std::uint8_t>(id_)));
  }

  Phase phase_ = Phase::kStarting;
  std::uint16_t number_ = 0;
  std::uint32_t id_ = 0x200000;  ///< of the request; never used twice, also after a restart
  bool write_ = false;
  int waited_ = 0;
};

/// What happens to a PLC and a module, one thing at a time.
class Interleaving {
 public:
  explicit Interleaving(std::uint32_t seed) : random_(seed) {}

  void step() {
    const unsigned dice = pick(1000);
    if (dice < 300) {
      plc.scan();
    } else if (dice < 480) {
      write_block();
    } else if (dice < 660) {
      read_block();
    } else if (dice < 820) {
      module.deliver_response();
    } else if (dice < 960) {
      module.pass(pick(3000));
      other_window();
    } else if (dice < 968) {
      module.lose_response();
    } else if (dice < 976) {
      module.pass(60'000);
    } else if (dice < 982) {
      plc.restart();
    } else if (dice < 986) {
      module.power_on();
    } else if (dice < 992) {  // STOP, or a gateway that has lost its PLC: outputs go to 0, and come back
      module.write(regmap::kScannerOutFirst, std::array<std::uint16_t, Plc::kOut>{});
    } else if (dice < 996) {
      plc.in.fill(0);
    } else {
      in_pieces();
    }
  }

  void check() const {
    for (const auto& [id, times] : module.wire.written) {
      INFO("write " << id);
      REQUIRE(times == 1);
    }
    for (const auto& [id, times] : module.wire.read) {
      INFO("read " << id);
      REQUIRE(times == 1);
    }
    for (const Plc::Done& done : plc.done) {
      INFO("done " << done.id);
      const auto& executed = done.write ? module.wire.written : module.wire.read;
      REQUIRE(executed.contains(done.id));
    }
  }

  Module module;
  Plc plc;

 private:
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }

  void write_block() { module.write(regmap::kScannerOutFirst, plc.out); }
  void read_block() {
    std::copy_n(module.registers.begin() + regmap::kScannerInFirst, Plc::kIn, plc.in.begin());
  }
  /// What a master that splits blocks does in the worst case: number first, the rest later.
  void in_pieces() {
    const std::span words(plc.out);
    const std::size_t cut = 1 + pick(Plc::kOut - 1);
    module.write(regmap::kScannerOutFirst, words.first(cut));
    plc.scan();
    module.write(regmap::kScannerOutFirst + cut, words.subspan(cut));
  }
  /// Somebody else uses R3700 meanwhile, for an object that the PLC leaves alone.
  void other_window() {
    if (pick(4) != 0 || module.registers[regmap::kExecuteFlag] == regmap::kExecute) return;
    const auto id = static_cast<std::uint16_t>(++other_);
    module.write(regmap::kWindowFirst,
                 std::array<std::uint16_t, 8>{regmap::kExecute, 5066, kNode, 0x3000, 0, 4, id, 0x00FF});
  }

  std::mt19937 random_;
  unsigned other_ = 0;
};

}  // namespace

TEST_CASE("The scanner window: nothing is believed, executed twice or torn that should not be") {
  std::map<std::uint16_t, int> results;
  std::size_t done = 0;
  for (std::uint32_t seed = 1; seed <= 300; ++seed) {
    Interleaving interleaving(seed);
    for (int i = 0; i < 2000; ++i)
      interleaving.step();
    interleaving.check();
    done += interleaving.plc.done.size();
    for (const auto& [result, times] : interleaving.plc.results)
      results[result] += times;
  }
  CHECK(done > 10'000);
  for (const std::uint16_t result : std::array<std::uint16_t, 4>{0, 4, 5, 6})
    CHECK(results[result] > 100);
}
