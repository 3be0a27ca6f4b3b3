// SPDX-License-Identifier: MIT
#include "web/api.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/numbers.hpp"
#include "base/utf8.hpp"
#include "base/words.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/version.hpp"
#include "descriptions/boot_failure.hpp"
#include "descriptions/emergency.hpp"
#include "descriptions/values.hpp"
#include "plant/points.hpp"
#include "scenario/scenario_writer.hpp"
#include "sim/faults/fault.hpp"
#include "web/mapped.hpp"
#include "web/page.hpp"

namespace cbcan::web {

using journal::Event;
using journal::Kind;

namespace {

constexpr std::uint64_t kMostListed = 1000;
constexpr std::string_view kNodes = "/api/nodes/";
constexpr std::uint16_t kStatusword = 0x6041;
constexpr std::uint16_t kModeDisplay = 0x6061;  // a drive has it; a valve has a 6041h of its own

/// Types of the page's files.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

struct NamedRegister {
  const regmap::RegisterRow* row = nullptr;  ///< null: without a name
  unsigned channel = 1;                      ///< whose scanner window it is in
};

/// Takes account of the ranges that the configuration has moved.
NamedRegister name_of(std::size_t address, const config::ModuleConfig& module) {
  NamedRegister named;
  const auto look = [&](const auto& rows, std::size_t first, std::size_t words, std::size_t standard,
                        unsigned channel = 1) {
    if (named.row != nullptr || address < first || address >= first + words) return;
    const auto row = std::ranges::find_if(rows, [at = address - first + standard](const auto& each) {
      return each.first <= at && at <= each.last;
    });
    if (row != rows.end()) named = {&*row, channel};
  };
  look(regmap::kWindow, regmap::kWindowFirst, regmap::kWindowWords, regmap::kWindowFirst);
  look(regmap::kProcessData, module.process_first, regmap::kProcessWords, regmap::kProcessFirst);
  look(regmap::kStatus, module.status_first, regmap::kStatusWords, regmap::kStatusFirst);
  for (unsigned channel = 1; channel <= module.channels; ++channel) {
    look(regmap::kScanner, regmap::of_channel(module.scanner_out_first, channel), regmap::kScannerOutWords,
         regmap::kScannerOutFirst, channel);
    look(regmap::kScanner, regmap::of_channel(module.scanner_in_first, channel), regmap::kScannerInWords,
         regmap::kScannerInFirst, channel);
  }
  return named;
}

/// The bits that are set.
std::string status_text(std::uint16_t word) {
  std::string text;
  for (const regmap::NamedNumber& bit : regmap::kStatusBits)
    if ((word >> bit.value & 1) != 0) text += (text.empty() ? "" : "; ") + std::string(bit.meaning);
  return text;
}

/// NMT state in the low byte, step of the boot in the high byte; a letter is a failure.
std::string node_status_text(std::uint16_t word) {
  const std::string_view state = regmap::meaning_of(regmap::kNodeStates, word & 0xFF, "no state");
  return word == 0 ? "" : fmt::format("{}, {}", state, descriptions::boot_step_text(word >> 8));
}

/// The meaning of a value in one of the named registers; empty = it is a number.
std::string meaning_of(const regmap::RegisterRow* row, std::uint16_t word) {
  if (row == nullptr) return {};
  if (row->name == "EXECUTE_FLAG")
    return std::string(word == regmap::kExecute ? "execute" : regmap::meaning_of(regmap::kResults, word));
  if (row->name == "IN_RESULT")
    return std::string(word < 5 ? regmap::meaning_of(regmap::kResults, word)
                                : regmap::meaning_of(regmap::kScannerResults, word));
  if (row->name == "STATUS") return status_text(word);
  if (row->name == "NODE_STATUS") return node_status_text(word);
  return std::string(row->name.ends_with("COMMAND") ? regmap::meaning_of(regmap::kCommands, word) : "");
}

protocols::HttpResponse ok(const Json& json) {
  return {.body = line_of(json) + "\n"};
}

protocols::HttpResponse failed(unsigned status, std::string_view why) {
  return {status, "application/json", line_of({{"error", base::to_utf8(why)}}) + "\n"};
}

/// Server-sent events from a number on that match the query, and the values that it watches.
class EventStream final : public protocols::HttpStream {
 public:
  EventStream(plant::Control& control, EventTexts& texts, const Query& query, std::uint64_t next)
      : control_(control), texts_(texts), filter_(query), cursor_(control.journal(), next, filter_.kinds()) {
    const auto found = query.find("watch");
    std::string_view rest = found == query.end() ? "" : std::string_view(found->second);
    while (!rest.empty())
      watch(base::take_part(rest, ','));
  }

