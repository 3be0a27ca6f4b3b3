// SPDX-License-Identifier: MIT
#include "scenario/search/rules.hpp"

#include <fmt/core.h>

#include <array>
#include <map>
#include <set>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::search {

namespace {

using journal::Event;
using journal::Service;

Object object_of(const Event& event) {
  return {event.network, event.node, event.index, event.sub};
}

NodePlace place_of(const Event& event) {
  return {event.network, event.node};
}

/// 0 = it has none.
std::uint8_t own_node(const plant::Network& network) {
  return network.module() == nullptr ? std::uint8_t{0} : network.module()->coprocessor().own_node().node_id();
}

bool begins(const BusFrame& seen, sdo::Request request) {
  return seen.is(sdo::kRequestId) && seen.frame.length == 8 && sdo::is(seen.frame.data[0], request);
}

/// One of a block transfer.
bool initiates(const BusFrame& seen) {
  return sdo::block_step(seen.frame.data[0]) == sdo::BlockStep::kInitiate;
}

/// A transfer of this kind whose value can be compared with the node's.
bool is_comparable(const JudgedRun& run, const Event& ended, Service service) {
  return ended.service == service && ended.result == 0 && !run.trial.values_may_differ &&
         run.node_of(object_of(ended)) != nullptr;
}

/// A value that was read is one that the node had when the request came.
struct ReadValue final : Rule {
  void on_frame(JudgedRun& run, const BusFrame& seen) override {
    const bool uploads = begins(seen, sdo::Request::kInitiateUpload) ||
                         (begins(seen, sdo::Request::kBlockUpload) && initiates(seen));
    if (const auto value = uploads ? run.value_of(seen.object()) : std::nullopt)
      values[seen.object()].add(seen.at, *value);
  }
  void on_ended(JudgedRun& run, const Event& ended) override {
    const auto bytes = run.journal.bytes(ended);
    if (is_comparable(run, ended, Service::kRead) &&
        !values[object_of(ended)].has_since(ended.at - ended.took, bytes))
      run.broken("what is read is in the node", "it was not: " + base::hex(bytes, " "));
  }

  std::map<Object, ValuesSeen> values;
};

/// A value that was written is in the node, unless the node has started since.
struct WrittenValue final : Rule {
  void on_frame(JudgedRun& /*run*/, const BusFrame& seen) override {
    if (seen.is_boot_up()) booted[seen.place()] = seen.at;
  }
  void on_ended(JudgedRun& run, const Event& ended) override {
    const bool is_command = ended.index == object::kStore || ended.index == object::kRestore;
    if (is_command || booted[place_of(ended)] > ended.at || !is_comparable(run, ended, Service::kWrite))
      return;
    const auto bytes = run.journal.bytes(ended);
    if (!std::ranges::equal(*run.value_of(object_of(ended)), bytes) &&
        run.is_new(&Record::changing, object_of(ended)))
      run.broken("what is written is in the node", "it is not: " + base::hex(bytes, " "));
  }

  std::map<NodePlace, Time> booted;
};

/// A response that is wrong in a detectable way, such as a toggle bit, does not end in result 0.
struct WrongResponse final : Rule {
  void on_fault(JudgedRun& run, const Event& fault) override {
    constexpr std::array<std::string_view, 4> kKinds{": response-other-toggle ", ": response-other-crc ",
                                                     ": abort ", ": refuse "};
    const std::string_view message = run.journal.text(fault);
    if (std::ranges::any_of(kKinds, [=](auto kind) { return message.find(kind) != message.npos; }))
      must_fail.insert(fault.transaction);
  }
  void on_ended(JudgedRun& run, const Event& ended) override {
    if (must_fail.erase(ended.transaction) != 0 && ended.result == 0)
      run.broken("a wrong response is noticed", "result 0");
  }

