// SPDX-License-Identifier: MIT
// PLCs whose Modbus masters exchange whole blocks, in each of the four orders that there are: through the
// scanner window each request is one transfer, and each result the node's own. Through R3700 they are not.
// Issue 14's table; docs/scanner.md has it.

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
constexpr Time kPeriods[] = {20 * kMillisecond, 50 * kMillisecond, 100 * kMillisecond};
constexpr Time kDelays[] = {0, 120 * kMillisecond, 250 * kMillisecond};

template <std::size_t Out, std::size_t In>
struct Images {
  std::array<std::uint16_t, Out>& out;
  std::array<std::uint16_t, In>& in;
  std::size_t out_first;
  std::size_t in_first;
};

/// A Modbus master, with the PLC's scan behind each request, or behind each exchange.
template <std::size_t Out, std::size_t In>
struct Master {
  Master(ScannedModule& module, Images<Out, In> images, std::function<void()> scan)
      : module_(module), images_(images), scan_(std::move(scan)) {}

  void exchange(Order order) {
    switch (order) {
      case Order::kReadThenWrite:
        read();
        write();
        break;
      case Order::kWriteThenRead:
        write();
        read();
        break;
      case Order::kAtOnce:
        module_.store(images_.out_first, images_.out);
        module_.read(images_.in_first, images_.in);
        module_.written(images_.out_first, Out);
        if (scans_between) scan_();
        break;
      case Order::kOnChange:
        if (images_.out != last_) write();
        read();
        break;
    }
    if (!scans_between) scan_();
  }

  std::size_t piece = Out;  ///< words of one request of it, at most
  bool scans_between = true;

 private:
  /// What a scan changes between pieces goes out with the next one.
  void write() {
    last_ = images_.out;
    for (std::size_t first = 0; first < Out; first += piece) {
      const std::size_t count = std::min(piece, Out - first);
      module_.write(images_.out_first + first, std::span(images_.out).subspan(first, count));
      if (scans_between) scan_();
    }
  }
  void read() {
    module_.read(images_.in_first, images_.in);
    if (scans_between) scan_();
  }

  ScannedModule& module_;
  Images<Out, In> images_;
  std::function<void()> scan_;
  std::array<std::uint16_t, Out> last_{};
};

/// A PLC at the scanner window, until it has had so many results.
struct Run {
  Run(Order order, Time period, Time delay, std::size_t piece, unsigned requests) {
    module.node_delay = delay;
    Master<ScannerPlc::kOut, ScannerPlc::kIn> master(
        module, {plc.out, plc.in, regmap::kScannerOutFirst, regmap::kScannerInFirst}, [this] { plc.scan(); });
    master.piece = piece;
    constexpr unsigned kMostExchanges = 40;  // of one request
    for (unsigned i = 0; i < kMostExchanges * requests && plc.ended < requests; ++i) {
      master.exchange(order);
      module.run(period);
    }
    plc.check(module.node);
  }

  ScannedModule module{1000};
  ScannerPlc plc{1000};
};

template <class Check>
void each_exchange(Check check) {
  for (const Exchange& exchange : kExchanges) {
    for (const Time period : kPeriods) {
      for (const Time delay : kDelays) {
        INFO(exchange.name << ", every " << period / kMillisecond << " ms, node of " << delay / kMillisecond
                           << " ms");
        check(exchange.order, period, delay);
      }
    }
  }
}

/// The first number after the module's start is answered by 5, and not executed.
void check_whole(unsigned requests) {
  each_exchange([&](Order order, Time period, Time delay) {
    const Run run(order, period, delay, ScannerPlc::kOut, requests + 1);
    CHECK(run.plc.results == std::map<std::uint16_t, unsigned>{{0, requests}, {5, 1}});
    CHECK(run.plc.done.size() == requests);
    CHECK(run.module.node.transfers - requests <= 1);  // the next request may have gone out
  });
}

/// Five words at most: those of no request come in one piece.
void check_in_pieces(unsigned requests) {
  each_exchange([&](Order order, Time period, Time delay) {
    if (order == Order::kAtOnce) return;  // has no pieces
    for (const std::size_t piece : {1u, 5u}) {
      const Run run(order, period, delay, piece, requests + 1);
      CHECK(run.plc.results == std::map<std::uint16_t, unsigned>{{5, 1}, {6, requests}});
      CHECK(run.module.node.transfers == 0);
    }
  });
}

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

/// So many transfers in 20 requests that the program takes for done.
unsigned flag_transfers(const Exchange& exchange, Time delay, unsigned& right) {
  constexpr unsigned kRequests = 20;
  constexpr int kMostExchanges = 2000;
  ScannedModule module{1000};
  module.node_delay = delay;
  FlagPlc plc;
  Master<8, 8> master(module, {plc.out, plc.in, regmap::kWindowFirst, regmap::kWindowFirst},
                      [&] { plc.scan(); });
  master.scans_between = false;
  for (int i = 0; i < kMostExchanges && plc.done < kRequests; ++i) {
    master.exchange(exchange.order);
    module.run(50 * kMillisecond);
  }
  right = plc.right;
  std::cout << "R3700, " << exchange.name << ", node of " << delay / kMillisecond << " ms: " << plc.done
            << " done, " << plc.right << " of them right, " << module.node.transfers << " transfers\n";
  return module.node.transfers;
}

}  // namespace

TEST_CASE("Scanner window: whole blocks in each order: one transfer each, each result the node's own") {
  check_whole(1000);
}

TEST_CASE("Scanner window: blocks in pieces are refused in each order") {
  check_in_pieces(1000);
}

TEST_CASE("Scanner window, 100,000 requests each", "[.long]") {
  check_whole(100'000);
  check_in_pieces(100'000);
}

TEST_CASE(
    "R3700 promises nothing to whoever scans it: only writing on change does what the program believes") {
  for (const Exchange& exchange : kExchanges) {
    for (const Time delay : kDelays) {
      INFO(exchange.name << ", node of " << delay / kMillisecond << " ms");
      unsigned right = 0;
      const bool as_believed = flag_transfers(exchange, delay, right) == 20 && right == 20;
      CHECK(as_believed == (exchange.order == Order::kOnChange));
    }
  }
}
