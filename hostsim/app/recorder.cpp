// SPDX-License-Identifier: MIT
#include "app/recorder.hpp"

#include <utility>

namespace cbcan::app {

using journal::Event;
using journal::Kind;

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

}  // namespace cbcan::app
