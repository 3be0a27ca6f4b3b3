// SPDX-License-Identifier: MIT
#include "io/loop/lines.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <limits.h>
#include <poll.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <utility>

#include "base/read_file.hpp"

namespace cbcan::io {

namespace {

constexpr int kPatienceMs = 1000;

bool is_ready(int file, int timeout_ms) {
  pollfd ready{file, POLLOUT, 0};
  return ::poll(&ready, 1, timeout_ms) == 1;
}

/// Lines go to the end, also of a file that another program has cut.
Descriptor opened(const std::string& path, Output::Content content) {
  constexpr int kFlags = O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
  constexpr mode_t kMode = 0644;
  const int flags = kFlags | (content == Output::Content::kReplaced ? O_TRUNC : 0);
  Descriptor file(::open(path.c_str(), O_WRONLY | flags, kMode));
  if (!file && errno == ENXIO) file = Descriptor(::open(path.c_str(), O_RDWR | flags, kMode));
  return file;
}

}  // namespace

Output::Output(Descriptor file, std::size_t most_waiting)
    : file_(std::move(file)),
      most_waiting_(most_waiting),
      may_block_((fcntl(file_.get(), F_GETFL) & O_NONBLOCK) == 0 && base::type_of(file_.get()) != S_IFREG) {}

Output Output::open(std::string_view what, const std::string& path, std::size_t most_waiting,
                    Content content) {
  if (path == "-") return standard(1, most_waiting);
  Descriptor file = opened(path, content);
  if (!file)
    throw EnvironmentError(std::string(what) + " " + path + ": " + reason(errno) + "; write another file");
  Output output(std::move(file), most_waiting);
  output.path_ = path;
  return output;
}

/// Opened again if possible: O_NONBLOCK would affect every process that shares the descriptor.
Output Output::standard(int number, std::size_t most_waiting) {
  const mode_t type = base::type_of(number);
  const std::string path = "/proc/self/fd/" + std::to_string(number);
  Descriptor file;
  if (type == S_IFIFO || type == S_IFCHR)
    file = Descriptor(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file) file = Descriptor(fcntl(number, F_DUPFD_CLOEXEC, 0));
  if (!file) file = Descriptor(number);  // no descriptor left: messages are still written
  return Output(std::move(file), most_waiting);
}

bool Output::add(std::string_view lines) {
  if (!room()) return false;
  waiting_ += lines;
  return true;
}

int Output::flush() {
  while (waiting() != 0) {
    const ssize_t count = write_some(rest());
    if (count > 0) {
      sent_ += static_cast<std::size_t>(count);
    } else if (count < 0 && errno == EAGAIN) {
      break;
    } else if (count == 0 || errno != EINTR) {
      return errno;
    }
  }
  if (2 * sent_ >= waiting_.size()) {  // the rest is moved seldom
    waiting_.erase(0, sent_);
    sent_ = 0;
  }
  return 0;
}

/// A descriptor that is ready for writing takes PIPE_BUF characters without blocking.
ssize_t Output::write_some(std::string_view text) const {
  if (may_block_) {
    if (!is_ready(file_.get(), 0)) return errno = EAGAIN, -1;
    text = text.substr(0, PIPE_BUF);
  }
  return ::write(file_.get(), text.data(), text.size());
}

std::string Output::take_rest() {
  std::string rest = waiting_.substr(sent_);
  waiting_.clear();
  sent_ = 0;
  return rest;
}

void Output::finish() {
  while (flush() == 0 && waiting() != 0 && is_ready(file_.get(), kPatienceMs)) {
  }
}

bool Output::is_file() const {
  return !path_.empty() && base::type_of(file_.get()) == S_IFREG;
}

std::uint64_t Output::size() const {
  struct stat now {};
  return ::fstat(file_.get(), &now) == 0 ? static_cast<std::uint64_t>(now.st_size) : 0;
}

int Output::reopen(Content content) {
  Descriptor file = opened(path_, content);
  if (!file) return errno;
  file_ = std::move(file);
  return 0;
}

int Output::turn_over(const Warn& warn, const std::string& where) {
  if (std::rename(path_.c_str(), (path_ + ".1").c_str()) != 0)
    warn(where + reason(errno) + "; it begins again in the same place");
  return reopen(Content::kReplaced);
}

void warn_of_missing(const Warn& warn, const std::string& where, std::uint64_t& count,
                     std::string_view what) {
  if (count != 0) warn(fmt::format("{}{} {} are missing: they were not read in time", where, count, what));
  count = 0;
}

LineInput::LineInput(Reactor& reactor) : reactor_(reactor) {
  watch();
  is_file_ = !watched_;
}

void LineInput::watch() {
  watched_ = reactor_.watch(STDIN_FILENO, Reactor::kReadable, [this](std::uint32_t) { read(); });
}

std::optional<std::string> LineInput::take() {
  if (lines_.empty()) return std::nullopt;
  std::string line = std::move(lines_.front());
  lines_.pop_front();
  if (lines_.empty() && !is_file_ && !watched_ && !closed_) watch();
  return line;
}

void LineInput::read() {
  std::array<char, 4096> text;
  const ssize_t count = ::read(STDIN_FILENO, text.data(), text.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
  if (count < 0) throw EnvironmentError("standard input: " + reason(errno));
  if (count > 0) split({text.data(), static_cast<std::size_t>(count)});
  closed_ = count == 0;
  if (watched_ && (closed_ || !has_room())) {
    reactor_.forget(STDIN_FILENO);
    watched_ = false;
  }
  if (!closed_) return;
  if (!half_.empty()) lines_.push_back(std::exchange(half_, {}));
}

void LineInput::split(std::string_view text) {
  for (const char c : text) {
    if (c == '\n')
      lines_.push_back(std::exchange(half_, {}));
    else if (half_.size() < kLongestLine)
      half_ += c;
    else
      throw UsageError("standard input: a line of more than " + std::to_string(kLongestLine) + " characters");
  }
}

}  // namespace cbcan::io
