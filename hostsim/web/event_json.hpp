// SPDX-License-Identifier: MIT
#pragma once

/// Events of the journal as JSON, and the filter for them (docs/reference/http.md).

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/buffer.hpp"
#include "journal/event_text.hpp"
#include "journal/journal.hpp"

namespace cbcan::web {

using Json = nlohmann::ordered_json;
using Query = std::map<std::string, std::string, std::less<>>;

/// A number of the query, `standard` if it has none; throws plant::Refused.
std::uint64_t number_in(const Query& query, std::string_view key, std::uint64_t standard,
                        std::uint64_t highest, std::uint64_t lowest = 0);

class EventFilter {
 public:
  /// Uses `kinds` (`standard` without it), `network`, `node`, `service`, `transaction`, `failed` and `slow`;
  /// other keys are ignored. Throws plant::Refused.
  explicit EventFilter(const Query& query, journal::Kinds standard = journal::kAllKinds);
  /// The only kinds that can pass.
  journal::Kinds kinds() const { return kinds_; }
  /// An event of one of these kinds.
  bool passes(const journal::Event& event) const { return is_only_kinds_ || has_all(event); }
  /// No event before this one passes.
  bool begins_after(const journal::Event& event) const {
    return event.kind == journal::Kind::kBegun && event.transaction < transaction_;
  }

 private:
  bool has_all(const journal::Event& event) const;

  journal::Kinds kinds_;
  std::uint64_t network_;  ///< 0 = any; the same for the next two
  std::uint64_t node_;
  std::uint64_t transaction_;
  std::string service_;
  bool failed_;
  std::optional<Time> slow_;
  bool is_only_kinds_;  ///< none of the others is set
};

/// Appends an event as a JSON object.
void append_event(base::Buffer& to, std::uint64_t number, const journal::Event& event,
                  const journal::Journal& journal, const journal::FindName& find);

/// The latest events as server-sent events: the text of each is made once for all streams.
class EventTexts {
 public:
  /// Allocates all memory but that of texts of more than 1,500 characters; `journal` and `find` outlive this.
  EventTexts(const journal::Journal& journal, const journal::FindName& find);

  /// Valid until the next call.
  std::string_view of(std::uint64_t number) {
    Kept& kept = kept_[number % kEvents];
    if (kept.number != number) make(number, kept);
    return base::view(kept.text);
  }

 private:
  static constexpr std::size_t kEvents = 256;
  struct Kept {
    std::uint64_t number = 0;
    base::Buffer text;
  };
  void make(std::uint64_t number, Kept& kept);

  const journal::Journal& journal_;
  const journal::FindName& find_;
  std::vector<Kept> kept_;  ///< by number
};

/// Microseconds as seconds.
double seconds_of(Time time);

/// Always valid UTF-8.
std::string line_of(const Json& json);
/// Text as a JSON string.
std::string json_string(std::string_view text);

}  // namespace cbcan::web
