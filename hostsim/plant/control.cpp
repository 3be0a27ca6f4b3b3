// SPDX-License-Identifier: MIT
#include "plant/control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/regmap.hpp"
#include "config/config.hpp"
#include "devices/devices.hpp"
#include "journal/event_text.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::plant {

namespace {

constexpr std::string_view kBus = "bus";
constexpr std::string_view kPlc = "plc";
constexpr std::string_view kAll = "all";

/// `place`: from 0.
std::string place_name(std::size_t network, std::size_t place) {
  return fmt::format("{}#{}", prefix_of(network), place + 1);
}

std::string id_text(const sim::Node& node, std::size_t network) {
  const std::uint8_t id = node.device().node_id();
  return id == sim::Node::kNoNodeId ? "-" : prefix_of(network) + std::to_string(id);
}

/// The value of the row with this name.
template <class Rows>
const auto& named(const Rows& rows, std::string_view name) {
  const auto first = [](const auto& row) { return row.first; };
  const auto found = std::ranges::find(rows, name, first);
  if (found != rows.end()) return found->second;
  refuse("\"{}\": must be {}", name, base::listed(base::column(rows, first)));
}

constexpr auto kOnOff = std::to_array<std::pair<std::string_view, bool>>({{"on", true}, {"off", false}});

constexpr auto kNmtCommands = std::to_array<std::pair<std::string_view, nmt::Command>>({
    {"start", nmt::Command::kStart},
    {"stop", nmt::Command::kStop},
    {"preop", nmt::Command::kEnterPreOperational},
    {"reset-node", nmt::Command::kResetNode},
    {"reset-comm", nmt::Command::kResetCommunication},
});

/// One line's execution.
class Execution {
 public:
  Execution(Control& control, Words words)
      : control_(control), words_(std::move(words)), now_(control.started() + control.now()) {}

  struct Command {
    std::size_t least;  ///< words after the name
    std::size_t most;
    Reply (Execution::*run)();
    Usage text;
  };
  static std::span<const Command> commands();

 private:
  Where place(std::string_view word) const { return where(word, control_.networks()); }
  sim::World& world(std::size_t network) const { return control_.world(network); }
  /// Those of the bus or node that the word names.
  sim::FaultSet& faults(std::string_view word) const {
    const Where of = place(word);
    if (of.name == kPlc) return control_.network(of.network).plc_faults();
    return of.name == kBus ? world(of.network).faults() : node_of(control_, word).faults();
  }

  /// Calls `visit(place, faults)` for every bus and every node.
  template <class Visitor>
  void for_all_faults(Visitor visit) const {
    for (std::size_t network = 1; network <= control_.networks(); ++network) {
      sim::World& all = world(network);
      visit(fmt::format("{}{}", prefix_of(network), kBus), all.faults());
      visit(fmt::format("{}{}", prefix_of(network), kPlc), control_.network(network).plc_faults());
      for (std::size_t place = 0; place < all.nodes().size(); ++place)
        visit(place_name(network, place), all.nodes()[place]->faults());
    }
  }

  Reply list_nodes() {
    std::string text;
    for (std::size_t network = 1; network <= control_.networks(); ++network) {
      const auto nodes = world(network).nodes();
      for (std::size_t place = 0; place < nodes.size(); ++place) {
        const sim::Node& node = *nodes[place];
        text += fmt::format("{} {} {} {}", place_name(network, place), id_text(node, network), state_of(node),
                            node.device_name());
        text += node.name().empty() ? "\n" : fmt::format(" \"{}\"\n", base::to_utf8(node.name()));
      }
    }
    return {text + "ok\n"};
  }

  Reply get() { return {"ok " + value_of(control_, words_[1], words_[2]) + "\n"}; }

  Reply list_points() {
    std::string text;
    for (const auto& [point, object, value, target] : points_of(control_, words_[1]))
      text +=
          fmt::format("{} {} {}{}{}{}{} \"{}\"\n", name_of(point.kind), object, text_of_number(value),
                      target ? " to " : "", target ? text_of_number(*target) : "",
                      point.unit.empty() ? "" : " ", base::to_utf8(point.unit), base::to_utf8(point.name));
    return {text + "ok\n"};
  }

