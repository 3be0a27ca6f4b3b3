// SPDX-License-Identifier: MIT
#include "web/api.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "descriptions/values.hpp"
#include "plant/command_words.hpp"
#include "scenario/scenario_writer.hpp"
#include "sim/faults/fault.hpp"
#include "web/state.hpp"
#include "web/streams.hpp"

namespace cbcan::web {

using journal::Event;
using journal::Kind;

namespace {

constexpr std::uint64_t kMostListed = 1000;
constexpr std::string_view kNodes = "/api/nodes/";

/// Types of the page's files.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

protocols::HttpResponse ok(const Json& body) {
  return {.body = line_of(body) + "\n"};
}

protocols::HttpResponse failed(unsigned status, std::string_view why) {
  return {status, "application/json", line_of({{"error", base::to_utf8(why)}}) + "\n"};
}

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
  base::Buffer body;
  base::append(body, '{');
  append_about(body, asked.parts);
  base::append(body, "}\n");
  return {.body = std::string(base::view(body))};
}

/// The named registers, with the scanner window of channel 1 only; or `count` from `first` on.
protocols::HttpResponse registers(const Asked& asked) {
  const Query& query = asked.query();
  plant::Network& network = asked.parts.control.network(asked.network);
  auto words = asked.parts.control.read(asked.network, 0, regmap::kRegisterFileWords);
  const bool all = !query.contains("first");
  const auto first = static_cast<std::size_t>(number_in(query, "first", 0, words.size() - 1));
  const auto end = first + static_cast<std::size_t>(
                               number_in(query, "count", all ? words.size() : 1, words.size() - first));
  auto next = [names = names_in(network.module_config()), words = std::move(words), all, at = first, end,
               mapped = mapped_registers(static_cast<std::uint8_t>(asked.network), network,
                                         asked.parts.find)](base::Buffer& to) mutable {
    while (all && at < end && (names[at].row == nullptr || names[at].channel != 1))
      ++at;
    if (at < end) append_register(to, at, names[at], words[at], mapped);
    return ++at < end;
  };
  return list_of({{"network", asked.network}, {"time", asked.seconds()}}, "registers", std::move(next));
}

protocols::HttpResponse nodes(const Asked& asked) {
  const auto next = [&control = asked.parts.control, network = asked.network,
                     place = std::size_t{0}](base::Buffer& to) mutable {
    const std::size_t count = control.world(network).nodes().size();
    if (place < count) append_node(to, control, network, place);
    return ++place < count;
  };
  return list_of({{"network", asked.network},
                  {"time", asked.seconds()},
                  {"boots", boots_of(asked.parts.control.network(asked.network))}},
                 "nodes", next);
}

/// All its sub-indices.
void append_object(base::Buffer& to, sim::Node& node, const descriptions::Object& object, Time now) {
  std::string_view between;
  for (unsigned number = object.first_sub; number <= object.last_sub; ++number) {
    ObjectEntry entry{};
    const auto sub = static_cast<std::uint8_t>(number);
    if (node.device().dictionary().find(object.index, sub, entry) != AbortCode::kNone) continue;
    const auto bytes = node.value(entry, sub, now);
    base::append(to, std::exchange(between, ","),
                 line_of({{"index", object.index},
                          {"sub", sub},
                          {"name", object.name},
                          {"type", descriptions::name_of(object.type)},
                          {"readable", entry.has(ObjectFlags::kRead)},
                          {"writable", entry.has(ObjectFlags::kWrite)},
                          {"value", journal::value_text(bytes, object.type)},
                          {"bytes", base::hex(bytes, "")}}));
  }
}

protocols::HttpResponse objects(const Asked& asked) {
  const auto next = [&control = asked.parts.control,
                     &node = plant::node_of(asked.parts.control, asked.node_name()),
                     first = number_in(asked.query(), "first", 0, 0xFFFF),
                     last = number_in(asked.query(), "last", 0xFFFF, 0xFFFF),
                     at = std::size_t{0}](base::Buffer& to) mutable {
    const auto& all = node.description().objects;
    while (at < all.size() && (all[at].index < first || all[at].index > last))
      ++at;
    if (at < all.size()) append_object(to, node, all[at], control.started() + control.now());
    return ++at < all.size();
  };
  return list_of({{"node", asked.node_name()}, {"time", asked.seconds()}}, "objects", next);
}

Json points_of(plant::Control& control, const std::string& node) {
  Json list = Json::array();
  for (const auto& [point, object, value, target] : plant::points_of(control, node)) {
    Json& json = list.emplace_back();
    json = {{"kind", sim::name_of(point.kind)}, {"object", object}, {"name", base::to_utf8(point.name)}};
    json["value"] = value;
    if (!point.unit.empty()) json["unit"] = base::to_utf8(point.unit);
    if (target) json["target"] = *target;
    if (point.level) json["level"] = true;
    if (point.low) json["low"] = *point.low;
    if (point.high) json["high"] = *point.high;
    if (point.alarm != 0) json["alarm"] = point.alarm;
    for (const std::string& bit : point.bits)
      json["bits"].push_back(base::to_utf8(bit));
  }
  return list;
}

protocols::HttpResponse points(const Asked& asked) {
  return ok({{"node", asked.node_name()},
             {"time", asked.seconds()},
             {"points", points_of(asked.parts.control, asked.node_name())}});
}

/// Those of all nodes in their order.
protocols::HttpResponse all_points(const Asked& asked) {
  const auto next = [&control = asked.parts.control, network = asked.network,
                     place = std::size_t{0}](base::Buffer& to) mutable {
    const std::size_t count = control.world(network).nodes().size();
    const std::string node = plant::prefix_of(network) + fmt::format("#{}", place + 1);
    if (place < count) base::append(to, line_of(points_of(control, node)));
    return ++place < count;
  };
  return list_of({{"network", asked.network}, {"time", asked.seconds()}}, "nodes", next);
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
  return ok({{"network", asked.network}, {"time", asked.seconds()}, {"advice", list}});
}

/// Words of commands, with what they mean.
protocols::HttpResponse words(const Asked& /*asked*/) {
  Json all;
  const auto add = [&all](const char* list, std::string_view word, std::string_view meaning) {
    all[list].push_back({{"word", word}, {"meaning", meaning}});
  };
  for (const sim::FaultRow& row : sim::fault_rows())
    if (sim::allowed(row.place, sim::FaultPlace::kNode)) add("faults", row.name, row.meaning);
  for (const auto& [verb, meaning] : plant::nmt_verbs())
    add("nmt", verb, meaning);
  for (const plant::Usage& usage : plant::command_usages())
    add("commands", usage.usage, usage.meaning);
  all["kinds"] = journal::kKindNames;
  return ok(all);
}

/// The last `limit` events before number `before`, in their order.
class EventList {
 public:
  EventList(const Asked& asked)
      : journal_(&asked.journal()),
        find_(&asked.parts.find),
        filter_(asked.query(), asked.kinds),
        left_(number_in(asked.query(), "limit", kMostListed, kMostListed)),
        number_(std::min(number_in(asked.query(), "before", journal_->end(), ~0ULL >> 1),
                         journal_->latest_of(filter_.kinds()) + 1)) {}

