// SPDX-License-Identifier: MIT
// A module that exchanges 256 bytes of process data a thousand times a second, while the PLC reads and writes
// 128 bytes by SDO without a pause: each PDO of each cycle comes once, with the data of its cycle.

#include "sim/world.hpp"
#include "support/catch.hpp"
#include "support/sdo_peer.hpp"

using namespace cbcan;

namespace {

constexpr unsigned kPdos = 16;
constexpr std::uint32_t kCycles = 100'000;
constexpr Time kPeriod = 1000;
constexpr Time kTick = 100;  ///< the SDO server sends one frame in each

/// What PDO `number` carries in this cycle, as registers.
std::array<std::uint16_t, 4> data_of(unsigned number, std::uint32_t cycle) {
  return {static_cast<std::uint16_t>(cycle), static_cast<std::uint16_t>(cycle >> 16),
          static_cast<std::uint16_t>(0xC300 + number), static_cast<std::uint16_t>(~cycle)};
}

/// The module, its PLC, and the far side of the bus: the partner of its PDOs and an SDO server, node 5.
struct Plant final : private cbcan::sim::Receiver {
  Plant() {
    port_.accept(0, 0x7FF);
    world_.add_module(cbcan::RegisterWindow(window_), process_, {});
    world_.start(now_);
    for (unsigned k = 0; k < kPdos; ++k) {
      set_up(0x1400 + k, 0x201 + k, 0xA4400140 + 0x100 * k);
      set_up(0x1800 + k, 0x181 + k, 0xA8C00140 + 0x100 * k);
    }
    local_write(0x1F82, 127, 1, 1);  // Operational
    local_write(0x1006, 0, 4, kPeriod);
    local_write(0x1005, 0, 4, 0x40000080);
  }

  /// Up to and with the SYNC of the next cycle.
  void run_cycle() {
    ++cycle_;
    constexpr Time kHalf = kPeriod / 2;
    for (Time at = kTick; at <= kPeriod; at += kTick) {
      now_ += kTick;
      if (at == kHalf) exchange();
      world_.advance(now_);
      respond_sdo();
      go_on_with_sdo();
    }
    check_inputs();
    for (const std::uint32_t received : received_)
      missed += received != cycle_;
  }

  std::uint32_t missed = 0;      ///< TPDOs that have not come in their cycle
  std::uint32_t wrong_in = 0;    ///< input registers without the data of this cycle
  std::uint32_t wrong_out = 0;   ///< TPDOs of another cycle, or of this one once more
  std::uint32_t unexpected = 0;  ///< other frames
  std::uint32_t refused = 0;     ///< frames that the port of the far side did not take
  std::uint32_t wrong_sdo = 0;
  std::uint32_t transfers = 0;
  std::uint32_t syncs = 0;

 private:
  using Bytes = std::array<std::uint8_t, cbcan::test::SdoPeer::kCapacity>;

  std::uint16_t& reg(unsigned address) { return window_.at(address - 3700); }
  void execute(std::uint16_t command, std::uint16_t node, unsigned index, std::uint16_t sub,
               std::uint16_t size) {
    const std::uint16_t words[] = {0xCA0E, command, node, static_cast<std::uint16_t>(index), sub, size};
    std::copy(std::begin(words), std::end(words), window_.begin());
  }

  void local_write(unsigned index, std::uint16_t sub, std::uint16_t size, std::uint32_t value) {
    reg(3706) = static_cast<std::uint16_t>(value);
    reg(3707) = static_cast<std::uint16_t>(value >> 16);
    execute(5066, 0, index, sub, size);
    world_.advance(now_);
    REQUIRE(reg(3700) == 0);
  }
  /// A PDO of eight bytes at every SYNC.
  void set_up(unsigned index, std::uint32_t id, std::uint32_t mapped) {
    local_write(index + 0x200, 1, 4, mapped);
    local_write(index + 0x200, 0, 1, 1);
    local_write(index, 2, 1, 1);
    local_write(index, 1, 4, id);
  }

