// SPDX-License-Identifier: MIT
#include "journal/watch.hpp"

#include <fmt/core.h>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/cob_id.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "journal/event_text.hpp"

namespace cbcan::journal {

namespace {

constexpr Time kCured = 10 * kSecond;
constexpr std::ptrdiff_t kClients = 4;  ///< with the same mistake; further ones count for the oldest
constexpr unsigned kOwnPdos = 16;
constexpr unsigned kPdos = 512;

// CiA 402: the objects of axis n are 800h x (n - 1) later.
constexpr std::uint16_t kControlword = 0x6040;
constexpr std::uint16_t kLastControlword = 0x9840;
constexpr std::uint16_t kAxis = 0x800;
constexpr std::uint16_t kStateMask = 0x6F;  ///< of the statusword
constexpr std::uint16_t kReadyToSwitchOn = 0x21;

/// The number whose hexadecimal digits are the decimal ones of `number`; nullopt: it is too large.
template <class Number>
std::optional<Number> digits_as_hexadecimal(Number number) {
  return base::parse<Number>(std::to_string(number), 16);
}

bool covers(const modbus::Range& range, std::size_t address) {
  return range.overlaps({address, 1});
}

bool is_controlword(std::uint16_t index) {
  return index >= kControlword && index <= kLastControlword && (index - kControlword) % kAxis == 0;
}

/// Which of these PDOs is valid and has this CAN-ID; `count` = none.
unsigned pdo_with(const ObjectDictionary& dictionary, std::uint16_t first, unsigned count, std::uint32_t id) {
  for (unsigned pdo = 0; pdo < count; ++pdo) {
    const auto cob_id =
        static_cast<std::uint32_t>(dictionary.get(static_cast<std::uint16_t>(first + pdo), 1));
    if (cob_id != 0 && (cob_id & cob::kInvalid) == 0 && cob::id_of(cob_id) == id) return pdo;
  }
  return count;
}

/// "#1 (read node 99 1000h:00)"
std::string name_of(const Event& request, const Journal& journal) {
  return fmt::format("#{} ({})", request.transaction,
                     base::made([&](Buffer& to) { append_request(to, request, journal, nullptr); }));
}

}  // namespace

Advisor::Advisor(Journal& journal, const Network& network, std::span<const PlcWindow> windows)
    : journal_(journal), network_(network) {
  for (const PlcWindow& window : windows)
    programs_.push_back({.window = window});
}

// ---- What has been seen

void Advisor::advise(Mistake mistake, std::uint32_t client, const Event& about, std::string words) {
  const auto is_same = [&](const Advice& each) { return each.mistake == mistake && each.client == client; };
  const Time at = now_ - network_.started;
  auto known = std::ranges::find_if(all_, is_same);
  if (known == all_.end() && std::ranges::count(all_, mistake, &Advice::mistake) < kClients)
    known = all_.insert(all_.end(), {.mistake = mistake, .client = client});
  if (known == all_.end())
    known = std::ranges::min_element(
        all_, {}, [mistake](const Advice& each) { return each.mistake == mistake ? each.last : kNever; });
  const bool goes_on = known->count++ != 0 && at - known->last < kCured;
  known->last = at;
  if (goes_on) return;
  known->client = client;
  known->words = std::move(words);
  known->number = journal_.end();
  known->event = {.kind = Kind::kAdvice, .network = network_.number, .node = about.node, .at = at};
  known->event.state = static_cast<std::uint8_t>(mistake);
  known->event.transaction = about.transaction;
  known->event.code = client;
  journal_.add(known->event, known->words);
}

void Advisor::advise(Mistake mistake, const Program& program, std::string words) {
  if (program.client != kNoClient) advise(mistake, program.client, program.request, std::move(words));
}

const std::vector<Advice>& Advisor::all(Time now, bool has_ended) {
  now_ = now;
  look_at_outputs();
  const Time patience = has_ended ? 0 : kCured;
  if (asked_ && now_ >= asked_->at + patience) look_at_state_request();
  for (Program& program : programs_)
    if (program.renumbered_at != kNever) look_at_number(program, patience);
  return all_;
}

// ---- Modbus requests

void Advisor::on_modbus(std::uint32_t client, const modbus::Access& access, Time now) {
  client_ = client;
  now_ = now;
  if (covers(access.read, regmap::kExecuteFlag) &&
      network_.registers[regmap::kExecuteFlag] != regmap::kExecute)
    programs_.front().unread.clear();
  look_at_outputs();
  if (access.written.count == 0) return;
  look_at_addresses(access.written);
  look_at_process_data(access.written);
  if (access.written.overlaps(programs_.front().range())) return look_at_request(access.written);
  for (Program& program : std::span(programs_).subspan(1))
    if (access.written.overlaps(program.range())) look_at_number(program, kCured);
}

void Advisor::look_at_addresses(const modbus::Range& written) {
  const auto holds = [&](std::size_t address, std::uint16_t word) {
    return covers(written, address) && network_.registers[address] == word;
  };
  constexpr std::size_t kFlag = regmap::kExecuteFlag;
  const auto has_before = [](const Program& each) { return covers(each.range(), kFlag - 1); };
  const modbus::Range process{network_.process_first, regmap::kProcessWords};
  std::string_view seen;
  if (holds(kFlag - 1, regmap::kExecute) && !covers(process, kFlag - 1) &&
      std::ranges::none_of(programs_, has_before))
    seen = "CA0Eh is in R3699";
  if (holds(kFlag + 1, regmap::kExecute)) seen = "CA0Eh is in R3701";
  if (holds(kFlag, regmap::kSdoRead) || holds(kFlag, regmap::kSdoWrite)) seen = "the command is in R3700";
  if (!seen.empty())
    advise(
        Mistake::kAddress, *client_, {},
        fmt::format("{}, one register off: addresses count from 0 here, and R3700 is address 3700, which a "
                    "program that counts from 1 calls 43701",
                    seen));
}

void Advisor::look_at_process_data(const modbus::Range& written) {
  const std::size_t outputs = network_.process_first + regmap::kInputWords;
  if (written.overlaps({network_.process_first, regmap::kInputWords}))
    advise(Mistake::kInputs, *client_, {},
           fmt::format("R{}..R{} are inputs from the network: what is written there reaches no node, and the "
                       "next PDO replaces it; outputs begin at R{}",
                       network_.process_first, outputs - 1, outputs));
  if (!written.overlaps({outputs, regmap::kOutputWords}) || outputs_at_ != kNever || was_started_) return;
  outputs_at_ = now_;
  outputs_client_ = *client_;
  look_at_outputs();
}

void Advisor::look_at_outputs() {
  if (outputs_at_ == kNever) return;
  const Coprocessor& own = network_.module->coprocessor();
  was_started_ = own.own_node().state() == nmt::State::kOperational || own.manager().active();
  if (!was_started_ && now_ < outputs_at_ + kCured) return;
  outputs_at_ = kNever;
  if (was_started_) return;
  advise(
      Mistake::kNotStarted, outputs_client_, {},
      fmt::format("outputs were written ten seconds ago, but the own node is {}, so no PDO carries them; "
                  "start it: write 1F82h with R3704 = {}, R3706 = 5",
                  state_text(static_cast<std::uint8_t>(own.own_node().state())), own.own_node().node_id()));
}

bool Advisor::Program::repeats() const {
  std::size_t count = regmap::kData - regmap::kCommand;
  if (request.service == Service::kNmt) ++count;
  if (request.service == Service::kWrite)
    count = std::min<std::size_t>(count + (word(regmap::kDataSize) + 1u) / 2, kWords - 1);
  return std::ranges::equal(std::span(words).subspan(1, count), window.out.subspan(1, count));
}

void Advisor::look_at_request(const modbus::Range& written) {
  Program& program = programs_.front();
  const bool has_flag = covers(written, regmap::kExecuteFlag);
  if (!has_flag && std::exchange(program.is_flag_first, false))
    advise(Mistake::kFlagFirst, program,
           fmt::format("R{}.. was written after CA0Eh in R3700: the request had begun without it, and ended "
                       "with result 1; write R3700 last, or all in one request",
                       written.first));
  if (has_flag && program.window.out[0] != regmap::kExecute) program.unread.clear();  // it cancels
  if (!program.is_open || program.window.out[0] != regmap::kExecute) return;
  if (!network_.module->coprocessor().executes_registers()) return program.take_words();
  if (has_flag && !program.repeats())
    advise(Mistake::kBusy, *client_, program.request,
           fmt::format("not executed: {}{} is in progress; wait until R3700 is no longer CA0Eh",
                       name_of(program.request, journal_),
                       program.client == *client_    ? ""
                       : program.client == kNoClient ? " of a command"
                                                     : fmt::format(" of client {}", program.client)));
}

void Advisor::look_at_number(Program& program, Time patience) {
  const auto in = program.window.in;
  const std::uint16_t number = program.window.out[0];
  if (program.is_open && in[regmap::kScannerTaken] == number) program.take_words();  // it may wait
  const bool is_finished = number != 0 && program.request.transaction != 0 && !program.is_open &&
                           in[regmap::kScannerTaken] == number && in[regmap::kScannerAnswered] == number;
  if (!is_finished || program.repeats()) {
    program.renumbered_at = kNever;
    return;
  }
  program.renumbered_at = std::min(program.renumbered_at, now_);
  if (now_ < program.renumbered_at + patience) return;
  program.renumbered_at = kNever;
  program.take_words();  // once for these words
  advise(
      Mistake::kNumber, program,
      fmt::format("the words at R{} are not executed: number {} is that of {}, which has its result; a new "
                  "request needs a new number",
                  program.window.first, number, name_of(program.request, journal_)));
}

void Advisor::on_other_unit(std::uint32_t client, std::uint8_t unit, Time now) {
  now_ = now;
  advise(Mistake::kUnit, client, {},
         fmt::format("unit ID {} selects no network, so the answer is exception 0Ah; network n has unit "
                     "ID n, and 0 and 255 are network 1",
                     unit));
}

void Advisor::on_second_writer(unsigned channel, std::uint32_t client, std::uint32_t newer, Time now) {
  now_ = now;
  advise(
      Mistake::kTwoWriters, client, {},
      fmt::format("clients {} and {} write to the scanner window of channel {}, and each takes the other's "
                  "results for its own; use one writer, or a channel for each",
                  client, newer, channel));
}

// ---- Transactions

void Advisor::on_begun(const Event& begun) {
  Program& program = programs_[begun.state];
  if (begun.state == 0 && !program.unread.empty() && client_ && !program.repeats())
    advise(Mistake::kUnread, *client_, program.request,
           fmt::format("{} failed: {}; the next request came before any client had read that; read R3700 "
                       "until it is not CA0Eh, and look at it",
                       name_of(program.request, journal_), program.unread));
  program.unread.clear();
  program.is_flag_first = false;
  program.is_open = true;
  program.client = client_.value_or(kNoClient);
  program.request = begun;
  program.take_words();
  const ObjectDictionary* const drive = is_controlword(begun.index) ? dictionary_of(begun.node) : nullptr;
  const auto statusword = static_cast<std::uint16_t>(begun.index + 1);
  program.was_ready = drive != nullptr && (drive->get(statusword, 0) & kStateMask) == kReadyToSwitchOn;
  if (begun.service == Service::kNmt && program.word(regmap::kObjectSubIndex) == 0)
    advise(Mistake::kAllNodes, program,
           fmt::format("1F82h with sub-index 0 addresses no node; {} = 128 is all nodes, 1..127 is one node",
                       program.name_of(regmap::kObjectSubIndex)));
  if (begun.service != Service::kState || !client_) return;
  // A scan of node IDs asks for a neighbour next.
  const bool is_same = asked_ && asked_->client == *client_;
  const bool scans = is_same && std::abs(asked_->request.node - begun.node) == 1;
  if (is_same && !scans) look_at_state_request();
  asked_ = StateRequest{*client_, begun, now_, false, scans};
}

void Advisor::look_at_state_request() {
  if (!std::exchange(asked_->is_unknown, false) || asked_->is_scanning) return;
  const std::uint8_t node = asked_->request.node;
  const auto meant = digits_as_hexadecimal(node);
  const bool exists = meant && network_.world.node(*meant) != nullptr;
  advise(Mistake::kNotHeard, asked_->client, asked_->request,
         fmt::format(
             "node {} is not in this plant and has sent nothing, so its state is 6, not detected{}", node,
             exists ? fmt::format("; did you mean node {}h = {}?", node, *meant) : "; check the node ID"));
}

void Advisor::on_ended(const Event& ended, const Seen& seen) {
  now_ = network_.started + ended.at;
  Program& program = programs_[ended.state];
  program.is_open = false;
  const std::uint16_t command = program.word(regmap::kCommand);
  const bool refused = ended.result == static_cast<std::uint16_t>(regmap::Result::kCommandCodeError);
  if (refused) program.is_flag_first = command == 0;
  if (refused && (command == 0x5055 || command == 0x5066))
    advise(Mistake::kDecimal, program,
           fmt::format("the command was {:X}h; 5055 (13BFh, read) and 5066 (13CAh, write) are decimal",
                       command));
  if (ended.state == 0 && failed(ended) && !is_cancelled(ended)) program.unread = result_text(ended);
  if (ended.result == kNeverSent && seen.others_first && client_)
    advise(Mistake::kTimeout, program,
           fmt::format("{} was cancelled before its first frame: another request to its node was in "
                       "progress, or a late response to one was awaited; allow it more than twice the SDO "
                       "timeout of the module, or ask this node less often",
                       name_of(ended, journal_)));
  if (asked_ && asked_->request.transaction == ended.transaction)
    asked_->is_unknown = ended.result == 0 && !seen.heard && dictionary_of(ended.node) == nullptr &&
                         !network_.module->coprocessor().manager().is_listed(ended.node);
  if (ended.result == static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError))
    look_at_object(program, ended.code);
  if (ended.result == 0 && ended.service == Service::kWrite) look_at_controlword(program);
}

