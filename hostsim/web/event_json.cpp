// SPDX-License-Identifier: MIT
#include "web/api.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/text.hpp"
#include "descriptions/failures.hpp"
#include "journal/watch.hpp"
#include "plant/command_words.hpp"

namespace cbcan::web {

using base::append;
using base::Buffer;
using base::HexBytes;
using namespace std::string_view_literals;
using journal::Event;
using journal::Kind;

namespace {

bool is_special(char c) {
  return static_cast<signed char>(c) < ' ' || c == '"' || c == '\\';
}

/// Neither control characters, quotes and backslashes nor bytes above 7Fh. Looks at 16 characters at a time,
/// and at the end at some again.
bool is_plain(std::string_view text) {
  std::array<std::uint8_t, 16> others{};
  if (text.size() < others.size()) return std::ranges::none_of(text, is_special);
  for (std::size_t at = 0; at < text.size(); at += others.size()) {
    const char* const part = text.data() + std::min(at, text.size() - others.size());
    for (std::size_t i = 0; i < others.size(); ++i)
      others[i] |= static_cast<std::uint8_t>(is_special(part[i]));
  }
  return others == std::array<std::uint8_t, 16>{};
}

/// The parts of a line as they are in JSON strings, kept in `escaped`.
journal::Line escape(journal::Line line, std::array<std::string, 5>& escaped) {
  std::size_t next = 0;
  for (std::string_view* const part : {&line.whole, &line.words, &line.value, &line.outcome, &line.name}) {
    const std::string quoted = line_of(Json(std::string(*part)));
    *part = escaped[next++] = quoted.substr(1, quoted.size() - 2);
  }
  return line;
}

/// Appends seconds with 6 places, or as milliseconds with 3, the way line_of() writes a number.
void append_time(Buffer& to, Time time, unsigned places) {
  constexpr Time kShortest = 100;  // less has an exponent in seconds
  if (places == 6 && time != 0 && time < kShortest) return append(to, seconds_of(time));
  const bool is_whole = time % (places == 6 ? kSecond : kMillisecond) == 0;
  append(to, base::Decimal{time, places}, is_whole ? ".0"sv : ""sv);
}

void add_modbus(Buffer& to, const Event& event, const journal::Journal& journal, std::string_view words) {
  append(to, ",\"unit\":", event.node, ",\"client\":", event.code, ",\"exception\":", event.state,
         ",\"words\":\"", words, '"');
  const auto all = journal.bytes(event);
  if (all.empty()) return;
  append(to, ",\"function\":", all[0], ",\"request\":\"", HexBytes{all.first(event.index)},
         "\",\"response\":\"", HexBytes{all.subspan(event.index)}, '"');
}

void add_transaction(Buffer& to, const Event& event, const journal::Journal& journal,
                     const journal::Line& line) {
  const auto bytes = journal.bytes(event);
  append(to, ",\"service\":\"", journal::name_of(event.service), "\",\"node\":", event.node,
         ",\"index\":", event.index, ",\"sub\":", event.sub, ",\"name\":\"", line.name, "\",\"words\":\"",
         line.words, "\",\"bytes\":\"", HexBytes{bytes}, "\",\"value\":\"", line.value, '"');
  if (event.kind == Kind::kBegun) return;
  append(to, ",\"ok\":", failed(event) ? "false"sv : "true"sv,
         ",\"result\":", journal::is_cancelled(event) ? -1 : int{event.result}, ",\"code\":", event.code,
         ",\"outcome\":\"", line.outcome, "\",\"took_ms\":");
  append_time(to, event.took, 3);
}

void add_emergency(Buffer& to, const Event& event) {
  const auto message = descriptions::emergency_from(event.frame.data);
  append(to, ",\"node\":", event.node, ",\"code\":", message.code, ",\"words\":\"",
         descriptions::emergency_meaning(message.code), "\",\"error_register\":", message.error_register,
         ",\"info\":\"", HexBytes{message.info}, '"');
}

void add_details(Buffer& to, const Event& event, const journal::Journal& journal, const journal::Line& line) {
  switch (event.kind) {
    case Kind::kModbus: return add_modbus(to, event, journal, line.words);
    case Kind::kBegun:
    case Kind::kEnded: return add_transaction(to, event, journal, line);
    case Kind::kFrame:
      append(to, ",\"frame\":\"", line.frame, '"');
      if (event.node != 0) append(to, ",\"node\":", event.node);
      return append(to, ",\"words\":\"", line.words, '"');
    case Kind::kEmergency: return add_emergency(to, event);
    case Kind::kState: return append(to, ",\"node\":", event.node, ",\"state\":\"", line.words, '"');
    case Kind::kTerminals:
      return append(to, ",\"node\":", event.node, ",\"index\":", event.index, ",\"sub\":", event.sub,
                    ",\"value\":", static_cast<std::int32_t>(event.code), ",\"words\":\"", line.words, '"');
    case Kind::kAdvice:
      return append(to, ",\"rule\":\"", name_of(static_cast<journal::Mistake>(event.state)),
                    "\",\"client\":", event.code, ",\"node\":", event.node, ",\"words\":\"", line.words, '"');
    case Kind::kBoot:
    case Kind::kFault: append(to, ",\"node\":", event.node); [[fallthrough]];
    case Kind::kCommand:
      append(to, ",\"words\":\"", line.words, '"');
      if (event.state == journal::kRefused) append(to, ",\"refused\":true");
      return;
    case Kind::kClient:
      return append(to, ",\"client\":", event.code, ",\"address\":\"", line.words,
                    "\",\"joined\":", event.state != 0 ? "true"sv : "false"sv);
  }
}

/// `line`: as in JSON strings.
void append_json(Buffer& to, std::uint64_t number, const Event& event, const journal::Journal& journal,
                 const journal::Line& line) {
  append(to, "{\"number\":", number, ",\"time\":");
  append_time(to, event.at, 6);
  if (event.network != 0) append(to, ",\"network\":", event.network);
  append(to, ",\"kind\":\"", journal::kKindNames[static_cast<std::size_t>(event.kind)], '"');
  if (event.transaction != 0) append(to, ",\"transaction\":", event.transaction);
  append(to, ",\"text\":\"", line.whole, '"');
  add_details(to, event, journal, line);
  to.push_back('}');
}

}  // namespace

std::uint64_t number_in(const Query& query, std::string_view key, std::uint64_t standard,
                        std::uint64_t highest, std::uint64_t lowest) {
  const auto found = query.find(key);
  if (found == query.end()) return standard;
  const auto number = base::parse_integer(found->second);
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
  if (const auto names = std::span(journal::kServiceNames).subspan(1);  // without "none"
      !service_.empty() && std::ranges::find(names, service_) == names.end())
    plant::refuse("service={}: must be {}", service_, base::listed(names));
  const auto found = query.find("kinds");
  std::string_view rest = found == query.end() ? "" : std::string_view(found->second);
  kinds_ = rest.empty() ? standard : 0;
  while (!rest.empty()) {
    const std::string_view name = base::take_part(rest, ',');
    const auto& names = journal::kKindNames;
    const auto kind = std::ranges::find(names, name);
    if (kind == names.end()) plant::refuse("kinds={}: must be {}", name, base::listed(names, " and "));
    kinds_ |= 1U << (kind - names.begin());
  }
  if (failed_ || slow_) kinds_ &= journal::kinds_of({Kind::kEnded});
  is_only_kinds_ = network_ == 0 && node_ == 0 && transaction_ == 0 && service_.empty() && !failed_ && !slow_;
}

bool EventFilter::has_all(const Event& event) const {
  if (network_ != 0 && event.network != network_) return false;
  if (transaction_ != 0 && event.transaction != transaction_) return false;
  if (node_ != 0 && (event.node != node_ || event.kind == Kind::kModbus)) return false;
  if (!service_.empty() && journal::name_of(event.service) != service_) return false;
  return (!failed_ || failed(event)) && (!slow_ || event.took >= *slow_);
}

void append_event(Buffer& to, std::uint64_t number, const Event& event, const journal::Journal& journal,
                  const journal::FindName& find) {
  Buffer said;
  Buffer value;
  journal::Line line = journal::append_text(said, event, journal, find);
  if (is_transaction(event) && event.size != 0 && line.value.empty()) {
    journal::append_value(value, journal.bytes(event), name_of(event, find));
    line.value = base::view(value);
  }
  if (is_plain(line.whole) && is_plain(base::view(value)))
    return append_json(to, number, event, journal, line);
  std::array<std::string, 5> escaped;
  append_json(to, number, event, journal, escape(line, escaped));
}

EventTexts::EventTexts(const journal::Journal& journal, const journal::FindName& find)
    : journal_(journal), find_(find), kept_(kEvents) {
  constexpr std::size_t kLongest = 1500;  // a Modbus request and its response as hexadecimal digits
  for (Kept& kept : kept_)
    kept.text.resize(kLongest);
}

void EventTexts::make(std::uint64_t number, Kept& kept) {
  kept.number = 0;  // until the text is there
  kept.text.clear();
  append(kept.text, "id: ", number, "\ndata: ");
  append_event(kept.text, number, journal_[number], journal_, find_);
  append(kept.text, "\n\n");
  kept.number = number;
}

double seconds_of(Time time) {
  return static_cast<double>(time) / kSecond;
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string json_string(std::string_view text) {
  return is_plain(text) ? std::string("\"").append(text) + '"' : line_of(std::string(text));
}

}  // namespace cbcan::web
