// SPDX-License-Identifier: MIT
#include "web/event_json.hpp"

#include <algorithm>
#include <cstring>

#include "eds/emergency.hpp"
#include "journal/watch.hpp"
#include "plant/words.hpp"
#include "text/numbers.hpp"
#include "text/utf8.hpp"
#include "text/words.hpp"

namespace cbcan::web {

using journal::Event;
using journal::Kind;
using text::append;
using text::Buffer;
using text::HexBytes;

namespace {

using text::room;
using text::write;

/// Neither control characters, quotes and backslashes nor bytes above 7Fh: eight are compared at a time.
bool is_plain(std::string_view text) {
  constexpr std::uint64_t kEach = 0x0101010101010101;
  std::uint64_t others = 0;
  const auto compare = [&others](std::uint64_t eight) {
    others |=
        eight | (eight - kEach * ' ') | ((eight ^ kEach * '"') - kEach) | ((eight ^ kEach * '\\') - kEach);
  };
  std::uint64_t eight = kEach * ' ';
  for (; text.size() >= sizeof eight; text.remove_prefix(sizeof eight)) {
    std::memcpy(&eight, text.data(), sizeof eight);
    compare(eight);
  }
  for (const char c : text)
    eight = eight << 8 | static_cast<unsigned char>(c);
  compare(eight);
  return (others & kEach * 0x80) == 0;
}

/// A text in quotes, always valid UTF-8.
struct Quoted {
  explicit Quoted(std::string_view any) : Quoted(any, web::is_plain(any)) {}
  Quoted(std::string_view any, bool plain) : text(any), is_plain(plain) {}

