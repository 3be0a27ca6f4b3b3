// SPDX-License-Identifier: MIT
#include "plant/control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/setting.hpp"
#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "journal/event_text.hpp"
#include "journal/watch.hpp"
#include "sim/frame_text.hpp"

namespace cbcan::plant {

namespace {

/// The words after the kind; for an event, the wanted number, and the network that was in front of words[0].
struct Written {
  Words words;
  std::optional<unsigned> count = {};
  std::size_t network = 1;
};

// ---- Comparisons

constexpr std::array<std::string_view, 6> kOperators{"=", "!=", "<", "<=", ">", ">="};

bool compare(std::string_view with, const auto& is, const auto& wanted) {
  if (with == "=") return is == wanted;
  if (with == "!=") return is != wanted;
  if (with == "<") return is < wanted;
  if (with == "<=") return is <= wanted;
  return with == ">" ? is > wanted : is >= wanted;
}

std::string operator_of(std::string_view word) {
  if (std::ranges::find(kOperators, word) == kOperators.end())
    refuse("\"{}\": must be {}", word, base::listed(kOperators));
  return std::string(word);
}

/// What an object is compared with. Order is between numbers; a text or bytes are as `get` shows them.
class Comparison {
 public:
  Comparison(std::string_view with, std::string_view wanted, DataType type)
      : with_(operator_of(with)), number_(size_of(type) != 0), wanted_(base::parse_value(wanted)) {
    const auto* const text = std::get_if<std::string>(&wanted_);
    if (number_ && text != nullptr) refuse("\"{}\": must be a number, as the object is one", wanted);
    if (number_) return;
    if (with_ != "=" && with_ != "!=") refuse("\"{}\": texts have no order; write = or !=", with_);
    std::string shown = text != nullptr ? *text : std::string(wanted);
    const auto bytes = base::is_hex(shown) ? base::parse_hex(shown) : std::nullopt;
    if (!bytes && type != DataType::kVisibleString)
      refuse("\"{}\": must be bytes, such as hex:01 02", wanted);
    wanted_ = bytes ? base::Value(*bytes) : base::Value(std::move(shown));
  }

  bool holds(std::string_view is) const {
    if (!number_) return compare(with_, is, std::string_view(base::value_text(wanted_)));
    const base::Value value = base::parse_value(is);
    const auto* const whole = std::get_if<std::int64_t>(&value);
    const auto* const whole_wanted = std::get_if<std::int64_t>(&wanted_);
    if (whole != nullptr && whole_wanted != nullptr) return compare(with_, *whole, *whole_wanted);
    const auto number = number_in(value) ? number_in(value) : base::parse<double>(is);  // inf, nan
    return compare(with_, number, number_in(wanted_));
  }

 private:
  std::string with_;
  bool number_;
  base::Value wanted_;
};

// ---- States

class RegisterCondition final : public Condition {
 public:
  RegisterCondition(const Written& written, View& view) : with_(operator_of(written.words[1])) {
    const auto [network, name] = where(written.words[0], view.networks());
    network_ = network;
    first_ = number_of(name, 0, 0xFFFF, "register");
    for (const std::string_view word : Words(written.words.begin() + 2, written.words.end()))
      wanted_.push_back(static_cast<std::uint16_t>(number_of(word, 0, 0xFFFF, "value")));
    if (wanted_.size() > 1 && with_ != "=") refuse("\"{}\": of several registers write =", with_);
    read(view);
  }
  bool holds(View& view) override { return compare(with_, read(view), wanted_); }
  std::string seen(View& view) override { return "it is " + base::joined(read(view)); }

 private:
  std::vector<std::uint16_t> read(View& view) const { return view.read(network_, first_, wanted_.size()); }

  std::size_t network_ = 1;
  std::uint32_t first_ = 0;
  std::string with_;
  std::vector<std::uint16_t> wanted_;
};

/// Polled, as a device may change an object without an event.
class ObjectCondition final : public Condition {
 public:
  ObjectCondition(const Written& written, View& view)
      : node_(written.words[0]),
        address_(written.words[1]),
        comparison_(written.words[2], rest_of(written.words, 3), check_value(view, node_, address_)) {
    sim::Node& node = node_of(view, node_);
    if (!level_of(node, address_)) address_ = object_of(node, address_);
  }
  bool applies(View& view) const override { return node_of(view, node_).has_power(); }
  bool holds(View& view) override {
    return node_of(view, node_).has_power() && comparison_.holds(value_of(view, node_, address_));
  }
  std::string seen(View& view) override {
    return node_of(view, node_).has_power() ? "it is " + value_of(view, node_, address_) : "the node is off";
  }
  Time next_deadline(View& view) const override { return view.now() + kMillisecond; }

