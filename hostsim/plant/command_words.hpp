// SPDX-License-Identifier: MIT
#pragma once

/// Shared by commands and conditions: names of nodes, objects and registers, a device's inputs, outputs and
/// curves with their present values, and errors.

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/setting.hpp"
#include "base/text.hpp"
#include "cbcan/time.hpp"
#include "sim/behaviour.hpp"
#include "sim/frame_text.hpp"
#include "sim/world.hpp"

namespace cbcan::plant {

using Words = std::vector<std::string_view>;
/// Maximum that is no limit.
inline constexpr std::size_t kAnyNumber = ~std::size_t{0};

/// Why a command or a condition is rejected.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// It is correct, but cannot be observed here.
class NotObservable : public Refused {
 public:
  using Refused::Refused;
};

template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) {
  throw Refused(fmt::format(text, std::forward<Args>(args)...));
}

/// A command or a condition, as `help` and the pages show it.
struct Usage {
  std::string_view usage;    ///< "set NODE INDEX[:SUB] NUMBER"
  std::string_view meaning;  ///< "An input gets this value from outside"
  std::string_view more;     ///< sentences that only the page adds

  std::string_view name() const { return usage.substr(0, usage.find(' ')); }
};

/// The row whose usage the words follow; throws Refused. A Row has its Usage `text` and the numbers of words
/// after the name, `least` and `most`. `hint`: for an unknown name; empty = lists the names.
template <class Row>
const Row& row_of(std::span<const Row> rows, const Words& words, std::string_view kind,
                  std::string_view hint = {}) {
  const std::string_view name = words.empty() ? "" : words.front();
  std::vector<std::string_view> names;
  for (const Row& row : rows) {
    names.push_back(row.text.name());
    if (names.back() != name) continue;
    const std::size_t given = words.size() - 1;
    if (given < row.least || given > row.most) refuse("write {}", row.text.usage);
    return row;
  }
  std::string more = base::did_you_mean(name, names);
  if (more.empty()) more = hint.empty() ? "; there are " + base::listed(names, " and ") : hint;
  refuse("\"{}\": no such {}{}", name, kind, more);
}

/// true and false are 1 and 0; nullopt for texts and bytes.
std::optional<double> number_in(const base::Value& value);

/// These and the following functions throw Refused.
std::uint32_t number_of(std::string_view text, std::uint32_t low, std::uint32_t high, std::string_view what);
Time duration_of(std::string_view text);

/// The text from word `first` to the end, with the blanks between the words.
std::string_view rest_of(const Words& words, std::size_t first);

struct Address {
  std::uint16_t index;
  std::uint8_t sub;
};
/// "0x6041", "0x6401:2"
Address address_of(std::string_view text);

/// Number the way a plant file writes it; an integer has no point.
std::string text_of_number(double number);

/// "output:8", "0x6200:1.7"; nullopt for an object, which has a type and not only a number.
std::optional<sim::Terminal> terminal_of(std::string_view word);

/// "2/5" is 5 of network 2; without a number, of network 1.
struct Where {
  std::size_t network;  ///< from 1
  std::string_view name;
};
Where where(std::string_view word, std::size_t networks);
/// "2/", the prefix of names in network 2; empty for network 1.
std::string prefix_of(std::size_t network);

class Listener;

/// The observable state of a plant.
class View {
 public:
  virtual Time now() const = 0;  ///< since the plant's start, as are all times here
  virtual std::size_t networks() const = 0;
  /// Registers of a network, numbered from 1; throws Refused if there are none.
  virtual std::vector<std::uint16_t> read(std::size_t network, std::uint32_t first, std::size_t count) = 0;
  /// Number of transactions that have begun on this network.
  virtual std::uint32_t transactions(std::size_t network) = 0;
  /// Nodes and bus; throws NotObservable if only registers can be observed.
  virtual sim::World& world(std::size_t network) = 0;
  /// The start on that world's clock; add it to now().
  virtual Time started() const = 0;
  /// The plant has its own time, exact to the microsecond.
  virtual bool has_exact_time() const { return true; }

  /// Calls the listener for each frame, until remove(). Does nothing where only registers can be observed.
  virtual void add(Listener& /*listener*/) {}
  virtual void remove(Listener& /*listener*/) {}

 protected:
  ~View() = default;
};

/// Receives every frame on the buses, before the nodes do, as long as it exists.
class Listener {
 public:
  /// The view outlives the listener.
  explicit Listener(View& view) : view_(view) { view_.add(*this); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// `network`: from 1; `now`: since the plant's start.
  virtual void on_frame(std::size_t network, const Frame& frame, Time now) = 0;

 protected:
  ~Listener() { view_.remove(*this); }

 private:
  View& view_;
};

/// The node named by "5", "#1" or "2/5".
sim::Node& node_of(View& view, std::string_view word);
/// The same for a node that must have power.
sim::Node& running_node_of(View& view, std::string_view word);

/// "off" without power
std::string_view state_of(const sim::Node& node);

/// The type of a value; kReal64 for a terminal. Throws Refused if the node, with or without power, has no
/// such object or terminal.
DataType check_value(View& view, std::string_view node, std::string_view word);

/// The value that `get` shows, as a plant file writes it. `word`: "0x6401:2", "0x6200:1.7", "output:8".
std::string value_of(View& view, std::string_view node, std::string_view word);

/// The registers that `read` reads, and those that `write` and `trigger` write.
struct Reading {
  std::size_t network;
  std::uint32_t first;
  std::size_t count;
};
Reading read_of(const Words& words, std::size_t networks);
struct Writing {
  std::size_t network;
  std::uint32_t first;
  std::vector<std::uint16_t> words;
};
Writing writing_of(const Words& words, std::size_t networks);

struct ShownPoint {
  sim::Point point;    ///< with a name
  std::string object;  ///< in the notation of commands: "0x6000:1"
  double value = 0;
  std::optional<double> target{};
};

/// Those whose objects the node has; none while it has no power. Throws Refused.
std::vector<ShownPoint> points_of(View& view, std::string_view node);

/// The object of the point with this name, in which "-" stands for blanks: "0x2000:0" for "level". Another
/// word is returned as it is. Throws Refused for a name that the node's device does not have.
std::string object_of(sim::Node& node, std::string_view word);

/// The level of the input with this name, if its object has another number: that of a touch probe.
std::optional<double> level_of(sim::Node& node, std::string_view name);

/// A frame on a bus, as reports show it: "0.000000 2/5C2#4300100091010F00".
inline std::string frame_line(std::size_t network, const Frame& frame, Time at) {
  return fmt::format("{} {}{}", base::seconds_text(at), prefix_of(network), sim::frame_text(frame));
}

/// The last frames on the buses, `most` of them.
class LastFrames final : private Listener {
 public:
  explicit LastFrames(View& view, std::size_t most = 12) : Listener(view), most_(most) {}

  /// For a report: a line for each, after `indent`.
  std::string lines(std::string_view indent) const {
    std::string text;
    for (const auto& [network, frame, at] : frames_)
      text += fmt::format("{}{}\n", indent, frame_line(network, frame, at));
    return text;
  }

  struct Seen {
    std::size_t network;
    Frame frame;
    Time at;
  };
  /// All since the last call.
  std::deque<Seen> take() { return std::exchange(frames_, {}); }

 private:
  void on_frame(std::size_t network, const Frame& frame, Time now) override {
    frames_.push_back({network, frame, now});
    if (frames_.size() > most_) frames_.pop_front();
  }

  std::size_t most_;
  std::deque<Seen> frames_;
};

}  // namespace cbcan::plant
