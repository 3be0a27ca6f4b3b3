// SPDX-License-Identifier: MIT
#include "scenario/search/judge.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/error.hpp"
#include "base/numbers.hpp"
#include "base/utf8.hpp"
#include "base/words.hpp"
#include "cbcan/canopen/dictionary/little_endian.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/sdo/protocol.hpp"
#include "cbcan/regmap.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::search {

namespace {

constexpr std::size_t kJournalEvents = 2048;
constexpr std::size_t kJournalBytes = 256 * 1024;
constexpr std::size_t kLastFrames = 12;
constexpr std::uint64_t kMostRequestsAtATime = 100'000;
constexpr Time kMinute = 60 * kSecond;
constexpr Time kSettle = 5 * kSecond;
constexpr Time kRest = 3 * kSecond;  ///< without faults, before each node is read

constexpr journal::Kinds kFollowed = journal::kinds_of(
    {journal::Kind::kModbus, journal::Kind::kBegun, journal::Kind::kEnded, journal::Kind::kFault});

/// No name is needed: a transaction's text names the object by its index.
const descriptions::ObjectName* no_name(std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t) {
  return nullptr;
}

Object object_of(const journal::Event& event) {
  return {event.network, event.node, event.index, event.sub};
}

/// 1010h and 1011h are commands: what is written is not what is read.
bool is_command(const Object& object) {
  return std::get<2>(object) == object::kStore || std::get<2>(object) == object::kRestore;
}

/// The message of a fault: the transfer in which it has acted cannot end well.
bool ends_transfer(std::string_view message) {
  constexpr std::array<std::string_view, 4> kKinds{"response-other-toggle", "response-other-crc", "abort",
                                                   "refuse"};
  return std::ranges::any_of(kKinds, [message](std::string_view kind) {
    return message.find(fmt::format(": {} ", kind)) != std::string_view::npos;
  });
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, 4> kNames{"done", "gave up", "broken", "late"};
  return kNames[static_cast<std::size_t>(verdict)];
}

std::string report(const Result& result) {
  if (result.what.empty()) return fmt::format("{}\n", name_of(result.verdict));
  const auto line = [](std::string_view name, const std::string& text) {
    return text.empty() ? "" : fmt::format("  {}: {}\n", name, text);
  };
  const bool says_why = result.during.empty() && !result.said.empty();
  return base::lines_to_utf8(fmt::format("{}: {}\n{}{}{}{}", result.what, result.seen,
                                         line("in", result.during), line("last request", result.request),
                                         result.said, says_why ? "" : result.frames));
}

Judge::Judge(Parts parts)
    : Listener(parts.control),
      parts_(std::move(parts)),
      control_(parts_.control),
      journal_(control_.journal(kJournalEvents, kJournalBytes)),
      cursor_(journal_, kFollowed) {
  always_ = conditions(parts_.settings.always);
  done_ = conditions(parts_.settings.done);
  gave_up_ = conditions(parts_.settings.gave_up);
  reached_ = conditions(parts_.settings.reached);
  result_.reached.resize(reached_.size());
  silent_since_.resize(control_.networks(), kNever);
  find_counters();
}

std::vector<Judge::Held> Judge::conditions(const std::vector<Line>& lines) {
  std::vector<Held> made;
  for (const Line& line : lines) {
    try {
      made.push_back({plant::make_condition(line.text, control_), line.text});
    } catch (const plant::Refused& refused) {
      throw base::UsageError(fmt::format("{}:{}: {}", parts_.settings.file, line.number, refused.what()));
    }
  }
  return made;
}

// ---- The buses

std::string Judge::Seen::text() const {
  return fmt::format("{} {}{}", base::seconds_text(at), plant::prefix_of(network), sim::frame_text(frame));
}

/// Before the node gets it.
void Judge::on_frame(std::size_t network, const Frame& frame, Time now) {
  frames_.push_back({network, frame, now});
  if (parts_.baseline == nullptr) record_.frames.push_back(frames_.back().text());
  if (frames_.size() > kLastFrames) frames_.pop_front();
  const auto number = static_cast<std::uint8_t>(network);
  const auto node = static_cast<std::uint8_t>(frame.id & nmt::kMaxNode);
  const std::uint32_t function = frame.id - node;
  if (function == nmt::kErrorControlId && frame.flags == 0 && frame.data[0] == 0)
    on_boot_up(number, node, now);
  if (nmt::is_command(frame) && frame.data[0] == static_cast<std::uint8_t>(nmt::Command::kStart)) {
    const std::uint8_t started = frame.data[1] & nmt::kMaxNode;
    for (unsigned each = 1; each <= nmt::kMaxNode; ++each)
      if (started == nmt::kAllNodes || started == each) on_started(number, static_cast<std::uint8_t>(each));
  }
  if (function != sdo::kRequestId && function != sdo::kResponseId) return;
  Server& server = servers_[{number, node}];
  if (function == sdo::kRequestId) on_request(frame, number, node, server, now);
  server.active = now;
  if (function != sdo::kResponseId) return;
  if (server.responses++ == 0) record_.nodes.insert(plant::prefix_of(number) + std::to_string(node));
  server.left_alone = 0;
  const bool begins_block = sdo::is(frame.data[0], sdo::Response::kBlockDownload) &&
                            sdo::block_step(frame.data[0]) == sdo::BlockStep::kInitiate;
  if (sdo::is(frame.data[0], sdo::Response::kInitiateDownload) || begins_block) {
    const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
    server.written.insert({sdo::index_of(mux), sdo::sub_of(mux)});
  }
}

/// 0 = there is none.
std::uint8_t Judge::own_node(std::size_t network) const {
  const sim::CoprocessorModule* const module = control_.network(network).module();
  return module == nullptr ? std::uint8_t{0} : module->coprocessor().own_node().node_id();
}

void Judge::on_boot_up(std::uint8_t network, std::uint8_t node, Time now) {
  servers_[{network, node}].booted = now;
  servers_[{network, node}].written.clear();
  for (auto& [place, server] : servers_)
    if (place.first == network && (place.second == node || node == own_node(network))) server.left_alone = 0;
}

/// The time that a client has waited is that between its last request and its abort.
void Judge::on_request(const Frame& frame, std::uint8_t network, std::uint8_t node, Server& server,
                       Time now) {
  const std::uint8_t command = frame.data[0];
  const bool aborts = sdo::is(command, sdo::Request::kAbort);
  if (aborts &&
      load_little_endian(std::span(frame.data).subspan(4)) == static_cast<std::uint32_t>(AbortCode::kTimeOut))
    server.left_alone = now + (now - server.active) / 10 * 9;  // frames may have waited for the bus
  else if (!aborts && now < server.left_alone && own_node(network) != 0)
    broken("a node that has not responded in time is left alone",
           fmt::format("{}{} has a request", plant::prefix_of(network), node));
  if (frame.length != 8) return;
  const sdo::Multiplexer mux = sdo::multiplexer_of(frame);
  const Object object{network, node, sdo::index_of(mux), sdo::sub_of(mux)};
  const bool uploads =
      sdo::is(command, sdo::Request::kInitiateUpload) ||
      (sdo::is(command, sdo::Request::kBlockUpload) && sdo::block_step(command) == sdo::BlockStep::kInitiate);
  if (sdo::is(command, sdo::Request::kInitiateDownload)) ++downloads_[object];
  if (uploads && node_of(object) != nullptr) read_[object].add(now, value_of(object));
}

/// A node with a number in 1F26h may have kept its configuration.
void Judge::on_started(std::uint8_t network, std::uint8_t node) {
  const sim::CoprocessorModule* const module = control_.network(network).module();
  if (module == nullptr) return;
  const Manager& manager = module->coprocessor().manager();
  const ConciseDcf values(manager.object(object::kConciseDcf, node));
  const bool keeps = !manager.object(object::kExpectedDate, node).empty();
  if (manager.phase(node) != Manager::Phase::kStart || keeps || !values.is_valid()) return;
  for (std::size_t at = ConciseDcf::kFirst; at != values.size(); at = values.after(at))
    if (const auto [index, sub, value] = values.at(at);
        !servers_[{network, node}].written.contains({index, sub}))
      broken(
          "a node that the module starts has been configured",
          fmt::format("{}{} has not confirmed {:04X}h:{:02X}", plant::prefix_of(network), node, index, sub));
}

sim::Node* Judge::node_of(const Object& object) {
  for (const auto& node : control_.world(std::get<0>(object)).nodes())
    if (node->has_power() && node->device().node_id() == std::get<1>(object)) return node.get();
  return nullptr;
}

std::vector<std::uint8_t> Judge::value_of(const Object& object) {
  const auto [network, id, index, sub] = object;
  sim::Node* const node = node_of(object);
  ObjectEntry entry{};
  if (node == nullptr || node->device().dictionary().find(index, sub, entry) != AbortCode::kNone) return {};
  return node->value(entry, sub, control_.started() + control_.now());
}

// ---- Transactions

bool Judge::look() {
  cursor_.look([this](std::uint64_t /*number*/, const journal::Event& event) {
    follow(event);
    return true;
  });
  check(always_, "always");
  for (std::size_t i = 0; i < reached_.size(); ++i)
    result_.reached[i] = result_.reached[i] ||
                         (reached_[i].condition->applies(control_) && reached_[i].condition->holds(control_));
  check_downloads();
  check_own_nodes();
  check_limits();
  return result_.verdict != Verdict::kBroken;
}

void Judge::broken(std::string_view what, std::string seen) {
  if (result_.verdict == Verdict::kBroken) return;
  result_.verdict = Verdict::kBroken;
  result_.what = what;
  result_.seen = std::move(seen);
  result_.during = during_;
  result_.request = request_;
  for (const Seen& last : frames_)
    result_.frames += "  " + last.text() + "\n";
}

void Judge::check(std::vector<Held>& held, std::string_view name) {
  for (const Held& each : held)
    if (each.condition->applies(control_) && !each.condition->holds(control_))
      broken(fmt::format("{} {}", name, each.text), each.condition->seen(control_));
}

void Judge::follow(const journal::Event& event) {
  if (event.kind == journal::Kind::kModbus) {
    request_ = text_of(event, journal_, no_name);
    return;
  }
  if (event.kind == journal::Kind::kFault) {
    if (!std::exchange(result_.happened, true)) requests_at_fault_ = requests();
    if (const auto during = open_.find(event.transaction); during != open_.end())
      during->second.must_fail |= ends_transfer(journal_.text(event));
    return;
  }
  during_ = request_text(event, journal_, no_name);
  if (event.kind == journal::Kind::kBegun) {
    open_[event.transaction] = {servers_[{event.network, event.node}].responses};
    if (event.service == journal::Service::kWrite) --downloads_[object_of(event)];
    return;
  }
  follow_end(event);
  open_.erase(event.transaction);
}

void Judge::follow_end(const journal::Event& ended) {
  const std::span<const std::uint8_t> bytes = journal_.bytes(ended);
  if (!parts_.counted.empty())
    record_.transactions.push_back({during_ + " " + result_text(ended), base::hex(bytes, ""), matches()});
  if (ended.node != 0) record_.nodes.insert(plant::prefix_of(ended.network) + std::to_string(ended.node));
  if (ended.result == 0 && !parts_.values_may_differ) check_value(ended, object_of(ended));
  const config::ModuleConfig& module = control_.network(ended.network).module_config();
  const Time timeout = module.sdo_timeout_ms * kMillisecond;
  const Open& open = open_[ended.transaction];
  if (open.must_fail && ended.result == 0) broken("a wrong response is noticed", "result 0");
  const std::uint32_t responses = servers_[{ended.network, ended.node}].responses - open.responses_before;
  const Time limit = (responses + 3 + open_.size()) * timeout;
  if (timeout != 0 && ended.took > limit)
    broken("a transaction ends in time",
           fmt::format("it took {} s, the limit is {} s", base::seconds_text(ended.took),
                       base::seconds_text(limit)));
}

void Judge::check_value(const journal::Event& ended, const Object& object) {
  const auto bytes = journal_.bytes(ended);
  if (node_of(object) == nullptr) return;
  if (ended.service == journal::Service::kRead) {
    if (!read_[object].has_since(ended.at - ended.took, bytes))
      broken("what is read is in the node", "it was not: " + base::hex(bytes, " "));
    return;
  }
  const bool may_be_gone = servers_[{ended.network, ended.node}].booted > ended.at;
  if (ended.service != journal::Service::kWrite || may_be_gone || is_command(object) ||
      std::ranges::equal(value_of(object), bytes))
    return;
  if (parts_.baseline == nullptr)
    record_.changing.insert(object);
  else if (!parts_.baseline->changing.contains(object))
    broken("what is written is in the node", "it is not: " + base::hex(bytes, " "));
}

void Judge::check_downloads() {
  for (auto& [object, more] : downloads_) {
    if (more <= 0) continue;
    more = 0;
    if (parts_.baseline == nullptr)
      record_.unrequested.insert(object);
    else if (!parts_.values_may_differ && !parts_.baseline->unrequested.contains(object))
      broken("each download has been requested",
             fmt::format("node {} got one more of {:04X}h:{}", std::get<1>(object), std::get<2>(object),
                         std::get<3>(object)));
  }
}

/// Each silence of a PLC is judged once: another node may start the own one again.
void Judge::check_own_nodes() {
  for (std::size_t number = 1; number <= control_.networks(); ++number) {
    const plant::Network& network = control_.network(number);
    const Time timeout = network.module_config().plc_timeout_ms * kMillisecond;
    const Time since = network.plc_heard_at();
    if (timeout == 0 || since == kNever || silent_since_[number - 1] == since ||
        control_.started() + control_.now() <= since + timeout)
      continue;
    silent_since_[number - 1] = since;
    if (network.module()->coprocessor().own_node().state() == nmt::State::kOperational)
      broken("the own node stops when the PLC is silent", "it is Operational after plc_timeout_ms");
  }
}

std::uint64_t Judge::requests() const {
  std::uint64_t all = 0;
  for (std::size_t network = 1; network <= control_.networks(); ++network)
    all += control_.network(network).requests();
  return all;
}

void Judge::check_limits() {
  const Time now = control_.now();
  if (std::exchange(looked_at_, now) != now) requests_before_ = requests();
  if (requests() - requests_before_ > kMostRequestsAtATime)
    broken("the program ends", fmt::format("{} Modbus requests while no time passed", kMostRequestsAtATime));
  if (parts_.baseline == nullptr || has_ended_) return;
  const Time usual = parts_.baseline->duration;  // 0 = not known
  const Time most = parts_.settings.within.value_or(usual != 0 ? 10 * usual + kMinute : kNever);
  if (now > most) broken("the program ends", fmt::format("not within {} s", base::seconds_text(most)));
}

// ---- The end

Result Judge::end(std::optional<int> exit_code) {
  record_.duration = control_.now();
  look();
  has_ended_ = true;
  record_.matches = matches();
  record_.requests = requests();
  const bool gave_up = exit_code == kGaveUpCode;
  if (exit_code.value_or(0) != 0 && !gave_up)
    broken("the exit code is 0 or 75", fmt::format("it is {}", *exit_code));
  if (result_.verdict != Verdict::kBroken) {
    if (gave_up) result_.verdict = Verdict::kGaveUp;
    if (gave_up && parts_.must_survive) broken("survive", "it gave up");
    parts_.pass(parts_.settings.settle.value_or(kSettle));
    look();
    check(gave_up ? gave_up_ : done_, gave_up ? "gave_up" : "done");
  }
  if (result_.verdict != Verdict::kBroken) check_nodes();
  if (result_.verdict == Verdict::kBroken && exit_code == 0 && requests_at_fault_ == requests())
    result_.verdict = Verdict::kLate;
  result_.duration = record_.duration;
  return result_;
}

void Judge::check_nodes() {
  const auto execute = [this](const std::string& line) {
    control_.execute(line, control_.started() + control_.now());
  };
  execute("clear");
  parts_.pass(kRest);
  for (std::size_t network = 1; network <= control_.networks(); ++network)
    execute(fmt::format("nmt preop {}all", plant::prefix_of(network)));  // a stopped one cannot be read
  parts_.pass(kSecond);
  for (const std::string& node : record_.nodes) {
    const auto [network, id] = plant::where(node, control_.networks());
    const Object any{static_cast<std::uint8_t>(network), base::parse<std::uint8_t>(id).value_or(0), 0, 0};
    const bool expected = parts_.baseline == nullptr || parts_.baseline->readable.contains(node);
    if (!expected || node_of(any) == nullptr) continue;
    execute(fmt::format("trigger {}read {} {} 0 4", plant::prefix_of(network), id, object::kDeviceType));
    for (int i = 0; i < 20 && control_.read(network, regmap::kWindowFirst, 1)[0] == regmap::kExecute; ++i)
      parts_.pass(kSecond);
    const bool good = control_.read(network, regmap::kWindowFirst, 1)[0] == 0;
    if (good)
      record_.readable.insert(node);
    else if (parts_.baseline != nullptr)
      broken("each node can be read at the end", fmt::format("node {} cannot", node));
  }
}

/// The faults that count are in the order of their variants.
void Judge::find_counters() {
  std::map<std::string_view, std::size_t> next;  // of a place
  for (const Variant& variant : parts_.counted) {
    const auto [network, name] = plant::where(variant.place, control_.networks());
    const sim::FaultSet& set = name == "bus"   ? control_.world(network).faults()
                               : name == "plc" ? control_.network(network).plc_faults()
                                               : plant::node_of(control_, variant.place).faults();
    std::size_t& place = next[variant.place];
    const auto list = set.list();
    while (place < list.size() && list[place].fault.after != kCounting - 1)
      ++place;
    counters_.push_back({&set, place < list.size() ? list[place++].number : 0});
  }
}

std::vector<std::uint32_t> Judge::matches() const {
  std::vector<std::uint32_t> counts;
  for (const auto& [set, number] : counters_) {
    const auto found = std::ranges::find(set->list(), number, &sim::SetFault::number);
    counts.push_back(found == set->list().end() ? 0 : static_cast<std::uint32_t>(found->occasions));
  }
  return counts;
}

}  // namespace cbcan::search