  Reply set() {
    sim::Node& of = running_node_of(control_, words_[1]);
    auto number = number_in(base::parse_value(words_[3]));
    if (!number) refuse("\"{}\": must be a number, true or false", words_[3]);
    const std::string object = object_of(of, words_[2]);
    const auto terminal = terminal_of(object);
    const Address address = terminal ? Address{terminal->index, terminal->sub} : address_of(object);
    if (terminal && terminal->is_output)
      refuse("{}: an output; set an input, or let a PLC write it", words_[2]);
    if (terminal && terminal->bit) number = with_bit(of, *terminal, *number != 0);
    const std::string name = config::object_name(address.index, address.sub);
    if (address.index <= object::kLastCommunication)
      refuse("{}: objects below 2000h are for SDO, not for set", name);
    if (!of.set_input(address.index, address.sub, *number, now_))
      refuse("{}: node {} has no such number", name, words_[1]);
    return {"ok\n"};
  }

  /// The number of which only this bit is set or cleared.
  double with_bit(sim::Node& of, const sim::Terminal& terminal, bool on) {
    of.bring_up_to_date(now_);
    const auto object = of.number({terminal.index, terminal.sub, std::nullopt, false});
    const auto before = static_cast<std::uint64_t>(
        of.number({terminal.index, terminal.sub, std::nullopt, true}).value_or(object.value_or(0)));
    const std::uint64_t bit = std::uint64_t{1} << *terminal.bit;
    return static_cast<double>(on ? before | bit : before & ~bit);
  }

  Reply incident() {
    sim::Node& of = running_node_of(control_, words_[1]);
    const bool present = named(kOnOff, words_[3]);
    if (of.set_incident(words_[2], present, now_)) return {"ok\n"};
    const auto known = of.behaviour().incidents();
    refuse("\"{}\": node {} has no such incident{}{}", words_[2], words_[1], known.empty() ? "" : "; it has ",
           base::listed(known, ", "));
  }

  Reply reload() {
    sim::Node& of = running_node_of(control_, words_[1]);
    if (of.device_name() != devices::kScript && devices::script_of(of.device_name()).empty())
      refuse("node {}: its device is {}, which is no script", words_[1], of.device_name());
    try {
      of.reload(now_);
    } catch (const std::runtime_error& problem) {
      throw Refused(problem.what());
    }
    return {"ok\n"};
  }

  Reply fault() {
    const std::string_view text = rest_of(words_, 2);
    sim::FaultSet& of = faults(words_[1]);
    const sim::FaultOrProblem parsed = sim::parse_fault(text, of.place());
    if (!parsed.problem.empty()) throw Refused(parsed.problem);
    return {fmt::format("ok {}\n", of.add(parsed.fault, now_))};
  }

  Reply list_faults() {
    constexpr std::size_t kMost = 1000;
    std::string text;
    std::size_t count = 0;
    const auto add = [&](std::string_view place, const sim::FaultSet& of) {
      for (const sim::SetFault& set : of.list())
        if (++count <= kMost)
          text += fmt::format("{} {} {} occasions={} fired={}\n", place, set.number, set.text, set.occasions,
                              set.fired);
    };
    if (words_.size() == 2)
      add(words_[1], faults(words_[1]));
    else
      for_all_faults(add);
    return {text + (count > kMost ? fmt::format("and {} more\nok\n", count - kMost) : "ok\n")};
  }

  Reply clear() {
    constexpr std::uint32_t kMostNumber = 1'000'000'000;
    if (words_.size() == 1) {
      for_all_faults([this](const std::string& /*place*/, sim::FaultSet& of) { of.clear(now_); });
      return {"ok\n"};
    }
    sim::FaultSet& of = faults(words_[1]);
    if (words_.size() == 2)
      of.clear(now_);
    else if (!of.remove(number_of(words_[2], 1, kMostNumber, "fault"), now_))
      refuse("fault {}: {} has none with this number", words_[2], words_[1]);
    return {"ok\n"};
  }

  Reply power() {
    const bool on = named(kOnOff, words_[2]);
    const Where of = place(words_[1]);
    if (of.name != kAll) {
      node_of(control_, words_[1]).set_power(on, now_);
      return {"ok\n"};
    }
    for (const auto& node : world(of.network).nodes())
      node->set_power(on, now_);
    return {"ok\n"};
  }

  // ---- The PLC

  Reply read() {
    const auto [network, first, count] = read_of(words_, control_.networks());
    return {fmt::format("ok {}\n", base::joined(control_.read(network, first, count)))};
  }

