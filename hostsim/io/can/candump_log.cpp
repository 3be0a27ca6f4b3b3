// SPDX-License-Identifier: MIT
#include "io/can/candump_log.hpp"

#include <algorithm>
#include <utility>

#include "sim/frame_text.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kCharactersPerWrite = 65536;

}  // namespace

CandumpLog::CandumpLog(const std::string& path, std::string interface, Time wall_offset, Warn warn,
                       std::size_t most_waiting)
    : where_("log " + path + ": "),
      interface_(std::move(interface)),
      wall_offset_(wall_offset),
      warn_(std::move(warn)),
      output_(Output::open("log", path, most_waiting)),
      most_waiting_(most_waiting),
      flush_at_(kCharactersPerWrite) {}

CandumpLog::~CandumpLog() {
  flush();
  if (ended_) return;
  output_.finish();
  dropped_ += static_cast<std::uint64_t>(std::ranges::count(output_.take_rest(), '\n'));
  warn_of_missing(warn_, where_, dropped_, "frames");
}

void CandumpLog::on_bus_frame(const Frame& frame, Time now) {
  if (output_.waiting() >= flush_at_) flush();
  if (ended_ || !output_.room())
    ++dropped_;
  else
    sim::append_candump_line(output_.text(), frame, now + wall_offset_, interface_);
}

void CandumpLog::flush() {
  if (ended_) return;
  if (const int error = output_.flush(); error != 0) {
    output_.take_rest();
    ended_ = true;
    return warn_(where_ + reason(error) +
                 "; the log ends here, the simulation goes on; make room, or write it to another disk");
  }
  flush_at_ = std::min(output_.waiting() + kCharactersPerWrite, most_waiting_);
  if (output_.waiting() == 0) warn_of_missing(warn_, where_, dropped_, "frames");
}

}  // namespace cbcan::io
