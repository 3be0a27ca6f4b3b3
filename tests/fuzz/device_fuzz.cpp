// SPDX-License-Identifier: MIT
// A program for the master, the world outside and the clock around simulated devices: an I/O module, a drive,
// and a node without behaviour and without a node ID. Whatever they do, the nodes keep their promises
// (device_plant.hpp), and the same program gives the same frames however coarse the steps of time are.
//
// The input is a byte of plant settings and a list of steps: one byte selects the step, the next ones are its
// arguments.
#include <bit>

#include "fuzz/device_plant.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

// Bits of the first byte.
constexpr std::uint8_t kPaced = 1;
constexpr std::uint8_t kSignals = 2;
constexpr std::uint8_t kNoStore = 4;
constexpr std::uint8_t kFaults = 8;

constexpr auto kObjects = std::to_array<std::uint16_t>({
    0x1003, 0x1005, 0x1006, 0x1007, 0x100C, 0x100D, 0x1010, 0x1011, 0x1012, 0x1014, 0x1015, 0x1016,
    0x1017, 0x1019, 0x1029, 0x1400, 0x1401, 0x1600, 0x1601, 0x1800, 0x1801, 0x1802, 0x1A00, 0x1A01,
    0x6040, 0x6060, 0x607A, 0x60FF, 0x6071, 0x605A, 0x605C, 0x605E, 0x6007, 0x6065, 0x6066, 0x6067,
    0x6081, 0x6083, 0x6085, 0x607B, 0x607D, 0x607F, 0x608F, 0x6091, 0x6092, 0x6098, 0x6099, 0x609A,
    0x60C2, 0x6200, 0x6206, 0x6207, 0x6005, 0x6006, 0x6411, 0x6421, 0x6423, 0x6424, 0x6426, 0x6443,
    0x1000, 0x1001, 0x1008, 0x1018, 0x6041, 0x6064, 0x6401, 0x6000, 0x2005, 0x2100, 0x2200, 0x5FFF,
});
constexpr auto kMapped = std::to_array<std::uint32_t>(
    {0x60410010, 0x60640020, 0x606C0020, 0x60770010, 0x60610008, 0x60400010, 0x60600008, 0x607A0020,
     0x60FF0020, 0x60710010, 0x60000108, 0x64010110, 0x64010210, 0x62000108, 0x64110110, 0x10010008});
constexpr auto kInputs =
    std::to_array<std::uint16_t>({0x6000, 0x6401, 0x6041, 0x6040, 0x607A, 0x2003, 0x1014, 0x1800});
constexpr auto kCommands = std::to_array<std::uint8_t>({1, 2, 0x80, 0x81, 0x82, 1, 1, 0});
constexpr auto kLssCommands = std::to_array<std::uint8_t>(
    {4, 0x40, 0x41, 0x42, 0x43, 0x11, 0x13, 0x15, 0x17, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E, 0x51, 0x4C});
constexpr auto kIdentifiers =
    std::to_array<std::uint32_t>({0x000, 0x080, 0x100, 0x182, 0x185, 0x202, 0x205, 0x302, 0x305, 0x582, 0x602,
                                  0x605, 0x702, 0x705, 0x7E4, 0x7E5});
constexpr auto kNumbers =
    std::to_array<double>({0, 1, -1, 0.5, 255, 256, -32769, 1e300, -1e300, 4294967296.0});

struct Program {
  Program(std::span<const std::uint8_t> input, const PlantOptions& options, std::vector<Time>& ends)
      : input_(input), plant_(options), fine_(options.by_deadlines), ends_(ends) {}

  void run() {
    may_fault_ = (input_.byte() & kFaults) != 0;
    while (!input_.empty()) {
      (this->*kSteps[input_.byte() % std::size(kSteps)])();
      plant_.settle();
    }
    pass(kSecond);
  }
  const std::vector<DevicePlant::Seen>& seen() const { return plant_.seen(); }

 private:
  using Step = void (Program::*)();
  static const Step kSteps[23];