void Advisor::look_at_object(const Program& program, std::uint32_t abort) {
  const Event& request = program.request;
  const ObjectDictionary* const dictionary = dictionary_of(request.node);
  ObjectEntry entry{};
  if (dictionary == nullptr) return;
  if (abort == static_cast<std::uint32_t>(AbortCode::kNoObject)) {
    const auto meant = digits_as_hexadecimal(request.index);
    const bool exists =
        meant && request.index >= 1000 && dictionary->find(*meant, 0, entry) != AbortCode::kNoObject;
    if (!exists) no_object_at_ = now_;
    if (!exists || (no_object_at_ != kNever && now_ < no_object_at_ + kSecond)) return;  // a scan
    return advise(Mistake::kHexadecimal, program,
                  fmt::format("node {} has no object {:X}h, which is {} in decimal; did you mean {}h = {}?",
                              request.node, request.index, request.index, request.index, *meant));
  }
  constexpr std::uint32_t kAnyLength = static_cast<std::uint32_t>(AbortCode::kObjectLength) >> 16;
  const bool is_about_size =
      abort >> 16 == kAnyLength || abort == static_cast<std::uint32_t>(AbortCode::kReadLength);
  if (!is_about_size || dictionary->find(request.index, request.sub, entry) != AbortCode::kNone) return;
  const std::size_t size = entry.has(ObjectFlags::kVariable) ? dictionary->value(entry, request.sub).size()
                           : entry.has(ObjectFlags::kPacked) ? 1
                                                             : entry.capacity;
  const std::uint16_t given = program.word(regmap::kDataSize);
  const bool is_read = request.service == Service::kRead;
  if (size > regmap::kMaxDataBytes) return;
  if (is_read ? size <= given : size == given || entry.has(ObjectFlags::kVariable)) return;
  advise(
      Mistake::kSize, program,
      fmt::format("{:04X}h:{:02X} of node {} has {} byte{}, and {} was {}; a {} needs {}", request.index,
                  request.sub, request.node, size, size == 1 ? "" : "s", program.name_of(regmap::kDataSize),
                  given, is_read ? "read" : "write", is_read ? "as many or more" : "as many"));
}

