// SPDX-License-Identifier: MIT
#include "app/state_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::app {

namespace {

std::string_view mapped(int file, std::size_t size) {
  if (size == 0) return {};
  void* const memory = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0);
  return memory == MAP_FAILED ? std::string_view()  // NOLINT: an integer as a pointer
                              : std::string_view(static_cast<const char*>(memory), size);
}

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

/// A last line without its end gets one.
StateFile::StateFile(const std::string& path) : Kept("--state " + path) {
  if (path.empty()) return;
  file_ = io::Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (!file_) fail();
  const Locked lock(file_.get());
  const off_t all = size();
  text_ = mapped(file_.get(), static_cast<std::size_t>(std::max<off_t>(all, 0)));
  if (all != static_cast<off_t>(text_.size())) fail();
  const std::size_t kept = read(text_);
  if (kept != text_.size() && ::ftruncate(file_.get(), static_cast<off_t>(kept)) != 0) fail();
  if (kept == text_.size() && kept != 0 && text_.back() != '\n') write("\n");
}

StateFile::~StateFile() {
  if (file_) ::fdatasync(file_.get());
  if (!text_.empty())
    ::munmap(const_cast<char*>(text_.data()), text_.size());  // NOLINT: it is not written to
}

/// The subject's line again where another one may have written.
void StateFile::add(const search::KeptRun& run) {
  if (!file_) return;
  const Locked lock(file_.get());
  const bool is_below = size() == end_ && written_ == heading();
  write((is_below ? "" : heading()) + search::state_line(run));
  end_ = size();
  written_ = heading();
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