 private:
  std::string node_;
  std::string address_;
  Comparison comparison_;
};

class StateCondition final : public Condition {
 public:
  StateCondition(const Written& written, View& view) : node_(written.words[0]), state_(written.words[1]) {
    const auto names = base::column(journal::state_names(), &journal::StateName::name);
    node_of(view, node_);
    if (std::ranges::find(names, state_) == names.end())
      refuse("\"{}\": must be {}", state_, base::listed(names));
  }
  bool holds(View& view) override { return state_of(node_of(view, node_)) == state_; }
  std::string seen(View& view) override { return fmt::format("it is {}", state_of(node_of(view, node_))); }

 private:
  std::string node_;
  std::string state_;
};

class TimeCondition final : public Condition {
 public:
  TimeCondition(const Written& written, View& /*view*/) : wanted_(duration_of(written.words[0])) {}
  bool holds(View& view) override { return view.now() >= wanted_; }
  std::string seen(View& view) override { return "it is " + base::seconds_text(view.now()); }
  Time next_deadline(View& /*view*/) const override { return wanted_; }

 private:
  Time wanted_;
};

class TookCondition final : public Condition {
 public:
  TookCondition(const Written& written, View& view)
      : since_(view.now()), with_(operator_of(written.words[0])), wanted_(duration_of(written.words[1])) {
    if (with_ == "=" && !view.has_exact_time())
      throw NotObservable("took = wants time to the microsecond; write took >= and took <=");
  }
  bool holds(View& view) override { return compare(with_, view.now() - since_, wanted_); }
  std::string seen(View& view) override {
    return "it took " + base::seconds_text(view.now() - since_) + " s";
  }
  Time next_deadline(View& view) const override {
    return view.now() <= since_ + wanted_ ? std::max(view.now() + 1, since_ + wanted_) : kNever;
  }

 private:
  Time since_;
  std::string with_;
  Time wanted_;
};

// ---- Events

class EventCondition : public Condition {
 public:
  explicit EventCondition(const Written& written) : network_(written.network), wanted_(written.count) {}
  bool holds(View& view) override {
    const std::size_t count = happened(view);
    return wanted_ ? count == *wanted_ : count != 0;
  }
  std::string seen(View& view) override { return fmt::format("{} of them", happened(view)); }

 protected:
  const std::size_t network_;

 private:
  virtual std::size_t happened(View& view) const = 0;

  std::optional<unsigned> wanted_;
};

/// A level, not an edge: one in progress has started.
class TransactionCondition final : public EventCondition {
 public:
  TransactionCondition(const Written& written, View& view)
      : EventCondition(written), ended_(written.words[0] == "ended") {
    if (!ended_ && written.words[0] != "started")
      refuse("\"{}\": must be started or ended", written.words[0]);
    before_ = ended(view);
  }
  bool is_up_to_plc(View& view) const override { return !is_in_progress(view); }

 private:
  bool is_in_progress(View& view) const {
    return view.read(network_, regmap::kWindowFirst, 1)[0] == regmap::kExecute;
  }
  std::size_t ended(View& view) const { return view.transactions(network_) - (is_in_progress(view) ? 1 : 0); }
  std::size_t happened(View& view) const override {
    return (ended_ ? ended(view) : view.transactions(network_)) - before_;
  }

  bool ended_;
  std::size_t before_ = 0;
};

class FramesCondition : public EventCondition, private Listener {
 public:
  FramesCondition(const Written& written, View& view) : EventCondition(written), Listener(view) {
    view.world(network_);
  }

 private:
  void on_frame(std::size_t network, const Frame& frame, Time /*now*/) final {
    if (network == network_ && matches(frame)) ++count_;
  }
  virtual bool matches(const Frame& frame) const = 0;
  std::size_t happened(View& /*view*/) const final { return count_; }

  std::size_t count_ = 0;
};

/// A pattern for frames written as text: x is any digit, * at the end anything.
class FrameCondition final : public FramesCondition {
 public:
  FrameCondition(const Written& written, View& view) : FramesCondition(written, view) {
    for (const char letter : written.words[0])
      pattern_ += letter >= 'a' && letter <= 'f' ? static_cast<char>(letter - 'a' + 'A') : letter;
    const std::size_t id = pattern_.find('#');
    if ((id != 3 && id != 8) || pattern_.find_first_not_of("0123456789ABCDEFRx#*") != std::string::npos)
      refuse("frame \"{}\": write it as candump does, 605#4017*, with x for any digit and * for any end",
             written.words[0]);
  }

