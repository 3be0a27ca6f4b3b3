// SPDX-License-Identifier: MIT
#include "web/event_json.hpp"

#include <algorithm>

#include "eds/emergency.hpp"
#include "journal/watch.hpp"
#include "plant/words.hpp"
#include "sim/frame_text.hpp"
#include "text/numbers.hpp"
#include "text/words.hpp"

namespace cbcan::web {

using journal::Event;
using journal::Kind;

namespace {

void add_modbus(Json& json, const Event& event, const journal::Journal& journal) {
  json["unit"] = event.node;
  json["client"] = event.code;
  json["exception"] = event.state;
  json["words"] = journal::modbus_text(event, journal);
  const auto all = journal.bytes(event);
  if (all.empty()) return;
  json["function"] = all[0];
  json["request"] = text::hex(all.first(event.index), "");
  json["response"] = text::hex(all.subspan(event.index), "");
}

void add_transaction(Json& json, const Event& event, const journal::Journal& journal,
                     const journal::FindName& find) {
  const eds::ObjectName* const name = find(event.network, event.node, event.index, event.sub);
  const auto bytes = journal.bytes(event);
  json["service"] = journal::name_of(event.service);
  json["node"] = event.node;
  json["index"] = event.index;
  json["sub"] = event.sub;
  json["name"] = name == nullptr ? "" : name->name;
  json["words"] = journal::request_text(event, journal, find);
  json["bytes"] = text::hex(bytes, "");
  json["value"] = bytes.empty() ? "" : journal::value_text(bytes, name);
  if (event.kind == Kind::kBegun) return;
  json["ok"] = !failed(event);
  json["result"] = journal::is_cancelled(event) ? -1 : int{event.result};
  json["code"] = event.code;
  json["outcome"] = journal::result_text(event);
  json["took_ms"] = static_cast<double>(event.took) / kMillisecond;
}

void add_emergency(Json& json, const Event& event) {
  const auto message = eds::emergency_from(event.frame.data);
  json["node"] = event.node;
  json["code"] = message.code;
  json["words"] = eds::emergency_meaning(message.code);
  json["error_register"] = message.error_register;
  json["info"] = text::hex(message.info, "");
}

}  // namespace

std::uint64_t number_in(const Query& query, std::string_view key, std::uint64_t standard,
                        std::uint64_t highest, std::uint64_t lowest) {
  const auto found = query.find(key);
  if (found == query.end()) return standard;
  const auto number = text::parse_integer(found->second);
  if (!number || *number < 0 || static_cast<std::uint64_t>(*number) < lowest ||
      static_cast<std::uint64_t>(*number) > highest)
    plant::refuse("{}={}: must be {}..{}", key, found->second, lowest, highest);
  return static_cast<std::uint64_t>(*number);
}

EventFilter::EventFilter(const Query& query, journal::Kinds standard)
    : network_(number_in(query, "network", 0, 247)),
      node_(number_in(query, "node", 0, 127)),
      transaction_(number_in(query, "transaction", 0, 0xFFFFFFFF)),
      failed_(number_in(query, "failed", 0, 1) != 0) {
  constexpr std::uint64_t kMostMs = 1'000'000'000;
  if (query.contains("slow")) slow_ = kMillisecond * number_in(query, "slow", 0, kMostMs);
  if (const auto found = query.find("service"); found != query.end()) service_ = found->second;
  const auto found = query.find("kinds");
  std::string_view rest = found == query.end() ? "" : std::string_view(found->second);
  kinds_ = rest.empty() ? standard : 0;
  while (!rest.empty()) {
    const std::string_view name = text::take_part(rest, ',');
    const auto names = journal::kind_names();
    const auto kind = std::ranges::find(names, name);
    if (kind == names.end()) plant::refuse("kinds={}: must be {}", name, text::listed(names, " and "));
    kinds_ |= 1U << (kind - names.begin());
  }
  if (failed_ || slow_) kinds_ &= journal::kinds_of({Kind::kEnded});
}

bool EventFilter::passes(const Event& event) const {
  if ((kinds_ & journal::kinds_of({event.kind})) == 0) return false;
  if (network_ != 0 && event.network != network_) return false;
  if (transaction_ != 0 && event.transaction != transaction_) return false;
  if (node_ != 0 && (event.node != node_ || event.kind == Kind::kModbus)) return false;
  if (!service_.empty() && journal::name_of(event.service) != service_) return false;
  return (!failed_ || failed(event)) && (!slow_ || event.took >= *slow_);
}

Json event_json(std::uint64_t number, const Event& event, const journal::Journal& journal,
                const journal::FindName& find) {
  Json json{{"number", number}, {"time", seconds_of(event.at)}};
  if (event.network != 0) json["network"] = event.network;
  json["kind"] = journal::kind_names()[static_cast<std::size_t>(event.kind)];
  if (event.transaction != 0) json["transaction"] = event.transaction;
  json["text"] = journal::text_of(event, journal, find);
  switch (event.kind) {
    case Kind::kModbus: add_modbus(json, event, journal); break;
    case Kind::kBegun:
    case Kind::kEnded: add_transaction(json, event, journal, find); break;
    case Kind::kFrame:
      json["frame"] = sim::frame_text(event.frame);
      if (event.node != 0) json["node"] = event.node;
      json["words"] = journal::frame_text(event.frame, event.network, find);
      break;
    case Kind::kEmergency: add_emergency(json, event); break;
    case Kind::kState:
      json["node"] = event.node;
      json["state"] = journal::state_text(event.state);
      break;
    case Kind::kTerminals:
      json["node"] = event.node;
      json["index"] = event.index;
      json["sub"] = event.sub;
      json["value"] = static_cast<std::int32_t>(event.code);
      json["words"] = journal::terminals_text(event);
      break;
    case Kind::kFault: json["node"] = event.node; [[fallthrough]];
    case Kind::kCommand:
      json["words"] = journal.text(event);
      if (event.state == journal::kRefused) json["refused"] = true;
      break;
    case Kind::kClient:
      json["client"] = event.code;
      json["address"] = journal.text(event);
      json["joined"] = event.state != 0;
      break;
  }
  return json;
}

double seconds_of(Time time) {
  return static_cast<double>(time) / kSecond;
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cbcan::web