  std::set<std::uint32_t> must_fail;  ///< transactions
};

/// A transaction ends within the timeout after each response, and the quarantine.
struct EndsInTime final : Rule {
  void on_frame(JudgedRun& /*run*/, const BusFrame& seen) override {
    if (seen.is(sdo::kResponseId)) ++responses[seen.place()];
  }
  void on_begun(JudgedRun& /*run*/, const Event& begun) override {
    open[begun.transaction] = responses[place_of(begun)];
  }
  void on_ended(JudgedRun& run, const Event& ended) override {
    const Time timeout = run.control.network(ended.network).module_config().sdo_timeout_ms * kMillisecond;
    const std::uint32_t during = responses[place_of(ended)] - open[ended.transaction];
    const Time limit = (during + 3 + open.size()) * timeout;
    open.erase(ended.transaction);
    if (timeout != 0 && ended.took > limit)
      run.broken("a transaction ends in time",
                 fmt::format("it took {} s, the limit is {} s", base::seconds_text(ended.took),
                             base::seconds_text(limit)));
  }

  std::map<NodePlace, std::uint32_t> responses;
  std::map<std::uint32_t, std::uint32_t> open;  ///< transactions: responses before
};

/// A node gets no more downloads of an object than the PLC has requested.
struct Downloads final : Rule {
  void on_frame(JudgedRun& /*run*/, const BusFrame& seen) override {
    if (begins(seen, sdo::Request::kInitiateDownload)) ++surplus[seen.object()];
  }
  void on_begun(JudgedRun& /*run*/, const Event& begun) override {
    if (begun.service == Service::kWrite) --surplus[object_of(begun)];
  }
  void on_look(JudgedRun& run) override {
    for (auto& [object, count] : surplus) {
      if (count <= 0) continue;
      count = 0;
      if (run.is_new(&Record::unrequested, object) && !run.trial.values_may_differ)
        run.broken("each download has been requested",
                   fmt::format("node {} got one more of {:04X}h:{}", std::get<1>(object), std::get<2>(object),
                               std::get<3>(object)));
    }
  }

  std::map<Object, int> surplus;  ///< on the bus, less those that were requested
};

/// A node that has not responded in time gets no request until it has, or the same time has passed again.
struct Quarantine final : Rule {
  void on_frame(JudgedRun& run, const BusFrame& seen) override {
    const std::uint8_t own = own_node(run.control.network(seen.network));
    if (seen.is_boot_up()) release(seen, own);
    if (seen.is(sdo::kResponseId)) nodes[seen.place()] = {seen.at, 0};
    if (!seen.is(sdo::kRequestId)) return;
    Node& node = nodes[seen.place()];
    const bool aborts = sdo::is(seen.frame.data[0], sdo::Request::kAbort);
    if (aborts && sdo::tail_of(seen.frame) == static_cast<std::uint32_t>(AbortCode::kTimeOut))
      node.left_alone = seen.at + (seen.at - node.active) / 10 * 9;  // frames may have waited for the bus
    else if (!aborts && seen.at < node.left_alone && own != 0)
      run.broken("a node that has not responded in time is left alone",
                 fmt::format("{}{} has a request", plant::prefix_of(seen.network), seen.node()));
    node.active = seen.at;
  }

  /// A boot-up message of the own node ends the quarantine of all.
  void release(const BusFrame& boot_up, std::uint8_t own) {
    for (auto& [place, node] : nodes)
      if (place == boot_up.place() || (place.first == boot_up.network && boot_up.node() == own))
        node.left_alone = 0;
  }

