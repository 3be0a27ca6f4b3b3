// SPDX-License-Identifier: MIT
#include "session/views.hpp"

#include <fmt/core.h>

#include <utility>

#include "text/numbers.hpp"

namespace cbcan::session {

using journal::Event;
using journal::Kind;

Trace::Trace(plant::Control& control, journal::FindName find, bool frames, Tell tell)
    : control_(control),
      find_(std::move(find)),
      tell_(std::move(tell)),
      cursor_(control.journal(), journal::kinds_of({Kind::kEnded, Kind::kState, Kind::kEmergency}) |
                                     (frames ? journal::kinds_of({Kind::kFrame}) : 0)) {}

void Trace::poll() {
  std::string lines;
  const std::uint64_t missed = cursor_.look([&](std::uint64_t /*number*/, const Event& event) {
    lines += fmt::format("cbcan-sim: {} {}{}\n", text::seconds_text(event.at),
                         control_.networks() == 1 ? "" : fmt::format("network {}: ", event.network),
                         text_of(event, control_.journal(), find_));
    return true;
  });
  if (missed != 0) lines += fmt::format("cbcan-sim: {} events are missing here\n", missed);
  if (!lines.empty()) tell_(lines);
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
