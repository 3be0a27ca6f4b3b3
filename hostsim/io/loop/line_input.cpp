// SPDX-License-Identifier: MIT
#include "io/loop/line_input.hpp"

#include <array>
#include <cerrno>
#include <utility>

#include "io/loop/system.hpp"

namespace cbcan::io {

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
