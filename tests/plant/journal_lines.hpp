// SPDX-License-Identifier: MIT
#pragma once

#include "demo.hpp"
#include "journal/event_text.hpp"

namespace cbcan::plant::test {

/// Everything in the journal since the last call, with times and transactions.
class JournalLines {
 public:
  explicit JournalLines(VirtualPlant& plant) : journal_(plant.control().journal()), cursor_(journal_) {}

  std::vector<std::string> lines() {
    std::vector<std::string> lines;
    const auto no_name = [](auto...) -> const descriptions::Object* { return nullptr; };
    cursor_.look([&](std::uint64_t, const journal::Event& event) {
      lines.push_back(base::seconds_text(event.at) + " " + text_of(event, journal_, no_name));
      return true;
    });
    return lines;
  }

 private:
  const journal::Journal& journal_;
  journal::Cursor cursor_;
};

}  // namespace cbcan::plant::test