  struct Node {
    Time active = 0;      ///< the last frame of a transfer
    Time left_alone = 0;  ///< a client waits as long as it waited for the response
  };
  std::map<NodePlace, Node> nodes;
};

/// A node that the module starts by itself has confirmed each write of its configuration since its boot-up.
struct Configuration final : Rule {
  void on_frame(JudgedRun& run, const BusFrame& seen) override {
    const Frame& frame = seen.frame;
    if (seen.is_boot_up()) confirmed[seen.place()].clear();
    const bool confirms = sdo::is(frame.data[0], sdo::Response::kInitiateDownload) ||
                          (sdo::is(frame.data[0], sdo::Response::kBlockDownload) && initiates(seen));
    if (seen.is(sdo::kResponseId) && confirms) confirmed[seen.place()].insert(seen.object());
    if (!nmt::is_command(frame) || frame.data[0] != static_cast<std::uint8_t>(nmt::Command::kStart)) return;
    const std::uint8_t started = frame.data[1] & nmt::kMaxNode;
    for (std::uint8_t node = 1; node <= nmt::kMaxNode; ++node)
      if (started == nmt::kAllNodes || started == node) on_started(run, seen.network, node);
  }

  /// A node with a number in 1F26h may have kept its configuration.
  void on_started(JudgedRun& run, std::uint8_t network, std::uint8_t node) {
    const sim::CoprocessorModule* const module = run.control.network(network).module();
    if (module == nullptr) return;
    const Manager& manager = module->coprocessor().manager();
    const ConciseDcf values(manager.object(object::kConciseDcf, node));
    const bool keeps = !manager.object(object::kExpectedDate, node).empty();
    if (manager.phase(node) != Manager::Phase::kStart || keeps || !values.is_valid()) return;
    for (std::size_t at = ConciseDcf::kFirst; at != values.size(); at = values.after(at))
      if (const auto [index, sub, value] = values.at(at);
          !confirmed[{network, node}].contains({network, node, index, sub}))
        run.broken("a node that the module starts has been configured",
                   fmt::format("{}{} has not confirmed {:04X}h:{:02X}", plant::prefix_of(network), node,
                               index, sub));
  }

  std::map<NodePlace, std::set<Object>> confirmed;
};

/// The own node is not Operational beyond module.plc_timeout_ms. Each silence of a PLC is judged once:
/// another node may start the own one again.
struct OwnNode final : Rule {
  void on_look(JudgedRun& run) override {
    const Time now = run.control.started() + run.control.now();
    for (std::size_t number = 1; number <= run.control.networks(); ++number) {
      const plant::Network& network = run.control.network(number);
      const Time timeout = network.module_config().plc_timeout_ms * kMillisecond;
      if (timeout == 0 || network.module() == nullptr) continue;
      const Coprocessor& module = network.module()->coprocessor();
      const Time since = module.plc_heard_at();
      Time& last = judged.try_emplace(number, kNever).first->second;
      const bool judged_before = last == since || since == network.started();
      if (judged_before || now <= since + timeout || module.manager()->active()) continue;
      last = since;
      if (module.own_node().state() == nmt::State::kOperational)
        run.broken("the own node stops when the PLC is silent", "it is Operational after plc_timeout_ms");
    }
  }

  std::map<std::size_t, Time> judged;  ///< by network: the last request before a silence
};

/// The program, or the scenario, ends within the plant's time, and lets time pass.
struct ProgramEnds final : Rule {
  void on_look(JudgedRun& run) override {
    constexpr std::uint64_t kMostRequests = 100'000;
    constexpr Time kMinute = 60 * kSecond;
    const Time now = run.control.now();
    if (std::exchange(looked_at, now) != now) requests_before = run.requests();
    if (run.requests() - requests_before > kMostRequests)
      run.broken("the program ends", fmt::format("{} Modbus requests while no time passed", kMostRequests));
    if (run.trial.baseline == nullptr || run.has_ended) return;
    const Time usual = run.trial.baseline->duration;  // 0 = not known
    const Time most = run.settings.within.value_or(usual != 0 ? 10 * usual + kMinute : kNever);
    if (now > most) run.broken("the program ends", fmt::format("not within {} s", base::seconds_text(most)));
  }

