// SPDX-License-Identifier: MIT
#include "io/can/candump_log.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "sim/frame_text.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kCharactersPerWrite = 65536;

}  // namespace

CandumpLog::CandumpLog(std::string path, std::string interface, Time wall_offset, Warn warn,
                       std::size_t most_waiting)
    : path_(std::move(path)),
      interface_(std::move(interface)),
      wall_offset_(wall_offset),
      warn_(std::move(warn)),
      output_(Output::open("log", path_, most_waiting)),
      most_waiting_(most_waiting),
      flush_at_(kCharactersPerWrite) {}

CandumpLog::~CandumpLog() {
  flush();
  if (ended_) return;
  output_.finish();
  drop_rest();
  tell_dropped();
}

void CandumpLog::on_bus_frame(const Frame& frame, Time now) {
  if (output_.waiting() >= flush_at_) flush();
  if (ended_ || !output_.room()) {
    ++counters_.dropped;
    return;
  }
  sim::append_candump_line(output_.text(), frame, now + wall_offset_, interface_);
  ++counters_.frames;
}

void CandumpLog::flush() {
  if (ended_) return;
  if (const int error = output_.flush(); error != 0) {
    drop_rest();
    ended_ = true;
    return warn_("log " + path_ + ": " + reason(error) +
                 "; the log ends here, the simulation goes on; make room, or write it to another disk");
  }
  flush_at_ = std::min(output_.waiting() + kCharactersPerWrite, most_waiting_);
  if (output_.waiting() == 0) tell_dropped();
}

void CandumpLog::tell_dropped() {
  if (counters_.dropped == told_) return;
  warn_(fmt::format("log {}: {} frames are missing: they were not read in time", path_,
                    counters_.dropped - told_));
  told_ = counters_.dropped;
}

/// A line that was written in part counts as dropped too.
void CandumpLog::drop_rest() {
  const auto lines = static_cast<std::uint64_t>(std::ranges::count(output_.take_rest(), '\n'));
  counters_.frames -= lines;
  counters_.dropped += lines;
}

}  // namespace cbcan::io
