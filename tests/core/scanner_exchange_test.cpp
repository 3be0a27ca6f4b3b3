// SPDX-License-Identifier: MIT
// PLCs whose Modbus masters exchange whole blocks with R3700, in each of the four orders that there are: but
// in one each request is not one transfer, or not each result the node's own. docs/scanner.md has the table.

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
