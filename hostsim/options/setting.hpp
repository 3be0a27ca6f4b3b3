// SPDX-License-Identifier: MIT
#pragma once

/// Things that can be set, as rows of tables. Plant file, command line and commands put values in by these
/// rows; --help and the tables of the pages are made from them. A default stands where the member is
/// declared.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "text/value.hpp"

namespace cbcan::options {

using text::Value;

/// What is wrong with a value, to be put behind its name: "must be 1..127". Empty = nothing.
using Problem = std::string;

/// kPath is a text that a file gives relative to itself, and so is what follows `unix:` or `pty:` in a
/// kAddress.
/// kAny is whatever the thing needs. kOfMember: as the member's type says.
enum class Form : std::uint8_t {
  kOfMember,
  kInteger,
  kHexadecimal,
  kNumber,
  kBoolean,
  kText,
  kPath,
  kAddress,
  kAny
};

/// Of things that have kinds, such as a signal's shape: the first and the last that have this row.
struct Kinds {
  std::uint8_t first = 0;
  std::uint8_t last = 0xFF;

  constexpr bool has(std::size_t kind) const { return kind >= first && kind <= last; }
  bool operator==(const Kinds&) const = default;
};

/// All of a row but where it is stored.
struct Row {
  std::string_view key = {};     ///< "module.node_id"
  std::string_view option = {};  ///< its own on the command line, as --help shows it: "--seed N"; mostly none
  std::string_view help = {};    ///< what it is; a sentence without its full stop
  std::string_view more = {};    ///< what only the reference adds: sentences
  Form form = Form::kOfMember;
  std::int64_t low = 0;  ///< low = high: a whole number is what its member can hold, another one any
  std::int64_t high = 0;
  std::string_view unit = {};    ///< behind the range: " ms, 0 = none"
  std::string_view domain = {};  ///< what it may be, in words; empty = range or choices say it
  std::span<const std::string_view> choices =
      {};                         ///< a text has to be one of these; an enumerator is its place
  std::span<const int> numbers = {};  ///< a whole number has to be one of these
  std::string_view example = {};  ///< of one that has to be there; empty = may be left out
  std::string_view absent = {};   ///< what it means to leave it out, where that is no value
  std::uint32_t scale = 1;        ///< what is stored is so many times the value
  Kinds kinds = {};
  Problem (*check)(const Value&) = nullptr;  ///< of what has the right form and is in range
};

template <class Target>
struct Setting : Row {
  void (*store)(const Row&, Target&, const Value&);
  Value (*load)(const Row&, const Target&);
};

/// It is written as a text.
bool is_text(const Row& row);

/// "1..127", "hold, repeat or back-and-forth", "a path"
std::string domain_of(const Row& row);

/// "50", "0x7FF", "hold"
std::string written(const Row& row, const Value& value);

/// What a value of another form is told; a date, say, which is not even a Value.
[[nodiscard]] Problem wrong_form(const Row& row);
[[nodiscard]] Problem check(const Row& row, const Value& value);

/// A value as somebody types it who knows what it is for.
Value typed(const Row& row, std::string_view text);

/// Checks `value` and puts it where it belongs; a refused one changes nothing.
template <class Target>
[[nodiscard]] Problem assign(const Setting<Target>& setting, Target& target, const Value& value) {
  Problem problem = check(setting, value);
  if (problem.empty()) setting.store(setting, target, value);
  return problem;
}

/// Of a default that is no value.
inline constexpr std::string_view kNone = "none";

/// What it is in `target`, in words; `absent`, or kNone, where that is no value.
template <class Target>
std::string text_in(const Setting<Target>& setting, const Target& target, const Target& standard) {
  const Value value = setting.load(setting, target);
  const bool unset = !setting.absent.empty() && value == setting.load(setting, standard);
  if (unset) return std::string(setting.absent);
  return value == Value(std::string()) ? std::string(kNone) : written(setting, value);
}

// ---- Rows of members

namespace detail {

std::int64_t place_of(const Row& row, const Value& value);

template <class Member>
struct Unwrapped {
  using Type = Member;
};
template <class Member>
struct Unwrapped<std::optional<Member>> {
  using Type = Member;
};

/// Each value is added to it.
template <class Member>
inline constexpr bool kIsList = std::is_same_v<Member, std::vector<std::string>>;

template <class Member>
void put(const Row& row, Member& member, const Value& value) {
  using Type = typename Unwrapped<Member>::Type;
  if constexpr (std::is_enum_v<Type>) {
    member = static_cast<Type>(place_of(row, value));
  } else if constexpr (std::is_same_v<Type, bool>) {
    member = std::get<bool>(value);
  } else if constexpr (std::is_integral_v<Type>) {
    member = static_cast<Type>(std::get<std::int64_t>(value) * row.scale);
  } else if constexpr (std::is_same_v<Type, double>) {
    const auto* whole = std::get_if<std::int64_t>(&value);
    member = whole != nullptr ? static_cast<double>(*whole) : std::get<double>(value);
  } else if constexpr (kIsList<Type>) {
    member.push_back(std::get<std::string>(value));
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
    return static_cast<std::int64_t>(member / static_cast<Member>(row.scale));
  } else if constexpr (kIsList<Member>) {
    return std::string();
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
  if constexpr (std::is_member_pointer_v<Step>) {
    return at(object.*step, steps...);
  } else {
    return at(step(object), steps...);
  }
}

template <class Type>
constexpr Form form_of() {
  if (std::is_same_v<Type, bool>) return Form::kBoolean;
  if (std::is_integral_v<Type>) return Form::kInteger;
  return std::is_same_v<Type, double> ? Form::kNumber : Form::kText;
}

}  // namespace detail

/// The row of what `path`, member pointers or functions, leads to from a Target.
template <class Target, auto... kPath>
constexpr Setting<Target> setting(Row row) {
  using Member = std::remove_cvref_t<decltype(detail::at(std::declval<Target&>(), kPath...))>;
  using Type = typename detail::Unwrapped<Member>::Type;
  if (row.form == Form::kOfMember) row.form = detail::form_of<Type>();
  if constexpr (std::is_integral_v<Type> && sizeof(Type) < sizeof row.high)
    if (row.low == row.high) row.high = std::numeric_limits<Type>::max();
  return {
      row,
      [](const Row& self, Target& target, const Value& value) {
        detail::put(self, detail::at(target, kPath...), value);
      },
      [](const Row& self, const Target& target) { return detail::get(self, detail::at(target, kPath...)); }};
}

}  // namespace cbcan::options