  std::size_t place() { return input_.byte() % DevicePlant::kNodes; }

  // ---- Frames

  void receive(std::uint32_t id, std::span<const std::uint8_t> data, std::uint8_t flags = 0) {
    Frame frame{.id = id, .length = static_cast<std::uint8_t>(data.size()), .flags = flags};
    std::ranges::copy(data, frame.data.begin());
    plant_.receive(frame);
  }

  void command() {
    const std::uint8_t which = input_.one_of(kCommands);
    const std::uint8_t whom = input_.byte();
    receive(0, std::array{which, whom < 0x80 ? std::uint8_t{0} : plant_.id(whom % DevicePlant::kNodes)});
  }

  void ask(std::size_t whom, const std::array<std::uint8_t, 8>& request) {
    receive(sdo::kRequestId + plant_.id(whom), request);
  }

  /// With the length of the object, if it has one.
  void write(std::size_t whom, std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    ObjectEntry entry{};
    std::size_t size = 4;
    if (plant_.node(whom).device().dictionary().find(index, sub, entry) == AbortCode::kNone)
      size = std::clamp<std::size_t>(entry.capacity, 1, 4);
    std::array<std::uint8_t, 8> request{static_cast<std::uint8_t>(0x23 | (4 - size) << 2)};
    store_little_endian(std::span(request).subspan<1, 2>(), index);
    request[3] = sub;
    store_little_endian(std::span(request).subspan(4, size), value);
    ask(whom, request);
  }

  void write_object() {
    const std::size_t whom = place();
    const std::uint16_t index = input_.one_of(kObjects);
    const std::uint8_t sub = input_.byte() % 10;
    write(whom, index, sub, input_.number());
  }

  void write_small_number() {
    const std::size_t whom = place();
    const std::uint16_t index = input_.one_of(kObjects);
    const std::uint8_t sub = input_.byte() % 4;
    write(whom, index, sub, input_.byte());
  }

