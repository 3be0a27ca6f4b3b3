// SPDX-License-Identifier: MIT
#pragma once

/// Settings as rows of tables. Plant file, command line and commands store values by these rows; --help and
/// the tables of the pages are generated from them. A default is the initialiser of its member.

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "base/buffer.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace cbcan::base {

// ---- A value as a user writes it, before the data type is known

using Bytes = std::vector<std::uint8_t>;
using Value = std::variant<bool, std::int64_t, double, std::string, Bytes>;

/// Pairs of hexadecimal digits, with or without blanks between them; nullopt if they are no pairs.
std::optional<Bytes> parse_octets(std::string_view text);
/// "hex:01 02 aB" and "0102aB" are three bytes, "hex:" is none; nullopt if the digits are not pairs.
std::optional<Bytes> parse_hex(std::string_view text);
bool is_hex(std::string_view text);

/// A value without its type: true or false, an integer, a number with a point or an exponent, else a text. A
/// text that looks like one of the others must be in double quotes.
Value parse_value(std::string_view text);

/// A text in TOML, as UTF-8.
std::string toml_text(std::string_view text);
/// Text in JSON: a byte outside printable ASCII becomes \u00XX.
std::string json_text(std::string_view text);

/// The value as a plant file writes it; texts and bytes in double quotes.
void append_value(Buffer& to, std::span<const std::uint8_t> bytes);
std::string value_text(const Value& value);

// ---- Rows

/// What is wrong with a value, to follow its name: "must be 1..127". Empty = nothing.
using Problem = std::string;

/// A kPath, and the path after `unix:` or `pty:` in a kAddress, is relative to the file that contains it.
/// kDuration: a text such as "100ms". kLines: a text or a list of them, or of integers if the row has a
/// range. kAny: a value of any type. kOfMember: the member's type decides.
enum class Form : std::uint8_t {
  kOfMember,
  kInteger,
  kHexadecimal,
  kNumber,
  kBoolean,
  kText,
  kPath,
  kAddress,
  kDuration,
  kLines,
  kAny
};

/// A text, and the line of the file that has it.
struct Line {
  std::string text;
  std::size_t number = 0;
  bool operator==(const Line&) const = default;
};

/// First and last kind with this row, for objects that have kinds, such as the shapes of a signal.
struct Kinds {
  std::uint8_t first = 0;
  std::uint8_t last = 0xFF;

  constexpr bool has(std::size_t kind) const { return kind >= first && kind <= last; }
  bool operator==(const Kinds&) const = default;
};

/// A row without the place where its value is stored.
struct Row {
  std::string_view key = {};     ///< "module.node_id"
  std::string_view option = {};  ///< of its own, as --help shows it: "--seed N"; most rows have none
  std::string_view help = {};    ///< a sentence without its full stop
  std::string_view more = {};    ///< sentences that only the reference page adds
  Form form = Form::kOfMember;
  std::int64_t low = 0;  ///< low = high: an integer has the range of its member, another number has none
  std::int64_t high = 0;
  std::string_view unit = {};    ///< after the range: " ms, 0 = none"
  std::string_view domain = {};  ///< the values it can have, as text; empty = range or choices
  std::span<const std::string_view> choices = {};  ///< a text is one of these, in the order of enumerators
  std::span<const int> numbers = {};               ///< an integer has to be one of these
  std::string_view example = {};                   ///< of a required setting; empty = optional
  std::string_view absent = {};                    ///< meaning of an omitted setting, if no value has it
  std::string_view instead = {};  ///< what a build without an operating system has instead of this setting
  std::uint32_t scale = 1;        ///< the stored number is the value times this
  Kinds kinds = {};
  Problem (*check)(const Value&) = nullptr;  ///< called if form and range are right
};

template <class Target>
struct Setting : Row {
  void (*store)(const Row&, Target&, const Value&, std::size_t line);
  Value (*load)(const Row&, const Target&);
};

/// Its value is written as a text.
bool is_text(const Row& row);

/// "1..127", "hold, repeat or back-and-forth", "a path"
std::string domain_of(const Row& row);

/// "50", "0x7FF", "hold"
std::string written(const Row& row, const Value& value);

/// The problem of a value of another form; of a date, for example, which is no Value.
[[nodiscard]] Problem wrong_form(const Row& row);
[[nodiscard]] Problem check(const Row& row, const Value& value);

/// The message of the UsageError that `parse` throws; empty = none.
template <class Parse>
Problem problem_of(Parse parse) try {
  parse();
  return {};
} catch (const UsageError& error) {
  return error.what();
}

/// The check of a row: its text is one that `kParse` reads.
template <auto kParse>
Problem check_by(const Value& value) {
  return problem_of([&] { kParse(std::get<std::string>(value)); });
}

/// Parses a value as typed for this row: a text needs no quotes.
Value typed(const Row& row, std::string_view text);

/// Checks and stores `value`; a rejected value changes nothing. `line`: of the file.
template <class Target>
[[nodiscard]] Problem assign(const Setting<Target>& setting, Target& target, const Value& value,
                             std::size_t line = 0) {
  Problem problem = check(setting, value);
  if (problem.empty()) setting.store(setting, target, value, line);
  return problem;
}