  std::string_view text;
  bool is_plain;
};

/// Null: it is no UTF-8.
char* write_escaped(char* at, std::string_view rest) {
  while (!rest.empty()) {
    const std::string_view from = rest;
    const auto code = text::take_code_point(rest);
    if (!code) return nullptr;
    constexpr std::string_view kNamed = "\b\t\n\f\r\"\\";
    constexpr std::string_view kNames = "btnfr\"\\";
    if (const std::size_t named = kNamed.find(from.front()); named != kNamed.npos)
      at = write(write(at, '\\'), kNames[named]);
    else if (*code < ' ')
      at = write(write(at, *code < 0x10 ? "\\u000" : "\\u001"), "0123456789abcdef"[*code & 0xF]);
    else
      at = write(at, from.substr(0, from.size() - rest.size()));
  }
  return at;
}

constexpr std::size_t room(const Quoted& quoted) {
  return (quoted.is_plain ? 1 : 6) * quoted.text.size() + 2;
}
char* write(char* at, const Quoted& quoted) {
  if (quoted.is_plain) return write(write(write(at, '"'), quoted.text), '"');
  if (char* const end = write_escaped(write(at, '"'), quoted.text)) return write(end, '"');
  return write(at, line_of(Json(std::string(quoted.text))));
}

/// Microseconds as seconds, or with three places as milliseconds: with a point, as line_of() writes a number.
struct Fraction {
  std::uint64_t number;
  unsigned places;
};

constexpr std::size_t room(const Fraction& fraction) {
  return room(text::Decimal{fraction.number, fraction.places}) + 2;
}
char* write(char* at, const Fraction& fraction) {
  constexpr Time kShortest = 100;  // less has an exponent
  if (fraction.places == 6 && fraction.number != 0 && fraction.number < kShortest)
    return fmt::format_to(at, "{}", seconds_of(fraction.number));
  char* const end = write(at, text::Decimal{fraction.number, fraction.places});
  return std::find(at, end, '.') != end ? end : write(end, ".0");
}

void add_modbus(Buffer& to, const Event& event, const journal::Journal& journal, const Quoted& words) {
  append(to, ",\"unit\":", event.node, ",\"client\":", event.code, ",\"exception\":", event.state,
         ",\"words\":", words);
  const auto all = journal.bytes(event);
  if (all.empty()) return;
  append(to, ",\"function\":", all[0], ",\"request\":\"", HexBytes{all.first(event.index)},
         "\",\"response\":\"", HexBytes{all.subspan(event.index)}, '"');
}

void add_transaction(Buffer& to, const Event& event, const journal::Journal& journal,
                     const journal::FindName& find, const Quoted& words) {
  const eds::ObjectName* const name = find(event.network, event.node, event.index, event.sub);
  const auto bytes = journal.bytes(event);
  append(to, ",\"service\":\"", journal::name_of(event.service), "\",\"node\":", event.node,
         ",\"index\":", event.index, ",\"sub\":", event.sub,
         ",\"name\":", Quoted{name == nullptr ? std::string_view() : name->name}, ",\"words\":", words,
         ",\"bytes\":\"", HexBytes{bytes}, "\",\"value\":");
  Buffer said;
  if (!bytes.empty()) journal::append_value(said, bytes, name);
  append(to, Quoted{text::view(said)});
  if (event.kind == Kind::kBegun) return;
  said.clear();
  journal::append_result(said, event);
  append(to, ",\"ok\":", failed(event) ? "false" : "true",
         ",\"result\":", journal::is_cancelled(event) ? -1 : int{event.result}, ",\"code\":", event.code,
         ",\"outcome\":", Quoted{text::view(said)}, ",\"took_ms\":", Fraction{event.took, 3});
}

void add_emergency(Buffer& to, const Event& event) {
  const auto message = eds::emergency_from(event.frame.data);
  append(to, ",\"node\":", event.node, ",\"code\":", message.code,
         ",\"words\":", Quoted{eds::emergency_meaning(message.code)},
         ",\"error_register\":", message.error_register, ",\"info\":\"", HexBytes{message.info}, '"');
}

/// `subject` is the event's text before its words, whose last word is the frame.
void add_details(Buffer& to, const Event& event, const journal::Journal& journal,
                 const journal::FindName& find, std::string_view subject, const Quoted& words) {
  switch (event.kind) {
    case Kind::kModbus: return add_modbus(to, event, journal, words);
    case Kind::kBegun:
    case Kind::kEnded: return add_transaction(to, event, journal, find, words);
    case Kind::kFrame:
      append(to, ",\"frame\":\"", subject.substr(subject.rfind(' ') + 1), '"');
      if (event.node != 0) append(to, ",\"node\":", event.node);
      return append(to, ",\"words\":", words);
    case Kind::kEmergency: return add_emergency(to, event);
    case Kind::kState: return append(to, ",\"node\":", event.node, ",\"state\":", words);
    case Kind::kTerminals:
      return append(to, ",\"node\":", event.node, ",\"index\":", event.index, ",\"sub\":", event.sub,
                    ",\"value\":", static_cast<std::int32_t>(event.code), ",\"words\":", words);
    case Kind::kFault: append(to, ",\"node\":", event.node); [[fallthrough]];
    case Kind::kCommand:
      append(to, ",\"words\":", words);
      if (event.state == journal::kRefused) append(to, ",\"refused\":true");
      return;
    case Kind::kClient:
      return append(to, ",\"client\":", event.code, ",\"address\":", words,
                    ",\"joined\":", event.state != 0 ? "true" : "false");
  }
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
  if (const auto names = journal::service_names();
      !service_.empty() && std::ranges::find(names, service_) == names.end())
    plant::refuse("service={}: must be {}", service_, text::listed(names));
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

void append_event(Buffer& to, std::uint64_t number, const Event& event, const journal::Journal& journal,
                  const journal::FindName& find) {
  Buffer said;
  const std::string_view words = journal::append_text(said, event, journal, find);
  const Quoted line(text::view(said));
  append(to, "{\"number\":", number, ",\"time\":", Fraction{event.at, 6});
  if (event.network != 0) append(to, ",\"network\":", event.network);
  append(to, ",\"kind\":\"", journal::kind_names()[static_cast<std::size_t>(event.kind)], '"');
  if (event.transaction != 0) append(to, ",\"transaction\":", event.transaction);
  append(to, ",\"text\":", line);
  const std::size_t before = static_cast<std::size_t>(words.data() - line.text.data());
  add_details(to, event, journal, find, line.text.substr(0, before - std::min<std::size_t>(before, 1)),
              Quoted(words, line.is_plain));
  append(to, '}');
}

std::string_view EventTexts::make(std::uint64_t number, Kept& kept) {
  made_.clear();
  append(made_, "id: ", number, "\ndata: ");
  append_event(made_, number, journal_[number], journal_, find_);
  append(made_, "\n\n");
  const std::string_view text = text::view(made_);
  if (text.size() > kBytes) return text;
  const std::uint64_t begin = ring_.add({{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}});
  kept = {number, begin, text::characters(ring_.at(begin, text.size()))};
  return kept.text;
}

double seconds_of(Time time) {
  return static_cast<double>(time) / kSecond;
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cbcan::web