  /// write and trigger
  Reply write() {
    const auto [network, first, words] = writing_of(words_, control_.networks());
    control_.read(network, first, words.size());
    control_.network(network).write(first, words);
    return {"ok\n"};
  }

  /// All clients of commands are one client.
  Reply request() {
    constexpr std::uint32_t kClient = 0xFFFFFFFF;
    const auto [network, text] = place(words_[1]);
    const auto pdu = base::parse_hex(text);
    if (!pdu || pdu->empty() || pdu->size() > modbus::kMaxPdu)
      refuse("\"{}\": write a PDU in hexadecimal: 030E740001 reads R3700", text);
    if (control_.network(network).registers().empty()) control_.read(network, 0, 1);  // says so
    std::array<std::uint8_t, modbus::kMaxPdu> room;
    const modbus::Pdu response = control_.network(network).handle(
        {.client = kClient, .unit = static_cast<std::uint8_t>(network), .pdu = *pdu}, room);
    if (response.empty()) refuse("no response: a fault would close the connection of this request");
    return {fmt::format("ok {}\n", base::hex(response, ""))};
  }

  // ---- Other nodes on the bus

  Reply put_on_bus(std::size_t network, const Frame& frame) {
    if (!control_.network(network).send(frame)) refuse("the bus takes no frame now");
    return {"ok\n"};
  }

  Reply send() {
    const auto [network, name] = place(words_[1]);
    const auto frame = sim::parse_frame(name);
    if (!frame) refuse("frame \"{}\": write it as candump does: 605#4017100000000000", name);
    return put_on_bus(network, *frame);
  }

  Reply nmt() {
    const nmt::Command command = named(kNmtCommands, words_[1]);
    const auto [network, name] = place(words_[2]);
    const std::uint32_t node = name == kAll ? 0 : number_of(name, 1, nmt::kMaxNode, "node");
    return put_on_bus(network, nmt::command_frame(command, static_cast<std::uint8_t>(node)));
  }

  // ---- Time

  Reply wait() {
    Time within = kWaitWithin;
    if (words_.size() > 3 && words_[words_.size() - 2] == "within") {
      within = duration_of(words_.back());
      words_.resize(words_.size() - 2);
    }
    const std::string_view text = rest_of(words_, 1);
    return {.wait = std::make_unique<Wait>(
                Wait{control_, make_condition(text, control_), std::string(text), within, false})};
  }

  Reply pass() {
    const Time duration = duration_of(words_[1]);
    const std::string text = fmt::format("took >= {}", words_[1]);
    return {.wait =
                std::make_unique<Wait>(Wait{control_, make_condition(text, control_), text, duration, true})};
  }

  Reply list_advice() {
    const bool has_ended = words_.size() > 1;
    if (has_ended && words_[1] != "end") refuse("\"{}\": must be end", words_[1]);
    std::string text;
    for (std::size_t network = 1; network <= control_.networks(); ++network)
      for (const journal::Advice& advice : control_.network(network).advice(has_ended))
        text += fmt::format("{}{} {} {} {}\n", prefix_of(network), name_of(advice.mistake), advice.client,
                            advice.count, advice.words);
    return {text + "ok\n"};
  }

  Reply help() {
    std::string text;
    for (const Usage& command : command_usages())
      text += fmt::format("{:37} {}\n", command.usage, command.meaning);
    return {text + "ok\n"};
  }

  Reply tell_time() { return {"ok " + base::seconds_text(control_.now()) + "\n"}; }
  Reply shutdown() { return {.text = "ok\n", .shutdown = true}; }

