// SPDX-License-Identifier: MIT
#include "boards/common/station.hpp"

#include "cbcan/modbus/identification.hpp"
#include "io/bytes.hpp"
#include "support/bench.hpp"

using namespace cbcan;
using namespace cbcan::boards;

namespace {

using io::test::Bytes;
using io::test::hex;

/// A board played by the test.
struct FakeBoard final : Hardware {
  Time now() override { return time; }
  bool receive(std::size_t network, Frame& frame) override {
    if (arrived[network].empty()) return false;
    frame = arrived[network].front();
    arrived[network].pop_front();
    return true;
  }
  BusState bus_state(std::size_t network) override { return state[network]; }
  void respond(std::span<const std::uint8_t> bytes) override { response.assign(bytes.begin(), bytes.end()); }
  Health health(std::size_t network) override { return report[network]; }

  Time time = 1000;
  std::array<std::deque<Frame>, 2> arrived;  ///< of each network
  std::array<BusState, 2> state{BusState::kActive, BusState::kActive};
  Bytes response;
  std::array<Health, 2> report;
};

template <std::size_t kNetworks>
struct BenchOf {
  using Board = Station<kNetworks>;
  explicit BenchOf(const typename Board::Ports& ports, const typename Board::Settings& settings)
      : station(board, ports, settings) {
    station.start();
  }

  /// Sends a request with its CRC, runs the turns that follow, and returns the response.
  Bytes ask(std::string_view request) {
    board.response.clear();
    send(request);
    station.turn();
    board.time += kSilence;
    station.turn();
    station.modbus().on_sent();
    return board.response;
  }
  /// Receives all bytes at once, after a gap.
  void send(std::string_view bytes) {
    board.time += kSilence + 1;
    for (const std::uint8_t byte : hex(bytes))
      station.modbus().on_byte(byte, static_cast<std::uint32_t>(board.time));
  }
  std::uint16_t& reg(std::size_t address, std::size_t network = 0) {
    return RegisterMap(station.registers(network).map)[address];
  }
  std::uint32_t pair(std::size_t address, std::size_t network = 0) {
    return reg(address, network) | static_cast<std::uint32_t>(reg(address + 1, network)) << 16;
  }
  /// A pair of registers, by the address of the low word.
  void pairs(std::initializer_list<std::pair<std::size_t, std::uint32_t>> expected) {
    for (const auto& [address, value] : expected) {
      INFO("R" << address);
      CHECK(pair(address) == value);
    }
  }
  /// Prepares a read of four bytes of 2000h:00 of node 5, without CA0Eh.
  void prepare(std::size_t network = 0) {
    reg(3701, network) = 5055;
    reg(3702, network) = 5;
    reg(3703, network) = 0x2000;
    reg(3705, network) = 4;
  }

  static constexpr Time kSilence = 1750;
  static constexpr Time kAsking = 2 * kSilence + 1;  ///< duration of ask()
  FakeBoard board;
  Board station;
};

struct Ports {
  test::RecordingPort port;
  test::RecordingPort second_port;
};

struct Bench : Ports, BenchOf<1> {
  explicit Bench(const Station<1>::Settings& settings = {}) : BenchOf({&port}, settings) {}
};

/// Stations 1 and 2, own node IDs 127 and 126.
struct TwoNetworks : Ports, BenchOf<2> {
  TwoNetworks()
      : BenchOf({&port, &second_port},
                {.modbus = {}, .coprocessors = {{{.node_id = 127}, {.node_id = 126}}}}) {
    CHECK(port.sent == std::deque<std::string>{"77F#00"});
    CHECK(second_port.sent == std::deque<std::string>{"77E#00"});
    port.sent.clear();
    second_port.sent.clear();
  }
};

// CRCs by the algorithm of MODBUS over Serial Line V1.02, 6.2.2, calculated independently of this project.
constexpr std::string_view kExecute = "01 06 0E 74 CA 0E 1C 5C";

}  // namespace