  void read_object() {
    const std::size_t whom = place();
    const std::uint16_t index = input_.one_of(kObjects);
    ask(whom, {0x40, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8),
               static_cast<std::uint8_t>(input_.byte() % 10)});
  }

  void ask_anything() {
    const std::size_t whom = place();
    ask(whom, input_.bytes<8>());
  }

  void store_or_restore() {
    const std::size_t whom = place();
    const bool store = input_.byte() % 2 == 0;
    write(whom, store ? 0x1010 : 0x1011, 1 + input_.byte() % 3, store ? 0x65766173 : 0x64616F6C);
  }

  /// With the procedure of CiA 301, 7.5.2.36.
  void configure_pdo() {
    const std::size_t whom = place();
    const std::uint8_t which = input_.byte();
    const auto number = static_cast<std::uint16_t>(which & 3);
    const auto base = static_cast<std::uint16_t>(((which & 4) != 0 ? 0x1800 : 0x1400) + number);
    const auto mapping = static_cast<std::uint16_t>(base + 0x200);
    const std::uint32_t identifier =
        input_.byte() < 0x80 ? 0x180u + input_.byte() * 8u : kIdentifiers[which % 16];
    const auto count = static_cast<std::uint8_t>(1 + input_.byte() % 3);
    write(whom, base, 1, 0x80000000 | identifier);
    write(whom, mapping, 0, 0);
    for (std::uint8_t sub = 1; sub <= count; ++sub)
      write(whom, mapping, sub, input_.one_of(kMapped));
    write(whom, mapping, 0, count);
    write(whom, base, 2, input_.byte());
    write(whom, base, 3, input_.byte());
    write(whom, base, 5, input_.byte());
    write(whom, base, 1, identifier);
  }

  void enable_drive() {
    write(DevicePlant::kDrive, 0x6060, 0, input_.byte() % 11);
    for (const std::uint32_t word : {0x6u, 0x7u, 0xFu})
      write(DevicePlant::kDrive, 0x6040, 0, word);
  }

  void set_controlword() { write(DevicePlant::kDrive, 0x6040, 0, input_.word() & 0x3FF); }

  void ask_lss() {
    const std::uint8_t command = input_.one_of(kLssCommands);
    std::array<std::uint8_t, 8> request{command};
    const std::uint8_t kind = input_.byte();
    if ((kind & 1) != 0) {
      std::ranges::copy(input_.bytes<7>(), request.begin() + 1);
    } else {
      request[1] = kind / 2;
      request[2] = input_.byte() % 11;
    }
    receive(LssSlave::kRequestId, request);
  }

  void ask_remotely() {
    Frame frame{.id = input_.one_of(kIdentifiers), .flags = Frame::kRemote};
    frame.length = input_.byte() % 9;
    plant_.receive(frame);
  }

  void synchronise() {
    const std::uint8_t counter = input_.byte();
    receive(0x080, std::span(&counter, counter < 0x80 ? 0u : 1u));
  }

  void tell_time() { receive(0x100, input_.bytes<6>()); }
  void tell_state() {
    const std::uint32_t whose = input_.byte() % 8u;
    receive(nmt::kErrorControlId + whose, input_.bytes<1>());
  }

  void any_frame() {
    const std::uint8_t head = input_.byte();
    Frame frame{.id = (head & 0x80) != 0 ? input_.one_of(kIdentifiers) : input_.word() & 0x7FFu};
    frame.flags = (head & 0x40) != 0 ? head & 3 : 0;
    if ((frame.flags & Frame::kExtended) != 0 && (head & 0x20) != 0) frame.id |= frame.id << 18;
    frame.length = std::min<std::uint8_t>(head & 0x0F, 8);
    frame.data = input_.bytes<8>();
    plant_.receive(frame);
  }

  // ---- Time

  void pass(Time duration) {
    const Time end = fine_ ? plant_.now + duration : ends_.at(passes_);
    ++passes_;
    const Time reached = plant_.advance_to(end);
    if (fine_) ends_.push_back(reached);
  }
  void wait() { pass(Time{1} << input_.byte() % 25u); }
  void wait_milliseconds() { pass(input_.byte() * kMillisecond); }

  // ---- Signals

  void set_input() {
    const std::size_t whom = place();
    const std::uint16_t index = input_.one_of(kInputs);
    const std::uint8_t sub = input_.byte() % 4;
    const std::uint8_t kind = input_.byte();
    const double value = kind < 0x40
                             ? std::bit_cast<double>(std::uint64_t{input_.number()} << 32)
                             : (kind < 0x80 ? kNumbers[kind % kNumbers.size()] : input_.word() - 32768.0);
    plant_.node(whom).set_input(index, sub, value, plant_.now);
  }

  void set_incident() {
    sim::Node& node = plant_.node(place());
    const std::uint8_t which = input_.byte();
    const auto incidents = node.behaviour().incidents();
    if (incidents.empty()) return;
    require(node.set_incident(incidents[which / 2 % incidents.size()], which % 2 == 0, plant_.now),
            "a device has the incidents that it names");
  }

  void change_bus() {
    const std::uint8_t kind = input_.byte();
    const auto state = static_cast<BusState>(kind >> 2 & 3);
    switch (kind & 3) {
      case 0: return plant_.world.bus().set_link((kind & 4) == 0);
      case 1: return plant_.world.bus().set_state(state, plant_.now);
      case 2: return plant_.node(place()).port().set_state(state, plant_.now);
      default: return plant_.node(place()).bring_up_to_date(plant_.now);
    }
  }

  // ---- Faults

  static base::Value value_in(const base::Row& row, std::uint16_t part) {
    if (!row.choices.empty()) return std::string(row.choices[part % row.choices.size()]);
    const double within =
        static_cast<double>(row.low) + static_cast<double>(row.high - row.low) * part / 65535;
    if (row.form == base::Form::kNumber) return within;
    return static_cast<std::int64_t>(within);
  }

  /// A fault of any kind with any allowed values.
  sim::FaultOrProblem any_fault(sim::FaultPlace here) {
    const std::size_t kind = input_.byte() % sim::kFaultKinds;
    sim::Fault fault = sim::fault_rows()[kind].standard;
    fault.kind = static_cast<sim::FaultKind>(kind);
    std::uint32_t chosen = input_.number();
    for (const auto* setting : sim::keys_of(sim::fault_rows()[kind]))
      if ((std::exchange(chosen, chosen >> 1) & 1) != 0)
        setting->store(*setting, fault, value_in(*setting, input_.word()), 0);
    return sim::parse_fault(sim::text_of(fault), here);
  }

  void add(const sim::FaultOrProblem& found, std::size_t whom) {
    if (!may_fault_ || !found.problem.empty()) return;
    const sim::FaultOrProblem again = sim::parse_fault(
        sim::text_of(found.fault), sim::row_of(found.fault.kind).place == sim::FaultPlace::kBus
                                       ? sim::FaultPlace::kBus
                                       : sim::FaultPlace::kNode);
    require(again.problem.empty() && again.fault == found.fault, "a fault is what its text says");
    whom < DevicePlant::kNodes ? plant_.add_fault(whom, found.fault) : plant_.add_bus_fault(found.fault);
  }

  void add_fault() {
    const std::size_t whom = input_.byte() % (DevicePlant::kNodes + 1);
    add(any_fault(place_of(whom)), whom);
  }
  void add_fault_by_text() {
    const std::size_t whom = input_.byte() % (DevicePlant::kNodes + 1);
    const auto text = input_.take(input_.byte() % 64u);
    add(sim::parse_fault(text_of(text), place_of(whom)), whom);
  }
  static sim::FaultPlace place_of(std::size_t whom) {
    return whom < DevicePlant::kNodes ? sim::FaultPlace::kNode : sim::FaultPlace::kBus;
  }

  void remove_faults() {
    const std::size_t whom = input_.byte() % (DevicePlant::kNodes + 1);
    const unsigned number = input_.byte() % 8u;
    sim::FaultSet& faults = whom == DevicePlant::kNodes ? plant_.world.faults() : plant_.node(whom).faults();
    number == 0 ? faults.clear(plant_.now) : void(faults.remove(number, plant_.now));
  }

  Input input_;
  DevicePlant plant_;
  bool fine_;
  bool may_fault_ = false;
  std::vector<Time>& ends_;  ///< of the steps of time: as far as the first run came
  std::size_t passes_ = 0;
};