  Control& control_;
  Words words_;
  Time now_;
};

std::span<const Execution::Command> Execution::commands() {
  constexpr std::size_t kMostWords = 123;  // of one FC 16 request
  // clang-format off
  static constexpr auto kCommands = std::to_array<Command>({
      {0, 0, &Execution::list_nodes, {"nodes", "Lists the nodes of all networks",
       "A line shows place in the network, node ID (`-` without one), NMT state, device and name."}},
      {2, 2, &Execution::get, {"get NODE INDEX[:SUB]|output:N|NAME", "Reads an object as by SDO, or a terminal",
       "Access rights are ignored. `output:N` is a digital output after polarity, filter mask and error value, "
       "`analogue-output:N` an analogue one, `input:N` and `analogue-input:N` are inputs; `INDEX:SUB.BIT` is one bit. "
       "`NAME` is one that `points` lists, with `-` for blanks: `level`."}},
      {1, 1, &Execution::list_points, {"points NODE", "Lists inputs, outputs and curves of the node's device",
       "A line shows kind, object, value, its target, unit and name."}},
      {3, 3, &Execution::set, {"set NODE INDEX[:SUB]|input:N|NAME NUMBER", "Sets an input from outside",
       "`input:N` is a digital input, `INDEX:SUB.BIT` one bit. The value is rounded and limited to the object's range, as a signal's. Objects from 2000h on that are no input "
       "are also set."}},
      {3, 3, &Execution::incident, {"incident NODE NAME on|off", "Begins or ends an incident of the device",
       "[Devices](devices.md) lists the names."}},
      {1, 1, &Execution::reload, {"reload NODE", "Reads and starts the Lua script of the node's device again",
       "Objects keep their values. If the new script has an error, the old one stays."}},
      {2, 2, &Execution::power, {"power NODE|all on|off", "Switches the power of a node; on is a cold start",
       "Stored parameters, a stored node ID, faults and incidents stay; signals begin again. `2/all` is network 2."}},
      {2, kAnyNumber, &Execution::fault, {"fault NODE|bus|plc KIND [KEY=VALUE ...]", "Injects a fault; the response is its number",
       "[Faults](faults.md) lists kinds and keys."}},
      {0, 1, &Execution::list_faults, {"faults [NODE|bus|plc]", "Lists the faults that are set",
       "A line shows how often each has acted; after 1,000 lines follows the number of others."}},
      {0, 2, &Execution::clear, {"clear [NODE|bus|plc [NUMBER]]",
       "Removes all faults, those of one place, or one of them", ""}},
      {1, 2, &Execution::read, {"read R [COUNT]", "Reads registers as the PLC does", ""}},
      {2, 1 + kMostWords, &Execution::write, {"write R WORD...", "Writes registers as the PLC does, in one request", ""}},
      {1, regmap::kWindowWords - 1, &Execution::write, {"trigger read|write WORD...",
       "Starts a transaction: writes R3701 and following, and CA0Eh, in one request",
       "`trigger read 0x42 0x6411 1 2`, `trigger write 0x42 0x6411 1 2 300`, `trigger 2/read ...` on network 2. A number "
       "instead of `read` is written to R3701."}},
      {1, 1, &Execution::request, {"modbus PDU", "Executes a Modbus request as one from Modbus TCP, with the faults of `plc`; the response is its PDU",
       "Both are hexadecimal; `2/030E740001` reads R3700 of network 2. A scan in one exchange is the lines `modbus` to write, `pass` and `modbus` to read, sent together."}},
      {1, 1, &Execution::send, {"send FRAME", "Sends a frame as another node",
       "In candump's format: `605#4017100000000000`, `742#R`, `2/000#0142` on network 2."}},
      {2, 2, &Execution::nmt, {"nmt start|stop|preop|reset-node|reset-comm NODE|all", "Sends an NMT command as another master", ""}},
      {1, kAnyNumber, &Execution::wait, {"wait CONDITION [within DURATION]", "Responds with the time when the condition holds",
       "After 60 s of the plant's time, or the duration (`us`, `ms`, `s`), the response is an error. On a manual clock time "
       "passes meanwhile, except while the PLC has to start a transaction: the limit is real time then."}},
      {1, 1, &Execution::pass, {"pass DURATION", "Responds with `at` and the time after the duration",
       "On a manual clock it makes time pass."}},
      {0, 1, &Execution::list_advice, {"advice [end]", "Lists mistakes of the PLC's program",
       "A line shows kind, Modbus client, how often it was seen, and the sentence of the latest event of the kind `advice`. With `end` the program has ended, so nothing follows the words that it has written last."}},
      {0, 0, &Execution::tell_time, {"time", "Seconds since the start", ""}},
      {0, 0, &Execution::shutdown, {"shutdown", "Ends the program", "A command after `--` gets SIGTERM."}},
      {0, 0, &Execution::help, {"help", "Lists the commands", ""}},
  });
  // clang-format on
  return kCommands;
}

/// The command that the line begins with.
const Execution::Command& command_of(const Words& words) {
  return row_of(Execution::commands(), words, "command", "; help lists them");
}

bool changes_plant(std::string_view name) {
  static constexpr std::array<std::string_view, 10> kThese{"set",   "incident", "power", "fault", "clear",
                                                           "write", "trigger",  "send",  "nmt",   "reload"};
  return std::ranges::find(kThese, name) != kThese.end();
}

}  // namespace