  // Process data.
  /// The partner sends, and the PLC writes, what belongs to this cycle.
  void exchange() {
    for (unsigned k = 0; k < kPdos; ++k) {
      const auto data = data_of(k, cycle_);
      std::copy(data.begin(), data.end(), process_.begin() + 64 + 4 * k);
      Frame frame;
      frame.id = 0x201 + k;
      frame.length = 8;
      for (std::size_t i = 0; i < 8; ++i)
        frame.data[i] = static_cast<std::uint8_t>(data[i / 2] >> 8 * (i % 2));
      send(frame);
    }
  }
  void check_inputs() {
    for (unsigned k = 0; k < kPdos; ++k) {
      const auto data = data_of(k, cycle_);
      wrong_in += !std::equal(data.begin(), data.end(), process_.begin() + 4 * k);
    }
  }
  void take_pdo(unsigned k, const Frame& frame) {
    const auto data = data_of(k, ++received_[k]);
    bool right = frame.length == 8 && frame.flags == 0 && received_[k] == cycle_;
    for (std::size_t i = 0; i < 8; ++i)
      right &= frame.data[i] == static_cast<std::uint8_t>(data[i / 2] >> 8 * (i % 2));
    wrong_out += !right;
  }

  // SDO, in turn: mode 2, write, read, mode 3, write, read.
  void respond_sdo() {
    if (const Frame* const response = server_.response()) send(*response);
  }
  void go_on_with_sdo() {
    if (reg(3700) == 0xCA0E) return;
    check_sdo();
    step_ = (step_ + 1) % 6;
    first_ = static_cast<std::uint8_t>(first_ + 41);
    server_.hold(first_);
    if (step_ % 3 == 0) {
      reg(3706) = step_ == 0 ? 2 : 3;
      return execute(5066, 0, 0x3004, 0, 1);
    }
    for (unsigned i = 0; i < 64; ++i)
      reg(3706 + i) = step_ % 3 == 1 ? word(i) : std::uint16_t{0};
    execute(step_ % 3 == 1 ? 5066 : 5055, 5, 0x2000, 0, 128);
  }
  void check_sdo() {
    wrong_sdo += reg(3700) != 0;
    if (step_ % 3 == 0) return;
    ++transfers;
    const auto written = server_.written();
    for (unsigned i = 0; i < 64; ++i) {
      if (step_ % 3 == 2)
        wrong_sdo += reg(3706 + i) != word(i);
      else
        wrong_sdo += written.size() != 128 || (written[2 * i] | written[2 * i + 1] << 8) != word(i);
    }
  }
  /// Data word `i` of this transfer: bytes first_, first_ + 1, ...
  std::uint16_t word(unsigned i) const {
    const auto low = static_cast<std::uint8_t>(first_ + 2 * i);
    const auto high = static_cast<std::uint8_t>(first_ + 2 * i + 1);
    return static_cast<std::uint16_t>(low | high << 8);
  }

  // The bus.
  void send(const Frame& frame) { refused += !port_.try_send(frame); }
  void on_frame(const Frame& frame, Time /*now*/) override {
    if (frame.id == 0x605) return server_.on_frame(frame);
    if (frame.id > 0x180 && frame.id <= 0x180 + kPdos) return take_pdo(frame.id - 0x181, frame);
    if (frame.id == 0x080)
      ++syncs;
    else
      unexpected += frame.id != 0x77F;  // the boot-up message
  }
  void on_bus_state(BusState /*state*/, Time /*now*/) override {}

  cbcan::sim::World world_;
  cbcan::sim::Port& port_ = world_.bus().attach(*this);
  std::array<std::uint16_t, 70> window_{};
  std::array<std::uint16_t, 128> process_{};
  cbcan::test::SdoPeer server_{128};
  std::array<std::uint32_t, kPdos> received_{};
  Time now_ = 0;
  std::uint32_t cycle_ = 0;
  unsigned step_ = 3;  ///< so that the first is 4 mod 6; the module is in mode 0 then
  std::uint8_t first_ = 0;
};

}  // namespace

TEST_CASE("sixteen PDOs each way at 1 kHz, for 100,000 cycles, beside SDO transfers without a pause") {
  Plant plant;
  for (std::uint32_t cycle = 0; cycle < kCycles; ++cycle)
    plant.run_cycle();
  CHECK(plant.syncs == kCycles);
  CHECK(plant.missed == 0);
  CHECK(plant.wrong_out == 0);
  CHECK(plant.wrong_in == 0);
  CHECK(plant.unexpected == 0);
  CHECK(plant.refused == 0);
  CHECK(plant.wrong_sdo == 0);
  CHECK(plant.transfers > 57'000);
}