const Program::Step Program::kSteps[] = {
    &Program::command,
    &Program::write_object,
    &Program::write_small_number,
    &Program::read_object,
    &Program::ask_anything,
    &Program::store_or_restore,
    &Program::configure_pdo,
    &Program::enable_drive,
    &Program::set_controlword,
    &Program::ask_lss,
    &Program::ask_remotely,
    &Program::synchronise,
    &Program::tell_time,
    &Program::tell_state,
    &Program::any_frame,
    &Program::wait,
    &Program::wait_milliseconds,
    &Program::set_input,
    &Program::set_incident,
    &Program::change_bus,
    &Program::add_fault,
    &Program::add_fault_by_text,
    &Program::remove_faults,
};

PlantOptions options_of(std::span<const std::uint8_t> input) {
  const std::uint8_t bits = input.empty() ? std::uint8_t{0} : input.front();
  PlantOptions options;
  options.bit_rate = (bits & kPaced) != 0 ? 125'000 : 0;
  options.signals = (bits & kSignals) != 0;
  options.stores = (bits & kNoStore) == 0;
  return options;
}

}  // namespace

void run(Input input) {
  PlantOptions options = options_of(input.rest());
  std::vector<Time> ends;
  Program fine(input.rest(), options, ends);
  fine.run();
  if (!is_read_twice(input.rest().size())) return;
  options.by_deadlines = false;
  Program coarse(input.rest(), options, ends);
  coarse.run();
  require(fine.seen() == coarse.seen(), "the same frames at the same times, in whatever steps time passes");
}

}  // namespace cbcan::fuzz