std::vector<Usage> command_usages() {
  return base::column(Execution::commands(), &Execution::Command::text);
}

std::vector<std::pair<std::string_view, std::string_view>> nmt_verbs() {
  return base::column(kNmtCommands, [](const auto& row) {
    return std::pair(row.first, journal::nmt_text(static_cast<std::uint8_t>(row.second)));
  });
}

ResponseParts parts_of(std::string_view response) {
  if (response.ends_with('\n')) response.remove_suffix(1);
  const std::size_t last = response.rfind('\n') + 1;  // 0 where there is one line
  return {response.substr(0, last), response.substr(last)};
}

void check_command(std::string_view line) {
  const Words words = base::words_of(line);
  if (words.empty()) refuse("there is no command in this line");
  const std::string_view name = command_of(words).text.name();
  if (name == "read") read_of(words, config::kMostNetworks);
  if (name == "write" || name == "trigger") writing_of(words, config::kMostNetworks);
  if (name == "pass" || name == "wait")
    refuse("{}: a step lets time pass by its keys at, after and wait", name);
}

// ---- Control

/// Observes one bus for all listeners, while there are any.
class Control::BusObserver final : public sim::Observer {
 public:
  BusObserver(Control& control, std::size_t network) : control_(control), network_(network) {}
  void on_bus_frame(const Frame& frame, Time now) override {
    for (Listener* listener : control_.listeners_)
      listener->on_frame(network_, frame, now - control_.started_);
  }

 private:
  Control& control_;
  std::size_t network_;
};

Control::Control(std::vector<Network*> networks, Time started)
    : networks_(std::move(networks)), started_(started), now_(started) {
  for (std::size_t i = 0; i < networks_.size(); ++i)
    observers_.push_back(std::make_unique<BusObserver>(*this, i + 1));
}

Control::~Control() = default;

void Control::add(Listener& listener) {
  for (std::size_t i = 0; i < networks_.size() && listeners_.empty(); ++i)
    networks_[i]->world().bus().observe(*observers_[i]);
  listeners_.push_back(&listener);
}

void Control::remove(Listener& listener) {
  std::erase(listeners_, &listener);
  for (std::size_t i = 0; i < networks_.size() && listeners_.empty(); ++i)
    networks_[i]->world().bus().ignore(*observers_[i]);
}

journal::Journal& Control::journal(std::size_t events, std::size_t bytes) {
  if (journal_) return *journal_;
  journal_ = std::make_unique<journal::Journal>(events, bytes);
  journal_->on_filled = [this] { on_journal_filled(); };
  for (Network* network : networks_)
    network->listen(*journal_, started_);
  return *journal_;
}

std::vector<std::uint16_t> Control::read(std::size_t network, std::uint32_t first, std::size_t count) {
  const auto registers = networks_[network - 1]->registers();
  if (registers.empty()) refuse("{}there is no module, which has the registers", config::in_network(network));
  if (first + count > regmap::kDiagnosticsFirst) networks_[network - 1]->publish();
  if (first + count > registers.size()) refuse("register {}: there are 0..{}", first, registers.size() - 1);
  const auto words = registers.subspan(first, count);
  return {words.begin(), words.end()};
}

std::uint32_t Control::transactions(std::size_t network) {
  const sim::CoprocessorModule* const module = networks_[network - 1]->module();
  return module == nullptr ? 0 : module->coprocessor().counters().executed;
}

Reply Control::execute(std::string_view line, Time now) {
  now_ = now;
  Words words = base::words_of(line);
  if (words.empty()) return {};
  journal::Event* told = nullptr;
  if (journal_ && changes_plant(words.front()))
    told =
        &journal_->add({.kind = journal::Kind::kCommand, .network = 0, .at = this->now()}, base::trim(line));
  try {
    const auto run = command_of(words).run;
    return (Execution(*this, std::move(words)).*run)();
  } catch (const Refused& refused) {
    if (told != nullptr) told->state = journal::kRefused;
    return {fmt::format("{}{}\n", kError, base::to_utf8(refused.what()))};
  }
}

}  // namespace cbcan::plant
