// SPDX-License-Identifier: MIT
#include "app/state_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "base/read_file.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::app {

namespace {

/// The only one that reads or writes the file.
class Locked {
 public:
  explicit Locked(int file) : file_(file) {
    while (::flock(file_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~Locked() { ::flock(file_, LOCK_UN); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  int file_;
};

}  // namespace

/// A last line without its end is one that a crash of the machine has cut; otherwise it gets one.
StateFile::StateFile(const std::string& path) : name_("--state " + path) {
  if (path.empty()) return;
  file_ = io::Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (!file_) fail();
  const Locked lock(file_.get());
  const std::string text = base::read_file(path).value_or("");
  const std::size_t whole = text.rfind('\n') + 1;  // 0 if there is none
  try {
    state_ = search::parse_state(text, name_);
    if (whole != text.size()) write("\n");
  } catch (const io::UsageError&) {
    if (whole == 0 || whole == text.size()) throw;
    state_ = search::parse_state(std::string_view(text).substr(0, whole), name_);
    if (::ftruncate(file_.get(), static_cast<off_t>(whole)) != 0) fail();
  }
}

StateFile::~StateFile() {
  if (file_) ::fdatasync(file_.get());
}

void StateFile::begin(const std::string& subject, const std::string& fingerprint) {
  known_ = &state_.try_emplace(subject, search::KeptResults{fingerprint, {}}).first->second;
  if (known_->fingerprint != fingerprint)
    throw io::UsageError(
        fmt::format("{}: is of another program, plant, command or version; name a new file", name_));
  heading_ = search::state_line(subject, fingerprint);
  end_ = -1;
}

const search::Result* StateFile::find(const std::string& moments) const {
  const auto found = known_->runs.find(moments);
  return found == known_->runs.end() ? nullptr : &found->second;
}

/// The subject's line again where another one may have written.
void StateFile::add(const std::string& moments, const search::Result& result) {
  if (!file_) return;
  const Locked lock(file_.get());
  write((size() == end_ ? "" : heading_) + search::state_line(moments, result));
  end_ = size();
  if (io::Reactor::now() - synced_ < kSecond) return;
  synced_ = io::Reactor::now();
  ::fdatasync(file_.get());
}

off_t StateFile::size() const {
  struct stat now {};
  return ::fstat(file_.get(), &now) == 0 ? now.st_size : -1;
}

/// All or nothing.
void StateFile::write(const std::string& lines) {
  const off_t before = size();
  if (::write(file_.get(), lines.data(), lines.size()) == static_cast<ssize_t>(lines.size())) return;
  const int wrong = errno;
  if (::ftruncate(file_.get(), before) == 0) errno = wrong;
  fail();
}

void StateFile::fail() const {
  throw io::EnvironmentError(fmt::format("{}: {}; name another file", name_, io::reason(errno)));
}

}  // namespace cbcan::app
