// SPDX-License-Identifier: MIT
// PLCs whose Modbus masters exchange whole blocks with R3700, in each of the four orders that there are: but
// in one each request is not one transfer, or not each result the node's own. docs/how-to/scanner.md has the table.

#include "core/scanner_rig.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

enum class Order { kReadThenWrite, kWriteThenRead, kAtOnce, kOnChange };
struct Exchange {
  const char* name;
  Order order;
};
constexpr Exchange kExchanges[] = {
    {"read, then write (OpenPLC's remote device)", Order::kReadThenWrite},
    {"write, then read", Order::kWriteThenRead},
    {"cyclic FC 23 (an access type of CODESYS)", Order::kAtOnce},
    {"write only on change", Order::kOnChange},
};
constexpr Time kDelays[] = {0, 120 * kMillisecond, 250 * kMillisecond};

/// A careful PLC program at R3700: CA0Eh until R3700 is read to be something else two exchanges later, then 0
/// for two exchanges.
struct FlagPlc {
  void scan() {
    if (++scans_ < 2) return;
    if (out[0] == regmap::kExecute && in[0] != regmap::kExecute) {
      ++done;
      if (in[0] == 0 && in[5] == 4 && (in[6] | std::uint32_t{in[7]} << 16) == scanned_value(0x2000, sub_))
        ++right;
      out[0] = 0;
      scans_ = 0;
    } else if (out[0] != regmap::kExecute) {
      ++sub_;
      out = {regmap::kExecute, 5055, kScannedNode, 0x2000, sub_, 4, 0, 0};
      scans_ = 0;
    }
  }

  std::array<std::uint16_t, 8> out{};
  std::array<std::uint16_t, 8> in{};
  unsigned done = 0;
  unsigned right = 0;

 private:
  std::uint8_t sub_ = 0;
  int scans_ = 0;
};

/// One exchange of its images with the module's first eight registers from R3700 on.
void exchange(Order order, FlagPlc& plc, ScannedModule& module, std::array<std::uint16_t, 8>& last) {
  const auto read = [&] { module.read(regmap::kWindowFirst, plc.in); };
  const auto write = [&] { module.write(regmap::kWindowFirst, last = plc.out); };
  switch (order) {
    case Order::kReadThenWrite: read(); return write();
    case Order::kWriteThenRead: write(); return read();
    case Order::kAtOnce:
      module.store(regmap::kWindowFirst, plc.out);
      read();
      return module.written(regmap::kWindowFirst, plc.out.size());
    case Order::kOnChange:
      if (plc.out != last) write();
      return read();
  }
}

/// So many transfers in 20 requests that the program takes for done.
unsigned flag_transfers(const Exchange& way, Time delay, unsigned& right) {
  constexpr unsigned kRequests = 20;
  constexpr int kMostExchanges = 2000;
  ScannedModule module{1000};
  module.node_delay = delay;
  FlagPlc plc;
  std::array<std::uint16_t, 8> last{};
  for (int i = 0; i < kMostExchanges && plc.done < kRequests; ++i) {
    exchange(way.order, plc, module, last);
    plc.scan();
    module.run(50 * kMillisecond);
  }
  right = plc.right;
  std::cout << "R3700, " << way.name << ", node of " << delay / kMillisecond << " ms: " << plc.done
            << " done, " << plc.right << " of them right, " << module.node.transfers << " transfers\n";
  return module.node.transfers;
}

}  // namespace

TEST_CASE("R3700 promises nothing to whoever scans it: only writing on change does as the program believes") {
  for (const Exchange& exchange : kExchanges) {
    for (const Time delay : kDelays) {
      INFO(exchange.name << ", node of " << delay / kMillisecond << " ms");
      unsigned right = 0;
      const bool as_believed = flag_transfers(exchange, delay, right) == 20 && right == 20;
      CHECK(as_believed == (exchange.order == Order::kOnChange));
    }
  }
}

// ---- Properties

// A PLC that keeps to the handshake of the scanner window, between exchanges, restarts and losses that
// come at random: no old result is believed, nothing is executed twice, nothing is torn.

namespace {

/// What happens to a PLC and a module, one thing at a time.
struct Interleaving {
  explicit Interleaving(std::uint32_t seed) : random_(seed) {}

  void step() {
    const unsigned dice = pick(1000);
    if (dice < 300) {
      plc.scan();
    } else if (dice < 480) {
      module.write(regmap::kScannerOutFirst, plc.out);
    } else if (dice < 660) {
      module.read(regmap::kScannerInFirst, plc.in);
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
      module.write(regmap::kScannerOutFirst, std::array<std::uint16_t, ScannerPlc::kOut>{});
    } else if (dice < 996) {
      plc.in.fill(0);
    } else {
      in_pieces();
    }
  }

  ScannedModule module{50};
  ScannerPlc plc{40};

 private:
  unsigned pick(unsigned below) { return static_cast<unsigned>(random_() % below); }

  /// What a master that splits blocks does, the number first or the rest.
  void in_pieces() {
    const std::span words(plc.out);
    const std::size_t cut = 1 + pick(ScannerPlc::kOut - 1);
    const bool number_first = pick(2) == 0;
    const auto write = [&](bool number) {
      number ? module.write(regmap::kScannerOutFirst, words.first(cut))
             : module.write(regmap::kScannerOutFirst + cut, words.subspan(cut));
    };
    write(number_first);
    plc.scan();
    write(!number_first);
  }
  /// Somebody else uses R3700 meanwhile, for an object that the PLC leaves alone.
  void other_window() {
    if (pick(4) != 0 || module.registers[regmap::kExecuteFlag] == regmap::kExecute) return;
    const auto id = static_cast<std::uint16_t>(++other_);
    module.write(regmap::kWindowFirst, std::array<std::uint16_t, 8>{regmap::kExecute, 5066, kScannedNode,
                                                                    0x3000, 0, 4, id, 0x00FF});
  }

  std::mt19937 random_;
  unsigned other_ = 0;
};

void check_interleavings(std::uint32_t seeds) {
  std::map<std::uint16_t, unsigned> results;
  std::size_t done = 0;
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
    INFO("seed " << seed);
    Interleaving interleaving(seed);
    for (int i = 0; i < 2000; ++i)
      interleaving.step();
    interleaving.plc.check(interleaving.module.node);
    done += interleaving.plc.done.size();
    for (const auto& [result, times] : interleaving.plc.results)
      results[result] += times;
  }
  CHECK(done > 10'000);
  for (const std::uint16_t result : std::array<std::uint16_t, 4>{0, 4, 5, 6})
    CHECK(results[result] > 100);
}

}  // namespace

TEST_CASE("The scanner window: nothing is believed, executed twice or torn that should not be") {
  check_interleavings(300);
}

TEST_CASE("The scanner window, for long", "[.long]") {
  check_interleavings(30'000);
}