  bool fill(base::Buffer& to) override {
    if (!std::exchange(begun_, true)) base::append(to, ": cbcan\n\n");
    const std::uint64_t missed = cursor_.look([&](std::uint64_t number, const Event& event) {
      if (filter_.passes(event)) base::append(to, texts_.of(number));
      return to.size() < kMostUnsent;
    });
    if (missed != 0) append_data(to, {{"kind", "missed"}, {"events", missed}});
    for (Watched& watched : watched_)
      tell(watched, to);
    return true;
  }
  bool has_news() const override { return !begun_ || !watched_.empty() || cursor_.has_news(); }
  std::string_view keep_alive() const override { return ":\n\n"; }

 private:
  struct Watched {
    std::string node;
    std::string object;
    std::string value{};
  };

  /// "16:0x6064:0", on network 2 "2/16:0x6064"
  void watch(std::string_view word) {
    constexpr std::size_t kMostWatched = 16;
    const auto sides = base::split(word, ':');
    if (!sides || watched_.size() == kMostWatched)
      plant::refuse("watch={}: write NODE:INDEX[:SUB], {} of them at most", word, kMostWatched);
    watched_.push_back({std::string(sides->first), std::string(sides->second)});
    plant::check_value(control_, watched_.back().node, watched_.back().object);
  }

  static void append_data(base::Buffer& to, const Json& json) {
    base::append(to, "data: ", line_of(json), "\n\n");
  }

  void tell(Watched& watched, base::Buffer& to) const {
    const bool runs = plant::node_of(control_, watched.node).has_power();
    std::string value = runs ? plant::value_of(control_, watched.node, watched.object) : "off";
    if (value == watched.value) return;
    watched.value = std::move(value);
    append_data(to, {{"kind", "value"},
                     {"time", seconds_of(control_.now())},
                     {"node", watched.node},
                     {"object", watched.object},
                     {"value", watched.value}});
  }

  plant::Control& control_;
  EventTexts& texts_;
  EventFilter filter_;
  journal::Cursor cursor_;
  std::vector<Watched> watched_;
  bool begun_ = false;
};

/// Executes lines one after the other; each waits for the response to the one before.
class CommandStream final : public protocols::HttpStream {
 public:
  CommandStream(protocols::Execute execute, std::string body)
      : execute_(std::move(execute)), body_(std::move(body)) {}

  bool fill(base::Buffer& to) override {
    base::append(to, std::exchange(dialogue_->unsent, {}));
    while (!dialogue_->waiting && begun_ < body_.size() && to.size() < kMostUnsent) {
      std::string_view rest = std::string_view(body_).substr(begun_);
      const std::string_view line = base::trim(base::take_line(rest));
      begun_ = body_.size() - rest.size();
      if (line.size() > protocols::kLongestCommand)
        base::append(to, "error: a line of more than ", protocols::kLongestCommand, " characters\n");
      else if (!line.empty())
        base::append(to, execute_(line, dialogue_));
    }
    return dialogue_->waiting || begun_ < body_.size();
  }
  bool has_news() const override { return !dialogue_->waiting || !dialogue_->unsent.empty(); }

 private:
  protocols::Execute execute_;
  std::string body_;
  std::size_t begun_ = 0;
  std::shared_ptr<protocols::Dialogue> dialogue_ = std::make_shared<protocols::Dialogue>();
};

// ---- Resources

/// A request of which the path is known.
struct Asked {
  const ApiParts& parts;
  EventTexts& texts;
  const protocols::HttpRequest& request;
  std::size_t network;
  std::string_view node{};  ///< in the path: "66" in "/api/nodes/66/objects"
  journal::Kinds kinds{};   ///< of the route