 private:
  bool matches(const Frame& frame) const override {
    const std::string text = sim::frame_text(frame);
    const bool open = pattern_.ends_with('*');
    const std::string_view wanted(pattern_.data(), pattern_.size() - (open ? 1 : 0));
    if (open ? text.size() < wanted.size() : text.size() != wanted.size()) return false;
    return std::ranges::equal(wanted, std::string_view(text).substr(0, wanted.size()),
                              [](char any, char is) { return any == is || (any == 'x' && is != '#'); });
  }

  std::string pattern_;
};

class EmergencyCondition final : public FramesCondition {
 public:
  EmergencyCondition(const Written& written, View& view)
      : FramesCondition(written, view), node_(number_of(written.words[0], 1, nmt::kMaxNode, "node")) {
    if (written.words.size() == 2) code_ = number_of(written.words[1], 0, 0xFFFF, "code");
  }

 private:
  bool matches(const Frame& frame) const override {
    const auto message = journal::emergency_of(frame);
    return message && (frame.id & nmt::kMaxNode) == node_ && (!code_ || message->code == *code_);
  }

  std::uint32_t node_;
  std::optional<std::uint32_t> code_;
};

// ---- The rows

struct Row {
  std::size_t least;  ///< words after the name
  std::size_t most;
  bool is_event;
  std::unique_ptr<Condition> (*make)(const Written&, View&);
  Usage text;
};

template <class Made>
std::unique_ptr<Condition> make(const Written& written, View& view) {
  return std::make_unique<Made>(written, view);
}

// clang-format off
constexpr auto kKinds = std::to_array<Row>({
    {1, 1, true, make<TransactionCondition>, {"transaction started|ended", "A transaction of the PLC is in progress, or ends",
     "For one already in progress, `ended` is its end."}},
    {3, kAnyNumber, false, make<RegisterCondition>, {"register R OP VALUE...", "R and the following registers satisfy the comparison",
     "`OP` is `=`, `!=`, `<`, `<=`, `>` or `>=`; with several values `=`."}},
    {4, kAnyNumber, false, make<ObjectCondition>, {"object NODE INDEX[:SUB]|NAME OP VALUE", "An object of a simulated node satisfies the comparison",
     "Numbers are ordered; a text or bytes, as `get` shows them, are `=` or `!=` others."}},
    {2, 2, false, make<StateCondition>, {"state NODE STATE", "A simulated node is in this NMT state",
     "It is initialising, pre-operational, operational, stopped, or off (without power)."}},
    {1, 1, true, make<FrameCondition>, {"frame FRAME", "Such a frame is on the bus",
     "`605#40171000x*`: `x` is any digit, `*` at the end anything."}},
    {1, 2, true, make<EmergencyCondition>, {"emcy NODE [CODE]", "An EMCY message of this node is on the bus",
     "Code 0 is No Error."}},
    {1, 1, false, make<TimeCondition>, {"time DURATION", "This time has passed since the start of the plant", ""}},
    {2, 2, false, make<TookCondition>, {"took OP DURATION", "The time since the previous step, or since `wait`, satisfies the comparison", ""}},
});
// clang-format on

/// Removes "no" or a number from the front.
std::optional<unsigned> take_count(Words& words) {
  if (words.empty()) return std::nullopt;
  std::optional<unsigned> count;
  if (words.front() == "no") count = 0;
  if (const auto number = base::parse<unsigned>(words.front())) count = *number;
  if (count) words.erase(words.begin());
  return count;
}

}  // namespace

std::unique_ptr<Condition> make_condition(std::string_view text, View& view) {
  Written written{base::words_of(text)};
  if (const auto& words = written.words; words.size() > 2 && words[words.size() - 2] == "within")
    refuse("{}: within is a key of its own; write within = \"{}\"", text, words.back());
  written.count = take_count(written.words);
  const Row& kind = row_of<Row>(kKinds, written.words, "condition");
  if (written.count && !kind.is_event) refuse("{}: only events are counted: transaction, frame, emcy", text);
  written.words.erase(written.words.begin());
  if (kind.is_event) {
    const auto [network, name] = where(written.words[0], view.networks());
    written.network = network;
    written.words[0] = name;
  }
  return kind.make(written, view);
}

std::vector<Usage> condition_usages() {
  return base::column(kKinds, &Row::text);
}

std::optional<std::string> Wait::poll() const {
  if (condition->holds(view))
    return fmt::format("{} {}\n", is_pass ? "at" : "ok", base::seconds_text(view.now()));
  return view.now() < since + within ? std::nullopt : std::optional(give_up());
}

std::string Wait::give_up() const {
  return fmt::format("{}{} s: {}: {}\n", kNotWithin, base::seconds_text(within), text, condition->seen(view));
}

}  // namespace cbcan::plant
