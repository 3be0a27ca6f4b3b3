// SPDX-License-Identifier: MIT
#pragma once

/// Events of the journal as JSON, and the filter for them (docs/reference/http.md).

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "journal/journal.hpp"
#include "journal/words.hpp"

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
  bool passes(const journal::Event& event) const;

 private:
  journal::Kinds kinds_;
  std::uint64_t network_;  ///< 0 = any; the same for the next two
  std::uint64_t node_;
  std::uint64_t transaction_;
  std::string service_;
  bool failed_;
  std::optional<Time> slow_;
};

Json event_json(std::uint64_t number, const journal::Event& event, const journal::Journal& journal,
                const journal::FindName& find);

/// Microseconds as seconds.
double seconds_of(Time time);

/// Always valid UTF-8.
std::string line_of(const Json& json);

}  // namespace cbcan::web