  /// Events that have been overwritten meanwhile are left out.
  bool append(base::Buffer& to) {
    if (!search()) return true;
    while (!found_.empty() && found_.back() < journal_->first())
      found_.pop_back();
    if (found_.empty()) return false;
    append_event(to, found_.back(), (*journal_)[found_.back()], *journal_, *find_);
    found_.pop_back();
    return !found_.empty();
  }

 private:
  /// True: all have been found.
  bool search() {
    constexpr unsigned kMost = 4000;
    for (unsigned looked = 0; looked < kMost && left_ != 0 && number_ > journal_->first(); ++looked) {
      const Event& event = (*journal_)[--number_];
      const bool is_kind = (journal::kinds_of({event.kind}) & filter_.kinds()) != 0;
      if (is_kind && filter_.passes(event)) {
        found_.push_back(number_);
        --left_;
      }
      if (filter_.begins_after(event)) left_ = 0;
    }
    return left_ == 0 || number_ <= journal_->first();
  }

  const journal::Journal* journal_;
  const journal::FindName* find_;
  EventFilter filter_;
  std::uint64_t left_;    ///< that may still be found
  std::uint64_t number_;  ///< of the event after those to be searched
  std::vector<std::uint64_t> found_;
};

protocols::HttpResponse events(const Asked& asked) {
  const journal::Journal& journal = asked.journal();
  return list_of({{"first_event", journal.first()}, {"next_event", journal.end()}}, "events",
                 [list = EventList(asked)](base::Buffer& to) mutable { return list.append(to); });
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
          .stream = std::make_unique<EventStream>(asked.parts, asked.texts, query, next)};
}

protocols::HttpResponse last_minute(const Asked& asked) {
  const ApiParts& parts = asked.parts;
  return {.type = "application/toml",
          .stream = std::make_unique<Answer>(
              [text = scenario::LastMinute(parts.control, parts.find, parts.about()["plant"])](
                  base::Buffer& to) mutable { return text.append(to); })};
}

protocols::HttpResponse wires(const Asked& asked) {
  return {.body = asked.parts.wires};
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
      .body = std::string(file->text),
      .closes = true};
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
    {"/api/points", all_points},
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
