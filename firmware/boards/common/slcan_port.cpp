// SPDX-License-Identifier: MIT
#include "boards/common/slcan_port.hpp"

#include <array>

namespace cbcan::boards {

SlcanPort::SlcanPort(std::uint16_t kbit_per_second, Queue /*queue*/) : kbit_per_second_(kbit_per_second) {}

bool SlcanPort::put(std::string_view line) {
  if (to_send_.free() < line.size()) return false;
  for (const char c : line)
    to_send_.push(c);
  return true;
}

bool SlcanPort::try_send(const Frame& frame) {
  std::array<char, slcan::kMaxLine> line;
  const bool fits = put({line.data(), slcan::encode(frame, line)});
  count(fits ? counters_.sent : counters_.refused);
  return fits;
}

bool SlcanPort::receive(Frame& frame) {
  using Event = slcan::LineReader::Event;
  char c;
  while (received_.pop(c)) {
    const Event event = reader_.on_char(c);
    if (event != Event::kNone) hear(event != Event::kBell);
    if (event == Event::kBell || event == Event::kLost) count(counters_.errors);
    if (event != Event::kLine) continue;
    if (slcan::decode(reader_.line(), frame)) {
      count(counters_.received);
      return true;
    }
    if (kServices.adapter_state) on_line(reader_.line());
  }
  return false;
}

/// A line that is no frame: a state, or a response to a command.
void SlcanPort::on_line(std::string_view line) {
  const auto state = slcan::decode_state(line);
  if (!state) {
    const bool response = line.empty() || line == "z" || line == "Z";
    if (!response) ++counters_.errors;
  } else if (line.front() == 's') {
    unasked_ = *state;
  } else {
    status_ = *state;
    answers_status_ = true;
    silent_ = 1;
    off_ = false;
  }
}

/// Any reception. The last response to the open commands shows whether the adapter is open; a "no" from a
/// closed adapter is no sign of life.
void SlcanPort::hear(bool yes) {
  if (kServices.adapter_state) {
    if (answers_status_) return;
    if (opening_)
      open_ = yes;
    else if (yes)
      off_ = false;
    yes |= !off_;
  }
  if (yes) silent_ = 1;
}

Time SlcanPort::poll(Time now) {
  if (now < due_) return due_;
  const bool opens = silent_ == 0;
  if (kServices.adapter_state) {
    if (opens)
      off_ = due_ != 0;  // silent, unless this is the first poll
    else if (opening_ && open_)
      off_ = !*open_;
    opening_ = opens;
    open_.reset();
  }
  const slcan::OpenCommands commands = slcan::encode_open(kbit_per_second_);
  put(opens ? std::string_view(commands.data(), commands.size()) : slcan::kAskStatus);
  due_ = now + kStatusInterval;
  silent_ = static_cast<std::uint8_t>((silent_ + 1) % kSilentPolls);
  return due_;
}

CanCounters SlcanPort::counters() const {
  CanCounters counters = counters_;
  counters.lost = received_.overflows();
  return counters;
}

}  // namespace cbcan::boards
