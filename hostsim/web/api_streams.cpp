// SPDX-License-Identifier: MIT
#include "web/api_streams.hpp"

#include <fmt/core.h>

#include <utility>
#include <vector>

#include "text/words.hpp"

namespace cbcan::web {

namespace {

class EventStream final : public adapters::HttpStream {
 public:
  EventStream(plant::Control& control, const journal::FindName& find, const Query& query, std::uint64_t next)
      : control_(control), find_(find), filter_(query), cursor_(control.journal(), next, filter_.kinds()) {
    const auto found = query.find("watch");
    std::string_view rest = found == query.end() ? "" : std::string_view(found->second);
    while (!rest.empty())
      watch(text::take_part(rest, ','));
  }

  bool fill(std::string& text) override {
    const journal::Journal& journal = control_.journal();
    if (!std::exchange(begun_, true)) text += ": cbcan\n\n";
    const std::uint64_t missed = cursor_.look([&](std::uint64_t number, const journal::Event& event) {
      if (filter_.passes(event))
        text +=
            fmt::format("id: {}\ndata: {}\n\n", number, line_of(event_json(number, event, journal, find_)));
      return text.size() < kMostUnsent;
    });
    if (missed != 0) text += fmt::format("data: {}\n\n", line_of({{"kind", "missed"}, {"events", missed}}));
    for (Watched& watched : watched_)
      tell(watched, text);
    return true;
  }
  bool has_news() const override { return !watched_.empty() || cursor_.has_news(); }
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
    const auto sides = text::split(word, ':');
    if (!sides || watched_.size() == kMostWatched)
      plant::refuse("watch={}: write NODE:INDEX[:SUB], {} of them at most", word, kMostWatched);
    watched_.push_back({std::string(sides->first), std::string(sides->second)});
    plant::check_value(control_, watched_.back().node, watched_.back().object);
  }

  void tell(Watched& watched, std::string& text) const {
    const bool runs = plant::node_of(control_, watched.node).has_power();
    std::string value = runs ? plant::value_of(control_, watched.node, watched.object) : "off";
    if (value == watched.value) return;
    watched.value = std::move(value);
    text += fmt::format("data: {}\n\n", line_of({{"kind", "value"},
                                                 {"time", seconds_of(control_.now())},
                                                 {"node", watched.node},
                                                 {"object", watched.object},
                                                 {"value", watched.value}}));
  }

  plant::Control& control_;
  const journal::FindName& find_;
  EventFilter filter_;
  journal::Cursor cursor_;
  std::vector<Watched> watched_;
  bool begun_ = false;
};

class CommandStream final : public adapters::HttpStream {
 public:
  CommandStream(adapters::Execute execute, std::string body)
      : execute_(std::move(execute)), body_(std::move(body)) {}

  bool fill(std::string& text) override {
    text += std::exchange(dialogue_->unsent, {});
    while (!dialogue_->waiting && begun_ < body_.size() && text.size() < kMostUnsent) {
      std::string_view rest = std::string_view(body_).substr(begun_);
      const std::string_view line = text::trim(text::take_line(rest));
      begun_ = body_.size() - rest.size();
      if (line.size() > adapters::kLongestCommand)
        text += fmt::format("error: a line of more than {} characters\n", adapters::kLongestCommand);
      else if (!line.empty())
        text += execute_(line, dialogue_);
    }
    return dialogue_->waiting || begun_ < body_.size();
  }
  bool has_news() const override { return !dialogue_->waiting || !dialogue_->unsent.empty(); }

 private:
  adapters::Execute execute_;
  std::string body_;
  std::size_t begun_ = 0;
  std::shared_ptr<adapters::Dialogue> dialogue_ = std::make_shared<adapters::Dialogue>();
};

}  // namespace

std::unique_ptr<adapters::HttpStream> event_stream(plant::Control& control, const journal::FindName& find,
                                                   const Query& query, std::uint64_t next) {
  return std::make_unique<EventStream>(control, find, query, next);
}

std::unique_ptr<adapters::HttpStream> command_stream(adapters::Execute execute, std::string body) {
  return std::make_unique<CommandStream>(std::move(execute), std::move(body));
}

}  // namespace cbcan::web
