// SPDX-License-Identifier: MIT
#include "io/can/candump_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <iterator>
#include <utility>

#include "sim/frame_text.hpp"

namespace cbcan::io {

namespace {

constexpr std::size_t kPendingLimit = 65536;

}  // namespace

void append_candump_line(std::string& text, const Frame& frame, Time time, std::string_view interface) {
  fmt::format_to(std::back_inserter(text), "({:010}.{:06}) {} ", time / kSecond, time % kSecond, interface);
  sim::append_frame(text, frame);
  text += '\n';
}

CandumpLog::CandumpLog(std::string path, std::string interface, Time wall_offset, Warn warn)
    : path_(std::move(path)),
      interface_(std::move(interface)),
      wall_offset_(wall_offset),
      warn_(std::move(warn)),
      file_(open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  if (!file_) throw EnvironmentError("log " + path_ + ": " + reason(errno) + "; write another file");
}

void CandumpLog::on_bus_frame(const Frame& frame, Time now) {
  if (!file_) {
    ++counters_.dropped;
    return;
  }
  append_candump_line(pending_, frame, now + wall_offset_, interface_);
  ++pending_frames_;
  if (pending_.size() >= kPendingLimit) flush();
}

void CandumpLog::flush() {
  std::string_view rest = pending_;
  while (!rest.empty()) {
    const ssize_t count = ::write(file_.get(), rest.data(), rest.size());
    if (count > 0)
      rest.remove_prefix(static_cast<std::size_t>(count));
    else if (count == 0 || errno != EINTR)
      return give_up(errno);
  }
  counters_.frames += pending_frames_;
  pending_frames_ = 0;
  pending_.clear();
}

void CandumpLog::give_up(int error) {
  counters_.dropped += std::exchange(pending_frames_, 0);
  pending_.clear();
  file_.reset();
  warn_("log " + path_ + ": " + reason(error) +
        "; the log ends here, the simulation goes on; make room, or write it to another disk");
}

}  // namespace cbcan::io
