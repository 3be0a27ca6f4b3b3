// SPDX-License-Identifier: MIT
// A program for the PLC, the bus and the clock of one coprocessor. Whatever they do, it keeps its contract
// (core_plc.hpp, core_wire.hpp), and afterwards the next transaction works (core_rig.hpp).
//
// The input is a list of steps: one byte selects the step, the next ones are its arguments; missing ones are 0.

#include "fuzz/core_rig.hpp"

namespace cbcan::fuzz {

namespace {

/// Objects that the coprocessor handles; it does not have the last one.
constexpr std::array<std::uint16_t, 16> kObjects{0x1000, 0x1005, 0x1006, 0x1008, 0x1016, 0x1017,
                                                 0x1018, 0x1200, 0x3001, 0x3002, 0x3003, 0x3004,
                                                 0x3007, 0x300C, 0x1F82, 0x2000};
constexpr Time kLongestStep = 1U << 26;  // a little more than the longest SDO timeout

struct Program : private Input {
  explicit Program(std::span<const std::uint8_t> input) : Input(input) {}

  void run() {
    while (!empty())
      step();
    rig_.finish();
  }

 private:
  using Step = void (Program::*)();
  static const Step kSteps[14];

  /// The last steps were added later, so that the meaning of the corpus did not change.
  void step() {
    constexpr std::uint8_t kFirstLater = 0xE0, kScanner = 0xFC;
    const std::uint8_t choice = byte();
    if (choice >= kScanner) return step_of_scanner(choice % 4);
    if (choice < kFirstLater) return (this->*kSteps[choice % std::size(kSteps)])();
    (choice & 1) != 0 ? write_outputs() : make_pdo();
  }

  void request() {
    const std::uint8_t kind = byte();
    Plc& plc = rig_.plc;
    plc.reg(3701) = (kind & 1) != 0 ? 5066 : 5055;
    plc.reg(3702) = byte();
    plc.reg(3703) = kObjects[kind >> 4];
    plc.reg(3704) = byte();
    plc.reg(3705) = byte();
    if ((kind & 2) != 0) plc.reg(3706) = word();
    if ((kind & 4) != 0) plc.reg(3707) = word();
    plc.reg(3700) = 0xCA0E;
    rig_.poll();
  }

  void step_of_scanner(unsigned which) {
    std::array<std::uint16_t, regmap::kScannerOutWords>& out = rig_.scanner.out;
    if (which == 0) return request_by_scanner(byte());
    if (which == 1) return write_part_of_scanner(byte() % 70u, 1 + byte() % 70u);
    if (which == 2) out[0] = 0;
    rig_.write_scanner(0, out.size());
  }

  void request_by_scanner(std::uint8_t kind) {
    std::array<std::uint16_t, regmap::kScannerOutWords>& out = rig_.scanner.out;
    out[0] = (kind & 8) != 0 ? byte() : rig_.scanner.next();
    out[1] = (kind & 1) != 0 ? 5066 : 5055;
    out[2] = byte();
    out[3] = kObjects[kind >> 4];
    out[4] = byte();
    out[5] = byte();
    if ((kind & 2) != 0) out[6] = word();
    rig_.write_scanner(0, (kind & 4) != 0 ? 1 + byte() % 70u : out.size());
  }