  Time looked_at = 0;
  std::uint64_t requests_before = 0;  ///< looked_at
};

/// Rule: at the end, without faults, each node can be read. If all can at once, there is nothing to wait for.
struct Readable final : Rule {
  void on_settled(JudgedRun& run) override {
    constexpr Time kRest = 3 * kSecond;
    if (!run.is_open() && !unreadable(run)) return;
    execute(run, "clear");
    run.pass(kRest);
    for (std::size_t network = 1; network <= run.control.networks(); ++network)
      execute(run,
              fmt::format("nmt preop {}all", plant::prefix_of(network)));  // a stopped one cannot be read
    run.pass(kSecond);
    if (const auto node = unreadable(run); node && run.trial.baseline != nullptr)
      run.broken("each node can be read at the end", fmt::format("node {} cannot", *node));
  }

  /// The first node that cannot be read, of those with power that the run without faults could read; in that
  /// run, of all.
  static std::optional<std::string> unreadable(JudgedRun& run) {
    const Record* const baseline = run.trial.baseline;
    std::optional<std::string> first;
    for (const std::string& node : run.record.nodes) {
      const auto [network, id] = plant::where(node, run.control.networks());
      const Object any{static_cast<std::uint8_t>(network), base::parse<std::uint8_t>(id).value_or(0), 0, 0};
      const bool expected = baseline == nullptr || baseline->readable.contains(node);
      if (!expected || run.node_of(any) == nullptr) continue;
      if (is_read(run, network, id))
        run.record.readable.insert(node);
      else if (!first)
        first = node;
    }
    return first;
  }
  static void execute(JudgedRun& run, const std::string& line) {
    run.control.execute(line, run.control.started() + run.control.now());
  }
  static bool is_read(JudgedRun& run, std::size_t network, std::string_view id) {
    const auto flag = [&] { return run.control.read(network, regmap::kExecuteFlag, 1)[0]; };
    execute(run, fmt::format("trigger {}read {} {} 0 4", plant::prefix_of(network), id, object::kDeviceType));
    for (Time step = kMillisecond; step < 20 * kSecond && flag() == regmap::kExecute; step *= 2)
      run.pass(step);
    return flag() == 0;
  }
};

template <class... Rules>
std::vector<std::unique_ptr<Rule>> made() {
  std::vector<std::unique_ptr<Rule>> rules;
  (rules.push_back(std::make_unique<Rules>()), ...);
  return rules;
}

}  // namespace

std::vector<std::unique_ptr<Rule>> make_rules() {
  return made<ReadValue, WrittenValue, WrongResponse, EndsInTime, Downloads, Quarantine, Configuration,
              OwnNode, ProgramEnds, Readable>();
}

// ---- The run

void JudgedRun::broken(std::string_view what, std::string seen) {
  if (result.verdict == Verdict::kBroken) return;
  result.verdict = Verdict::kBroken;
  result.what = what;
  result.seen = std::move(seen);
  result.during = during;
  result.request = request;
  result.frames = last_frames.lines("  ");
}

std::uint64_t JudgedRun::requests() const {
  std::uint64_t all = 0;
  for (std::size_t network = 1; network <= control.networks(); ++network)
    all += control.network(network).requests();
  return all;
}

bool JudgedRun::is_new(std::set<Object> Record::*objects, const Object& object) {
  if (trial.baseline != nullptr) return !(trial.baseline->*objects).contains(object);
  (record.*objects).insert(object);
  return false;
}

sim::Node* JudgedRun::node_of(const Object& object) const {
  for (const auto& node : control.world(std::get<0>(object)).nodes())
    if (node->has_power() && node->device().node_id() == std::get<1>(object)) return node.get();
  return nullptr;
}

std::optional<std::vector<std::uint8_t>> JudgedRun::value_of(const Object& object) const {
  const auto [network, id, index, sub] = object;
  sim::Node* const node = node_of(object);
  if (node == nullptr) return std::nullopt;
  ObjectEntry entry{};
  if (node->device().dictionary().find(index, sub, entry) != AbortCode::kNone)
    return std::vector<std::uint8_t>();
  return node->value(entry, sub, control.started() + control.now());
}

}  // namespace cbcan::search
