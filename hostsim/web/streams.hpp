// SPDX-License-Identifier: MIT
#pragma once

/// Responses that are made in parts: lists, events, the responses to commands.

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "plant/command_words.hpp"
#include "web/api.hpp"
#include "web/state.hpp"

namespace cbcan::web {

// ---- Long answers, between whose parts the plant goes on

/// Made in parts: `next(to)` does one, and returns whether there are more.
class Answer final : public protocols::HttpStream {
 public:
  using Next = std::function<bool(base::Buffer& to)>;

  explicit Answer(Next next) : next_(std::move(next)) {}

  /// Ends a piece at a part that appends nothing.
  bool fill(base::Buffer& to) override {
    constexpr std::size_t kPiece = 4096;
    for (std::size_t size = 0; to.size() < kPiece;) {
      size = to.size();
      if (!next_(to)) return false;
      if (to.size() == size) break;
    }
    return true;
  }
  bool has_news() const override { return true; }
  bool is_answer() const override { return true; }

 private:
  Next next_;
};

/// An object with `head` and a list, to which next() appends one item or nothing.
inline protocols::HttpResponse list_of(const Json& head, std::string_view name, Answer::Next next) {
  std::string begin = line_of(head);
  begin.replace(begin.size() - 1, 1, fmt::format(",\"{}\":[", name));
  return {.stream = std::make_unique<Answer>(
              [begin = std::move(begin), next = std::move(next), has_item = false](base::Buffer& to) mutable {
                base::append(to, std::exchange(begin, {}));
                const std::size_t size = to.size();
                if (has_item) base::append(to, ',');
                const std::size_t at = to.size();
                const bool more = next(to);
                if (to.size() == at)
                  to.resize(size);
                else
                  has_item = true;
                if (!more) base::append(to, "]}\n");
                return more;
              })};
}

// ---- Streams

/// Server-sent events from a number on that match the query, and the state and the values that it watches.
class EventStream final : public protocols::HttpStream {
 public:
  EventStream(const ApiParts& parts, EventTexts& texts, const Query& query, std::uint64_t next)
      : control_(parts.control),
        texts_(texts),
        filter_(query),
        cursor_(control_.journal(), next, filter_.kinds()) {
    if (const auto network = number_in(query, "state", 0, control_.networks()); network != 0)
      state_.emplace(parts, static_cast<std::size_t>(network));
    const auto found = query.find("watch");
    std::string_view rest = found == query.end() ? "" : std::string_view(found->second);
    while (!rest.empty())
      watch(base::take_part(rest, ','));
  }

  bool fill(base::Buffer& to) override {
    if (!std::exchange(begun_, true)) base::append(to, ": cbcan\n\n");
    const std::uint64_t missed = cursor_.look([&](std::uint64_t number, const journal::Event& event) {
      if (filter_.passes(event)) append_text(to, texts_.of(number));
      return to.size() < kMostUnsent;
    });
    if (missed != 0) append_data(to, {{"kind", "missed"}, {"events", missed}});
    for (Watched& watched : watched_)
      tell(watched, to);
    if (state_) state_->append(to);
    return true;
  }
  bool has_news() const override { return !begun_ || state_ || !watched_.empty() || cursor_.has_news(); }
  std::string_view keep_alive() const override { return ":\n\n"; }
  Time interval() const override { return state_ ? StateChanges::kInterval : HttpStream::interval(); }

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

  /// Appends without a call: with eight streams that is 2 % of a transaction.
  [[gnu::always_inline]] static void append_text(base::Buffer& to, std::string_view text) {
    to.resize(to.size() + text.size());
    base::write(to.data() + to.size() - text.size(), text);
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
  std::optional<StateChanges> state_;
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

}  // namespace cbcan::web
