// SPDX-License-Identifier: MIT
#include "session/views.hpp"

#include <utility>

namespace cbcan::session {

using journal::Event;
using journal::Kind;
using base::append;

Trace::Trace(plant::Control& control, journal::FindName find, bool frames, Tell tell)
    : control_(control),
      find_(std::move(find)),
      tell_(std::move(tell)),
      cursor_(control.journal(), journal::kinds_of({Kind::kEnded, Kind::kState, Kind::kEmergency}) |
                                     (frames ? journal::kinds_of({Kind::kFrame}) : 0)) {}

void Trace::poll() {
  const std::uint64_t missed = cursor_.look([this](std::uint64_t /*number*/, const Event& event) {
    append(lines_, "cbcan-sim: ", base::Seconds{event.at}, ' ');
    if (control_.networks() != 1) append(lines_, "network ", event.network, ": ");
    append_text(lines_, event, control_.journal(), find_);
    append(lines_, '\n');
    return true;
  });
  if (missed != 0) append(lines_, "cbcan-sim: ", missed, " events are missing here\n");
  if (lines_.size() != 0) tell_(base::view(lines_));
  lines_.clear();
}

Recorder::Recorder(plant::Control& control, journal::FindName find, const std::string& plant, Tell tell)
    : control_(control),
      writer_(control, std::move(find)),
      tell_(std::move(tell)),
      cursor_(control.journal(), journal::kinds_of({Kind::kEnded, Kind::kCommand})) {
  tell_(scenario::ScenarioWriter::opening(plant));
}

void Recorder::on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words) {
  poll();
  tell_(writer_.written(control_.now(), network, first, words));
}

void Recorder::poll() {
  cursor_.look([this](std::uint64_t /*number*/, const Event& event) {
    tell_(writer_.text_of(event));
    return true;
  });
}

}  // namespace cbcan::session