// ---- Drives

void Advisor::look_at_controlword(const Program& program) {
  const auto [node, index] = std::pair(program.request.node, program.request.index);
  if (!is_controlword(index)) return;
  // Bits 0..3 and 7: CiA 402, table of commands.
  const unsigned command = program.word(regmap::kData) & 0x8F;
  const auto drive = std::ranges::find_if(enabling_, [&](const Enabling& each) {
    return each.node == program.request.node && each.index == program.request.index;
  });
  if ((command & 0x87) == 0x06) {
    if (drive != enabling_.end()) enabling_.erase(drive);
    enabling_.push_back({node, index, program.was_ready, false});
    return;
  }
  if (drive == enabling_.end()) return;
  drive->has_missed = drive->has_missed || !drive->is_shown;
  drive->is_shown = false;
  if (command == 0x07) return;
  const bool is_mistake = command == 0x0F && drive->has_missed;
  enabling_.erase(drive);
  if (!is_mistake) return;
  const sim::Node* const at = network_.world.node(node);
  const Time delay = at == nullptr ? 0 : at->command_delay();
  advise(Mistake::kStatusword, program,
         fmt::format(
             "06h, 07h and 0Fh were written to {:X}h of node {}, but {:X}h was not read between them; wait "
             "until it shows the state{}",
             index, node, index + 1,
             delay == 0 ? ""
                        : fmt::format(": this drive needs {} ms for a command",
                                      (delay + kMillisecond - 1) / kMillisecond)));
}