  const Query& query() const { return request.query; }
  const journal::Journal& journal() const { return parts.control.journal(); }
  double seconds() const { return seconds_of(parts.control.now()); }
  std::string node_name() const { return plant::prefix_of(network).append(node); }
};

protocols::HttpResponse time(const Asked& asked) {
  plant::Control& control = asked.parts.control;
  Json json = asked.parts.about();
  json["time"] = asked.seconds();
  json["version"] = kVersion;
  json["first_event"] = asked.journal().first();
  json["next_event"] = asked.journal().end();
  Json& networks = json["networks"] = Json::array();
  for (std::size_t number = 1; number <= control.networks(); ++number) {
    plant::Network& network = control.network(number);
    networks.push_back({{"network", number},
                        {"bit_rate", network.world().bus().bit_rate()},
                        {"frames", network.watch()->frames()},
                        {"bits", network.watch()->bits()},
                        {"second_writers", network.second_writers()}});
  }
  return ok(json);
}

/// The named registers, with the scanner window of channel 1 only; or `count` from `first` on.
protocols::HttpResponse registers(const Asked& asked) {
  const Query& query = asked.query();
  plant::Network& network = asked.parts.control.network(asked.network);
  const auto words = asked.parts.control.read(asked.network, 0, regmap::kRegisterFileWords);
  const bool all = !query.contains("first");
  const auto first = static_cast<std::size_t>(number_in(query, "first", 0, words.size() - 1));
  const auto count =
      static_cast<std::size_t>(number_in(query, "count", all ? words.size() : 1, words.size() - first));
  const auto mapped = mapped_registers(static_cast<std::uint8_t>(asked.network), network, asked.parts.find);
  Json list = Json::array();
  for (std::size_t address = first; address < first + count; ++address) {
    const auto [row, channel] = name_of(address, network.module_config());
    if (all && (row == nullptr || channel != 1)) continue;
    Json json{{"register", address}, {"name", row == nullptr ? "" : row->name}, {"value", words[address]}};
    if (channel != 1) json["channel"] = channel;
    if (std::string meaning = meaning_of(row, words[address]); !meaning.empty())
      json["words"] = std::move(meaning);
    if (const auto found = mapped.find(address); found != mapped.end()) json["mapped"] = found->second;
    list.push_back(std::move(json));
  }
  return ok({{"network", asked.network}, {"time", asked.seconds()}, {"registers", std::move(list)}});
}

Json node_at(const Asked& asked, std::size_t place) {
  plant::Control& control = asked.parts.control;
  sim::Node& node = *control.world(asked.network).nodes()[place];
  const journal::NetworkWatch& watch = *control.network(asked.network).watch();
  const std::uint8_t id = node.device().node_id();
  Json json{{"place", place + 1}, {"node", id == sim::Node::kNoNodeId ? 0 : id}};
  json["name"] = base::to_utf8(node.name());
  json["device"] = node.device_name();
  json["state"] = plant::state_of(node);
  json["incidents"] = node.behaviour().incidents();
  json["faults"] = Json::array();
  for (const sim::SetFault& fault : node.faults().list())
    json["faults"].push_back({{"number", fault.number},
                              {"fault", fault.text},
                              {"occasions", fault.occasions},
                              {"fired", fault.fired}});
  if (id == sim::Node::kNoNodeId) return json;
  if (const Time heard = watch.heard_at(id); heard != kNever) json["heard"] = seconds_of(heard);
  if (const auto message = journal::emergency_of(watch.last_emergency(id)))
    json["emergency"] = {{"code", message->code},
                         {"words", descriptions::emergency_meaning(message->code)},
                         {"error_register", message->error_register}};
  const auto has = [&node](std::uint16_t index) {
    ObjectEntry entry{};
    return node.device().dictionary().find(index, 0, entry) == AbortCode::kNone;
  };
  if (has(kStatusword) && has(kModeDisplay)) {
    node.bring_up_to_date(control.started() + control.now());
    json["statusword"] = node.device().dictionary().get(kStatusword, 0);
  }
  return json;
}

protocols::HttpResponse nodes(const Asked& asked) {
  Json list = Json::array();
  for (std::size_t place = 0; place < asked.parts.control.world(asked.network).nodes().size(); ++place)
    list.push_back(node_at(asked, place));
  return ok(
      {{"network", asked.network},
       {"time", asked.seconds()},
       {"nodes", std::move(list)},
       {"boots", boots_of(asked.parts.control.network(asked.network), asked.journal(), asked.parts.find)}});
}

protocols::HttpResponse objects(const Asked& asked) {
  plant::Control& control = asked.parts.control;
  sim::Node& node = plant::node_of(control, asked.node_name());
  const std::uint64_t first = number_in(asked.query(), "first", 0, 0xFFFF);
  const std::uint64_t last = number_in(asked.query(), "last", 0xFFFF, 0xFFFF);
  const Time now = control.started() + control.now();
  Json list = Json::array();
  for (const descriptions::Object& object : node.description().objects)
    for (unsigned sub = object.first_sub; sub <= object.last_sub; ++sub) {
      ObjectEntry entry{};
      const auto sub_index = static_cast<std::uint8_t>(sub);
      if (object.index < first || object.index > last ||
          node.device().dictionary().find(object.index, sub_index, entry) != AbortCode::kNone)
        continue;
      const auto bytes = node.value(entry, sub_index, now);
      list.push_back({{"index", object.index},
                      {"sub", sub},
                      {"name", object.name},
                      {"type", descriptions::name_of(object.type)},
                      {"readable", entry.has(ObjectFlags::kRead)},
                      {"writable", entry.has(ObjectFlags::kWrite)},
                      {"value", journal::value_text(bytes, object.type)},
                      {"bytes", base::hex(bytes, "")}});
    }
  return ok({{"node", asked.node_name()}, {"time", asked.seconds()}, {"objects", std::move(list)}});
}

protocols::HttpResponse points(const Asked& asked) {
  Json list = Json::array();
  for (auto& [point, object, value, target] : plant::points_of(asked.parts.control, asked.node_name())) {
    Json json{{"kind", sim::name_of(point.kind)},
              {"object", object},
              {"name", base::to_utf8(point.name)},
              {"value", value}};
    if (!point.unit.empty()) json["unit"] = base::to_utf8(point.unit);
    if (target) json["target"] = *target;
    if (point.level) json["level"] = true;
    if (point.low) json["low"] = *point.low;
    if (point.high) json["high"] = *point.high;
    for (const std::string& bit : point.bits)
      json["bits"].push_back(base::to_utf8(bit));
    list.push_back(std::move(json));
  }
  return ok({{"node", asked.node_name()}, {"time", asked.seconds()}, {"points", std::move(list)}});
}

/// Mistakes of the PLC's program.
protocols::HttpResponse advice(const Asked& asked) {
  Json list = Json::array();
  for (const journal::Advice& advice : asked.parts.control.network(asked.network).advice())
    list.push_back({{"rule", name_of(advice.mistake)},
                    {"client", advice.client},
                    {"count", advice.count},
                    {"last", seconds_of(advice.last)},
                    {"number", advice.number},
                    {"transaction", advice.event.transaction},
                    {"node", advice.event.node},
                    {"words", advice.words}});
  return ok({{"network", asked.network}, {"time", asked.seconds()}, {"advice", std::move(list)}});
}

/// Words of commands, with what they mean.
protocols::HttpResponse words(const Asked& /*asked*/) {
  Json json{{"faults", Json::array()},
            {"nmt", Json::array()},
            {"commands", Json::array()},
            {"kinds", journal::kKindNames}};
  for (const sim::FaultRow& row : sim::fault_rows())
    if (sim::allowed(row.place, sim::FaultPlace::kNode))
      json["faults"].push_back({{"word", row.name}, {"meaning", row.meaning}});
  for (const auto& [verb, meaning] : plant::nmt_verbs())
    json["nmt"].push_back({{"word", verb}, {"meaning", meaning}});
  for (const plant::Usage& usage : plant::command_usages())
    json["commands"].push_back({{"word", usage.usage}, {"meaning", usage.meaning}});
  return ok(json);
}

/// The last `limit` events before number `before`, in their order.
protocols::HttpResponse events(const Asked& asked) {
  const Query& query = asked.query();
  const EventFilter filter(query, asked.kinds);
  const journal::Journal& journal = asked.journal();
  const std::uint64_t limit = number_in(query, "limit", kMostListed, kMostListed);
  std::vector<std::uint64_t> found;
  std::uint64_t number = std::min(number_in(query, "before", journal.end(), ~0ULL >> 1), journal.end());
  while (number-- > journal.first() && found.size() < limit) {
    const Event& event = journal[number];
    const bool is_kind = (journal::kinds_of({event.kind}) & filter.kinds()) != 0;
    if (is_kind && filter.passes(event)) found.push_back(number);
  }
  base::Buffer body;
  base::append(body, "{\"first_event\":", journal.first(), ",\"next_event\":", journal.end(),
               ",\"events\":[");
  for (; !found.empty(); found.pop_back()) {
    append_event(body, found.back(), journal[found.back()], journal, asked.parts.find);
    base::append(body, found.size() == 1 ? "" : ",");
  }
  base::append(body, "]}\n");
  return {.body = std::string(base::view(body))};
}

/// Streams from `since` on, or from the last event that an EventSource has seen; numbers above the last event
/// are from an earlier run of the program.
protocols::HttpResponse follow(const Asked& asked) {
  const journal::Journal& journal = asked.journal();
  Query query = asked.query();
  if (!asked.request.last_event_id.empty()) query["since"] = asked.request.last_event_id;
  const bool again = query.contains("since");
  const std::uint64_t since = number_in(query, "since", 0, ~0ULL >> 1);
  const std::uint64_t next =
      !again || since >= journal.end() ? (again ? journal.first() : journal.end()) : since + 1;
  return {.type = "text/event-stream",
          .stream = std::make_unique<EventStream>(asked.parts.control, asked.texts, query, next)};
}

protocols::HttpResponse last_minute(const Asked& asked) {
  const ApiParts& parts = asked.parts;
  return {.type = "application/toml",
          .body = scenario::scenario_of_last_minute(parts.control, parts.find, parts.about()["plant"])};
}

protocols::HttpResponse wires(const Asked& asked) {
  return ok({{"wires", asked.parts.wires()}});
}

/// The page's file at `path`, such as "/" or "/page.js"; nullopt if there is no such file.
std::optional<protocols::HttpResponse> page_at(std::string_view path) {
  const std::string_view name =
      path == "/" ? "index.html" : path.substr(std::min<std::size_t>(1, path.size()));
  const auto file = std::ranges::find(page_files(), name, &config::EmbeddedFile::name);
  if (file == page_files().end()) return std::nullopt;
  const auto type = std::ranges::find_if(kTypes, [&](const auto& row) { return name.ends_with(row.first); });
  return protocols::HttpResponse{
      .type = std::string(type == kTypes.end() ? "text/plain; charset=utf-8" : type->second),
      .body = std::string(file->text)};
}

struct Route {
  std::string_view path;  ///< with * for a node
  protocols::HttpResponse (*respond)(const Asked& asked);
  journal::Kinds kinds = journal::kAllKinds;
};

constexpr Route kRoutes[] = {
    {"/api/time", time},
    {"/api/registers", registers},
    {"/api/nodes", nodes},
    {"/api/nodes/*/objects", objects},
    {"/api/nodes/*/points", points},
    {"/api/scenario", last_minute},
    {"/api/transactions", events, journal::kinds_of({Kind::kEnded})},
    {"/api/frames", events, journal::kinds_of({Kind::kFrame})},
    {"/api/journal", events},
    {"/api/events", follow},
    {"/api/advice", advice},
    {"/api/words", words},
    {"/api/wires", wires},
};

protocols::HttpResponse respond(const ApiParts& parts, EventTexts& texts,
                                const protocols::HttpRequest& request) {
  parts.advance();
  try {
    if (request.method == "POST" && request.path != "/api/control")
      return failed(404, "POST is for /api/control; its command `write` writes registers");
    if (request.method == "POST")
      return {.type = "text/plain; charset=utf-8",
              .stream = std::make_unique<CommandStream>(parts.execute, request.body)};
    if (auto page = page_at(request.path)) return std::move(*page);
    const auto network = number_in(request.query, "network", 1, parts.control.networks(), 1);
    Asked asked{parts, texts, request, static_cast<std::size_t>(network)};
    std::string path = request.path;
    if (const std::size_t end = path.rfind('/'); path.starts_with(kNodes) && end > kNodes.size()) {
      asked.node = std::string_view(request.path).substr(kNodes.size(), end - kNodes.size());
      path.replace(kNodes.size(), asked.node.size(), "*");
    }
    const auto route = std::ranges::find(kRoutes, path, &Route::path);
    if (route == std::end(kRoutes)) return failed(404, "no such resource; docs/reference/http.md lists them");
    asked.kinds = route->kinds;
    return route->respond(asked);
  } catch (const plant::Refused& refused) {
    return failed(400, refused.what());
  }
}

}  // namespace

protocols::HttpSite::Handler api_of(ApiParts parts) {
  const auto texts = std::make_shared<EventTexts>(parts.control.journal(), parts.find);
  return [parts = std::move(parts), texts](const protocols::HttpRequest& request) {
    return respond(parts, *texts, request);
  };
}

}  // namespace cbcan::web