TEST_CASE("A transaction by Modbus RTU: request, frames, response, result") {
  Bench bench;
  CHECK(bench.port.sent == std::deque<std::string>{"77F#00"});
  bench.port.sent.clear();
  CHECK(bench.ask("01 10 0E 75 00 05 0A 13 BF 00 05 20 00 00 00 00 04 2D 47") ==
        hex("01 10 0E 75 00 05 13 38"));
  CHECK(bench.ask("01 06 0E 74 CA 0E 1C 5C") == hex(kExecute));
  CHECK(bench.port.sent == std::deque<std::string>{"605#4000200000000000"});
  CHECK(bench.ask("01 03 0E 74 00 01 C6 F8") == hex("01 03 02 CA 0E 6F 20"));
  bench.board.arrived[0].push_back(test::frame_from("585#4300200078563412"));
  CHECK(bench.ask("01 03 0E 74 00 08 06 FE") ==
        hex("01 03 10 00 00 13 BF 00 05 20 00 00 00 00 04 56 78 12 34 21 34"));
}

TEST_CASE("A cancel and a new CA0Eh right after it are two requests: one a turn, a poll after each") {
  Bench bench;
  bench.prepare();
  bench.port.sent.clear();
  bench.ask("01 06 0E 74 CA 0E 1C 5C");
  bench.ask("01 06 0E 74 00 00 CB 38");
  bench.ask("01 06 0E 74 CA 0E 1C 5C");
  CHECK(bench.port.sent == std::deque<std::string>{"605#4000200000000000", "605#8000200000000008"});
  CHECK(bench.station.coprocessor().counters().cancelled == 1);
  CHECK(bench.station.coprocessor().counters().executed == 2);
}

TEST_CASE("A request is executed after its silence, and a turn says when that is over") {
  Bench bench;
  bench.prepare();
  bench.port.sent.clear();
  bench.send(kExecute);
  const Time end = bench.board.time + Bench::kSilence;
  SECTION("in which no byte comes") {
    CHECK(bench.station.turn() == end);
    bench.board.time = end - 1;
    CHECK(bench.station.turn() == end);
    CHECK(bench.board.response.empty());
    CHECK(bench.port.sent.empty());
    bench.board.time = end;
    CHECK(bench.station.turn() == end + 1'000'000);  // the SDO timeout
    CHECK(bench.board.response == hex(kExecute));
    CHECK(bench.port.sent.size() == 1);
  }
  SECTION("in which a byte comes") {
    bench.station.modbus().on_byte(0, static_cast<std::uint32_t>(end - 1));
    CHECK(bench.station.turn() == kNever);
    bench.board.time = end;
    CHECK(bench.station.turn() == kNever);
    CHECK(bench.board.response.empty());
    CHECK(bench.port.sent.empty());
  }
}

TEST_CASE("The diagnostics registers are up to date when read") {
  Bench bench;
  bench.board.report[0] = {regmap::ResetCause::kWatchdog, regmap::ClockSource::kInternal, 2048, 400, 7,
                           {0x10001, 2, 3, 4, 5}};
  bench.board.state[0] = BusState::kErrorPassive;
  bench.board.time = 4'294'967'296'999 - Bench::kAsking;  // 2^32 ms and 999 us
  bench.ask("01 03 10 04 00 21 C0 D3");
  CHECK(bench.reg(4100) == 0x0001);  // version 0.1.0
  CHECK(bench.reg(4101) == 0);
  CHECK(bench.pair(4102) == 0);  // 2^32 ms, modulo 2^32
  CHECK(bench.reg(4104) == 4);
  CHECK(bench.reg(4105) == 2048);
  CHECK(bench.reg(4106) == 400);
  CHECK(bench.reg(4107) == 0x11);
  bench.pairs({{4108, 0}, {4110, 0}, {4112, 0}, {4114, 7}, {4116, 0x10001}, {4118, 2}, {4120, 3}, {4122, 4}});
  bench.pairs({{4124, 5}, {4126, 0}});
  CHECK(bench.reg(4132) == 2);
  bench.board.report[0].stack_used = 500;
  bench.ask("01 03 0E 74 00 01 C6 F8");  // R3700: not the diagnostics
  CHECK(bench.reg(4106) == 400);
  bench.board.time += 1'234'567'001 - 2 * Bench::kAsking;
  bench.reg(3700) = 0xCA0E;  // with command 0
  bench.station.turn();
  bench.ask("01 03 10 04 00 21 C0 D3");
  CHECK(bench.pair(4102) == 1'234'568);
  CHECK(bench.reg(4106) == 500);
  bench.pairs({{4108, 2}, {4126, 1}, {4128, 1}, {4130, 0}});
}