void Advisor::on_frame(const Frame& frame) {
  for (Enabling& drive : enabling_)
    if (!drive.is_shown) drive.is_shown = shows_statusword(frame, drive);
}

/// A response by SDO, or a TPDO that the own node receives; of a node that is not simulated, any.
bool Advisor::shows_statusword(const Frame& frame, const Enabling& drive) const {
  const auto statusword = static_cast<std::uint16_t>(drive.index + 1);
  if (frame.flags != 0) return false;
  if (frame.id == sdo::kResponseId + drive.node)
    return sdo::index_of(sdo::multiplexer_of(frame)) == statusword &&
           !sdo::is(frame.data[0], sdo::Response::kAbort);
  const Coprocessor& own = network_.module->coprocessor();
  if (own.own_node().state() != nmt::State::kOperational ||
      pdo_with(own.own_objects(), object::kRpdoParameter, kOwnPdos, frame.id) == kOwnPdos)
    return false;
  const ObjectDictionary* const dictionary = dictionary_of(drive.node);
  if (dictionary == nullptr) return true;
  const unsigned pdo = pdo_with(*dictionary, object::kTpdoParameter, kPdos, frame.id);
  const auto mapping = static_cast<std::uint16_t>(object::kTpdoMapping + pdo);
  const std::uint64_t count = pdo == kPdos ? 0 : dictionary->get(mapping, 0);
  for (std::uint8_t sub = 1; sub <= count && sub <= 64; ++sub)
    if (dictionary->get(mapping, sub) >> 16 == statusword) return true;
  return false;
}

// ---- Nodes

/// Null: the node is not simulated.
const ObjectDictionary* Advisor::dictionary_of(std::uint8_t id) const {
  const sim::CoprocessorModule* const own = network_.module;
  if (own != nullptr && (id == 0 || id == own->coprocessor().own_node().node_id()))
    return &own->coprocessor().own_objects();
  const sim::Node* const node = network_.world.node(id);
  return node == nullptr ? nullptr : &node->device().dictionary();
}

}  // namespace cbcan::journal
