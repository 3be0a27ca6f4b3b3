// SPDX-License-Identifier: MIT
#include "app/views.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "text/numbers.hpp"

namespace cbcan::app {

using journal::Event;
using journal::Kind;

journal::FindName names_of(plant::Control& control) {
  return [&control](std::uint8_t network, std::uint8_t id, std::uint16_t index,
                    std::uint8_t sub) -> const eds::ObjectName* {
    for (const auto& node : control.network(network).world().nodes())
      if (node->device().node_id() == id) return eds::find_name(node->names(), index, sub);
    return nullptr;
  };
}

Trace::Trace(plant::Control& control, journal::FindName find, bool frames,
             std::function<void(std::string_view)> tell)
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

Recorder::Recorder(const std::string& path, const std::string& plant, plant::Control& control,
                   journal::FindName find)
    : control_(control),
      writer_(control, std::move(find)),
      file_(io::Output::open("record", path)),
      cursor_(control.journal(), journal::kinds_of({Kind::kEnded, Kind::kCommand})) {
  file_.add(scenario::ScenarioWriter::opening(plant));
  file_.flush();
}

void Recorder::on_written(std::size_t network, std::size_t first, std::span<const std::uint16_t> words) {
  poll();
  file_.add(writer_.written(control_.now(), network, first, words));
  file_.flush();
}

void Recorder::poll() {
  cursor_.look([this](std::uint64_t /*number*/, const Event& event) {
    file_.add(writer_.text_of(event));
    file_.flush();
    return true;
  });
}

std::string packet_comment(const Event& event, const journal::Journal& journal,
                           const journal::FindName& find) {
  const bool told = event.kind == Kind::kBegun || event.kind == Kind::kEnded || event.kind == Kind::kFault;
  if (told) return text_of(event, journal, find);
  const bool is_packet = event.kind == Kind::kModbus || event.kind == Kind::kFrame;
  return is_packet && event.transaction != 0 ? fmt::format("transaction {}", event.transaction) : "";
}

}  // namespace cbcan::app