TEST_CASE("Registers that are none are exception 02, a read of more than 125 is 03; other stations and all") {
  Bench bench;
  for (const char* read : {"01 03 00 00 00 01 84 0A", "01 03 0E 73 00 01 77 39", "01 03 0E 73 00 02 37 38",
                           "01 03 0E B9 00 02 17 06", "01 03 10 30 00 01 80 C5", "01 03 10 2B 00 02 B0 C3",
                           "01 03 10 2C 00 01 41 03", "01 03 10 36 00 01 60 C4"})
    CHECK(bench.ask(read) == hex("01 83 02 C0 F1"));
  CHECK(bench.ask("01 03 00 00 00 7E C5 EA") == hex("01 83 03 01 31"));
  CHECK(bench.ask("01 06 10 04 00 01 0D 0B") == hex("01 86 02 C3 A1"));  // R4100 can only be read
  CHECK(bench.ask("02 06 0F 3C 00 07 0B 23").empty());
  CHECK(bench.ask("00 06 0F 3D 00 08 1B 05").empty());
  CHECK(bench.ask("01 03 0F 3C 00 02 07 13") == hex("01 03 04 00 00 00 08 FB F5"));
  CHECK(bench.ask("01 04 0F 3C 00 02 B2 D3") == hex("01 04 04 00 00 00 08 FA 42"));
  bench.ask("01 03 10 04 00 21 C0 D3");
  bench.pairs({{4112, 10}});
}

TEST_CASE("A board's own settings are registers where it has some") {
  std::array<std::uint16_t, regmap::kBoardWords> words{1, 1152, 0, 0, 500, 127};
  Bench bench({.modbus = {}, .coprocessors = {}, .board = words});
  CHECK(bench.ask("01 06 10 3B 00 2A 7D 18").size() == 8);  // R4155 = 42
  CHECK(words[5] == 42);
  const auto missing = hex("01 83 02 C0 F1");
  CHECK(bench.ask("01 03 10 36 00 07 E0 C6") == missing);  // R4150..R4156
  CHECK(bench.ask("01 03 10 36 00 06 21 06").size() == 5 + 2 * 6);
}

constexpr modbus::Identification kIdentification({"cb", "f4", "0.1.0"});

TEST_CASE("FC 43/14: who the board is, where it says so") {
  Bench nobody;
  CHECK(nobody.ask("01 2B 0E 01 00 70 77") == hex("01 AB 01 9E F0"));
  Ports ports;
  BenchOf<1> bench({&ports.port}, {.modbus = {.more = &kIdentification}, .coprocessors = {}});
  ports.port.sent.clear();
  CHECK(bench.ask("01 2B 0E 01 00 70 77") ==
        hex("01 2B 0E 01 81 00 00 03  00 02 63 62  01 02 66 34  02 05 30 2E 31 2E 30  25 B5"));
  CHECK(bench.ask("01 2B 0E 04 03 33 26") == hex("01 AB 02 DE F1"));
  CHECK(bench.ask("00 2B 0E 01 00 4D B7").empty());  // to all
  CHECK(bench.ask("01 03 0E 74 00 01 C6 F8").size() == 7);
}

TEST_CASE("The ranges begin where the settings say") {
  test::RecordingPort port;
  Station<1>::Settings settings;
  settings.coprocessors[0].scanner_out_first = 3770;
  settings.coprocessors[0].scanner_in_first = 10;
  settings.coprocessors[0].process_first = 1000;
  BenchOf<1> bench({&port}, settings);
  CHECK(bench.ask("01 10 0E BA 00 02 04 00 07 00 00 85 05").size() == 8);
  CHECK(bench.ask("01 03 00 0A 00 03 25 C9") == hex("01 03 06 00 07 00 05 00 07 C5 76"));
  CHECK(bench.ask("01 03 03 E8 00 7D 05 9B").size() == 5 + 2 * 125);
  CHECK(bench.ask("01 03 02 58 00 01 04 61") == hex("01 83 02 C0 F1"));
}