/// The text of a default that is no value.
inline constexpr std::string_view kNone = "none";

/// The value in `target` as text; `absent` or kNone if there is no value.
template <class Target>
std::string text_in(const Setting<Target>& setting, const Target& target, const Target& standard) {
  const Value value = setting.load(setting, target);
  const bool unset = !setting.absent.empty() && value == setting.load(setting, standard);
  if (unset) return std::string(setting.absent);
  return value == Value(std::string()) ? std::string(kNone) : written(setting, value);
}

/// What is set in `target`, as lines of TOML, for rows of kDuration and kLines.
template <class Target>
std::string table_text(std::span<const Setting<Target>> rows, const Target& target) {
  std::string text;
  for (const Setting<Target>& row : rows)
    if (const std::string value = text_in(row, target, target); value != kNone)
      text += fmt::format("{} = {}\n", row.key, value);
  return text;
}

// ---- Rows of members

namespace detail {

std::int64_t place_of(const Row& row, const Value& value);
/// The list in TOML; empty without lines.
std::string list_text(std::span<const Line> lines);

/// Type in an optional.
template <class Member>
Member unwrapped(const std::optional<Member>&);
template <class Member>
Member unwrapped(const Member&);

using List = std::vector<std::string>;
using Lines = std::vector<Line>;

template <class Member>
void put(const Row& row, Member& member, const Value& value, std::size_t line) {
  using Type = decltype(unwrapped(member));
  if constexpr (std::is_enum_v<Type>) {
    member = static_cast<Type>(place_of(row, value));
  } else if constexpr (std::is_same_v<Type, bool>) {
    member = std::get<bool>(value);
  } else if constexpr (std::is_integral_v<Type>) {
    member = row.form == Form::kDuration ? static_cast<Type>(*parse_duration(std::get<std::string>(value)))
                                         : static_cast<Type>(std::get<std::int64_t>(value) * row.scale);
  } else if constexpr (std::is_same_v<Type, double>) {
    const auto* whole = std::get_if<std::int64_t>(&value);
    member = whole != nullptr ? static_cast<double>(*whole) : std::get<double>(value);
  } else if constexpr (std::is_same_v<Type, List>) {
    member.push_back(std::get<std::string>(value));
  } else if constexpr (std::is_same_v<Type, Lines>) {
    member.push_back({written(row, value), line});
  } else {
    member = std::get<Type>(value);
  }
}

template <class Member>
Value get(const Row& row, const Member& member) {
  if constexpr (std::is_enum_v<Member>) {
    return std::string(row.choices[static_cast<std::size_t>(member)]);
  } else if constexpr (std::is_same_v<Member, bool> || std::is_same_v<Member, double> ||
                       std::is_same_v<Member, std::string>) {
    return member;
  } else if constexpr (std::is_integral_v<Member>) {
    if (row.form == Form::kDuration) return fmt::format("\"{}us\"", member);
    return static_cast<std::int64_t>(member / static_cast<Member>(row.scale));
  } else if constexpr (std::is_same_v<Member, List>) {
    return std::string();
  } else if constexpr (std::is_same_v<Member, Lines>) {
    return list_text(member);
  } else {
    return member ? get(row, *member) : Value(std::string());
  }
}

template <class Object>
constexpr Object& at(Object& object) {
  return object;
}
template <class Object, class Step, class... Steps>
constexpr auto& at(Object& object, Step step, Steps... steps) {
  return at(std::invoke(step, object), steps...);
}

template <class Type>
constexpr Form form_of() {
  if (std::is_same_v<Type, bool>) return Form::kBoolean;
  if (std::is_integral_v<Type>) return Form::kInteger;
  if (std::is_same_v<Type, Lines>) return Form::kLines;
  return std::is_same_v<Type, double> ? Form::kNumber : Form::kText;
}

template <class Target, class Member>
Target target_of(Member Target::*);

}  // namespace detail

/// The row of the member at the end of `kPath`: member pointers or functions, from a Target on.
template <class Target, auto... kPath>
constexpr Setting<Target> setting(Row row) {
  using Member = std::remove_cvref_t<decltype(detail::at(std::declval<Target&>(), kPath...))>;
  using Type = decltype(detail::unwrapped(std::declval<Member>()));
  if (row.form == Form::kOfMember) row.form = detail::form_of<Type>();
  if constexpr (std::is_integral_v<Type> && sizeof(Type) < sizeof row.high)
    if (row.low == row.high) row.high = std::numeric_limits<Type>::max();
  return {
      row,
      [](const Row& self, Target& target, const Value& value, std::size_t line) {
        detail::put(self, detail::at(target, kPath...), value, line);
      },
      [](const Row& self, const Target& target) { return detail::get(self, detail::at(target, kPath...)); }};
}
/// The Target is that of the first member pointer.
template <auto kFirst, auto... kPath>
constexpr auto setting(Row row) {
  return setting<decltype(detail::target_of(kFirst)), kFirst, kPath...>(row);
}

}  // namespace cbcan::base