  void write_part_of_scanner(std::size_t first, std::size_t count) {
    count = std::min(count, rig_.scanner.out.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      rig_.scanner.out[first + i] = i < 8 ? word() : std::uint16_t{0};
    rig_.write_scanner(first, count);
  }

  void write_data() {
    const unsigned at = 3706 + byte() % 64u;
    const unsigned count = std::min<unsigned>(byte(), 3770 - at);
    for (unsigned i = 0; i < count; ++i)
      rig_.plc.reg(at + i) = word();
    rig_.poll();
  }

  void write_register() {
    const unsigned at = 3700 + byte() % 70u;
    rig_.plc.reg(at) = word();
    rig_.poll();
  }

  void execute_again() {
    rig_.plc.reg(3700) = 0xCA0E;
    rig_.poll();
  }

  void cancel() {
    rig_.plc.reg(3700) = byte();
    rig_.poll();
  }

  void any_frame() {
    const std::uint16_t head = word();
    Frame frame;
    frame.id = head & 0x7FF;
    frame.flags = static_cast<std::uint8_t>(head >> 11 & 7);
    if ((frame.flags & Frame::kExtended) != 0) frame.id |= frame.id << 18;
    frame.length = byte() % 9;
    frame.data = bytes<8>();
    rig_.arrive(frame);
  }

  std::uint8_t server() const { return static_cast<std::uint8_t>(rig_.plc.request().node & 0x7F); }

  /// With the multiplexer of the transfer.
  void respond_with_object() {
    const auto given = bytes<5>();
    const Plc::Request& request = rig_.plc.request();
    rig_.respond(server(), std::array<std::uint8_t, 8>{given[0], static_cast<std::uint8_t>(request.index),
                                                       static_cast<std::uint8_t>(request.index >> 8),
                                                       static_cast<std::uint8_t>(request.sub), given[1],
                                                       given[2], given[3], given[4]});
  }

  void respond_segment() { rig_.respond(server(), bytes<8>()); }

  /// The response of a correct server to the last request, unless it is a block transfer.
  void respond_well() {
    const std::uint8_t size = byte();
    if (rig_.wire.requests.empty()) return;
    const Frame last = rig_.wire.requests.back();
    const auto node = static_cast<std::uint8_t>(last.id & 0x7F);
    const auto toggle = static_cast<std::uint8_t>(last.data[0] & 0x10);
    const std::uint8_t last_segment = size < 0x80 ? 1 : 0;
    switch (last.data[0] >> 5) {
      case 0:
        return rig_.respond(node, std::array<std::uint8_t, 1>{static_cast<std::uint8_t>(0x20 | toggle)});
      case 1:
        return rig_.respond(node,
                            std::array<std::uint8_t, 4>{0x60, last.data[1], last.data[2], last.data[3]});
      case 2:
        return rig_.respond(
            node, std::array<std::uint8_t, 5>{0x41, last.data[1], last.data[2], last.data[3], size});
      case 3:
        return rig_.respond(node,
                            std::array<std::uint8_t, 3>{
                                static_cast<std::uint8_t>(toggle | (size & 7) << 1 | last_segment), size, 1});
      default: return;
    }
  }

  /// To the own node, from another node.
  void ask_own_node() {
    const std::uint8_t object = byte();
    const auto given = bytes<6>();
    const std::uint16_t index = kObjects[object & 0x0F];
    Frame frame;
    frame.id = 0x600u + Rig::kOwnNode;
    frame.length = 8;
    frame.data = {given[0],
                  static_cast<std::uint8_t>(index),
                  static_cast<std::uint8_t>(index >> 8),
                  given[1],
                  given[2],
                  given[3],
                  given[4],
                  given[5]};
    if ((object & 0x10) != 0) std::copy_n(given.begin() + 1, 5, frame.data.begin() + 1);
    rig_.arrive(frame);
  }

  void report_state() {
    Frame frame;
    frame.id = 0x700u + byte() % 128u;
    frame.length = 1;
    frame.data[0] = byte();
    rig_.arrive(frame);
  }

  void wait() {
    const std::uint8_t kind = byte();
    if (kind >= 0x80) return rig_.pass(std::min<Time>(Time{1} << (kind & 31), kLongestStep));
    for (unsigned i = 0; i <= kind % 8u; ++i)
      rig_.pass_to_deadline();
  }

  void refuse_frames() {
    rig_.wire.refuse = byte();
    rig_.poll();
  }

  /// By expedited SDO from another node.
  void write_own(unsigned index, std::uint8_t sub, std::uint8_t size, std::uint32_t value) {
    Frame frame;
    frame.id = 0x600u + Rig::kOwnNode;
    frame.length = 8;
    frame.data = {static_cast<std::uint8_t>(0x23 | (4 - size) << 2), static_cast<std::uint8_t>(index),
                  static_cast<std::uint8_t>(index >> 8), sub};
    for (unsigned i = 0; i < 4; ++i)
      frame.data[4 + i] = static_cast<std::uint8_t>(value >> 8 * i);
    rig_.arrive(frame);
  }

  /// Configures a PDO with one network variable of any type, and starts the own node.
  void make_pdo() {
    constexpr std::uint8_t kBits[] = {8, 8, 1, 16, 16, 24, 24, 32, 32, 32, 40, 40, 48, 48, 56, 56, 64, 64};
    const std::uint8_t which = byte(), type = byte(), variable = byte() % 18, element = byte();
    const std::uint16_t id = word();
    const bool transmit = (which & 1) != 0;
    const unsigned parameter = (transmit ? 0x1800u : 0x1400u) + (which >> 1 & 15);
    const unsigned object = (transmit ? 0xA480u : 0xA000u) + 0x40u * variable;
    write_own(parameter, 1, 4, 0x80000000u | (id & 0x7FFu));
    write_own(parameter + 0x200, 0, 1, 0);
    write_own(parameter + 0x200, 1, 4, object << 16 | std::uint32_t{element} << 8 | kBits[variable]);
    write_own(parameter + 0x200, 0, 1, 1);
    write_own(parameter, 2, 1, type);
    write_own(parameter, 5, 2, id >> 11);
    write_own(parameter, 1, 4, id & 0x7FFu);
    rig_.arrive({.id = 0, .length = 2, .data = {1, Rig::kOwnNode}});
  }

  void write_outputs() {
    const unsigned at = byte() % 128u;
    for (unsigned i = 0; i < 4; ++i)
      rig_.process[(at + i) % 128u] = word();
    rig_.write_registers();
  }

  void change_bus_state() { rig_.coprocessor.on_bus_state(static_cast<BusState>(byte() % 4), rig_.now()); }

  Rig rig_;
};

const Program::Step Program::kSteps[] = {
    &Program::request,
    &Program::write_data,
    &Program::write_register,
    &Program::execute_again,
    &Program::cancel,
    &Program::any_frame,
    &Program::respond_with_object,
    &Program::respond_segment,
    &Program::respond_well,
    &Program::ask_own_node,
    &Program::report_state,
    &Program::wait,
    &Program::refuse_frames,
    &Program::change_bus_state,
};

}  // namespace

void run(Input input) {
  Program(input.rest()).run();
}

}  // namespace cbcan::fuzz