TEST_CASE("A valid request shows that the PLC is there; one that is refused does not") {
  test::RecordingPort port;
  Station<1>::Settings settings;
  settings.coprocessors[0].plc_timeout_ms = 1000;
  BenchOf<1> bench({&port}, settings);
  const auto state = [&] { return bench.station.coprocessor().own_node().state(); };
  const auto pass_half = [&] {
    bench.board.time += 500'000;
    bench.station.turn();
  };
  bench.board.arrived[0].push_back(test::frame_from("000#017F"));
  bench.station.turn();
  for (int i = 0; i < 4; ++i) {
    pass_half();
    bench.ask("01 03 0E 74 00 01 C6 F8");
    CHECK(state() == nmt::State::kOperational);
  }
  for (int i = 0; i < 2; ++i) {
    pass_half();
    bench.ask("01 03 00 00 00 01 84 0A");
  }
  CHECK(state() == nmt::State::kPreOperational);
}

TEST_CASE("Two networks: responses reach the coprocessor of the network that they arrived on") {
  TwoNetworks bench;
  bench.prepare(0);
  bench.prepare(1);
  bench.ask("01 06 0E 74 CA 0E 1C 5C");
  bench.ask("02 06 0E 74 CA 0E 1C 6F");
  bench.board.arrived[1].push_back(test::frame_from("585#4300200078563412"));
  CHECK(bench.ask("02 03 0E 74 00 08 06 CD") ==
        hex("02 03 10 00 00 13 BF 00 05 20 00 00 00 00 04 56 78 12 34 65 70"));
  CHECK(bench.ask("01 03 0E 74 00 01 C6 F8") == hex("01 03 02 CA 0E 6F 20"));
  bench.board.arrived[0].push_back(test::frame_from("585#4300200001000000"));
  bench.station.turn();
  CHECK(bench.ask("01 03 0E 74 00 08 06 FE") ==
        hex("01 03 10 00 00 13 BF 00 05 20 00 00 00 00 04 00 01 00 00 EC 12"));
  CHECK(bench.reg(3706, 1) == 0x5678);
}

TEST_CASE("Two networks: a turn says when the next one is due on either") {
  TwoNetworks bench;
  CHECK(bench.station.turn() == kNever);
  bench.prepare(1);
  bench.ask("02 06 0E 74 CA 0E 1C 6F");
  const Time second_due = bench.board.time + 1'000'000;
  CHECK(bench.station.turn() == second_due);
  bench.board.time += 500'000;
  bench.prepare(0);
  bench.ask("01 06 0E 74 CA 0E 1C 5C");
  const Time first_due = bench.board.time + 1'000'000;
  CHECK(bench.station.turn() == second_due);
  bench.board.time = second_due;
  CHECK(bench.station.turn() == first_due);
  CHECK(bench.reg(3700, 1) == 4);
  CHECK(bench.reg(3700) == 0xCA0E);
}

TEST_CASE("Two networks: each shows diagnostics of its own CAN controller and transactions") {
  TwoNetworks bench;
  bench.board.report[0].can.received = 10;
  bench.board.report[1].can.received = 20;
  bench.board.state[1] = BusState::kBusOff;
  bench.reg(3700, 1) = 0xCA0E;  // with command 0
  bench.station.turn();
  bench.ask("02 03 10 04 00 21 C0 E0");
  CHECK(bench.reg(4107, 1) == 0x10);
  CHECK(bench.pair(4116, 1) == 20);
  CHECK(bench.pair(4126, 1) == 1);
  CHECK(bench.pair(4116) == 0);  // no request has read them
  bench.ask("01 03 10 04 00 21 C0 D3");
  CHECK(bench.reg(4107) == 0);
  CHECK(bench.pair(4116) == 10);
  CHECK(bench.pair(4126) == 0);
}

TEST_CASE("Two networks: a scanner window each, and a broadcast is for both") {
  TwoNetworks bench;
  bench.ask("02 06 01 F4 00 07 88 35");
  CHECK(bench.reg(602, 0) == 0);
  CHECK(bench.reg(602, 1) == 7);
  CHECK(bench.ask("00 06 01 F4 00 08 C9 D3").empty());
  CHECK(bench.reg(602, 0) == 8);
  CHECK(bench.reg(602, 1) == 8);
}
