// SPDX-License-Identifier: MIT
#include "app/state_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

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

class StateFile final : public search::Kept {
 public:
  /// A last line without its end gets one.
  explicit StateFile(const std::string& path) : Kept("--state " + path) {
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
  ~StateFile() override {
    if (file_) ::fdatasync(file_.get());
    if (!text_.empty())
      ::munmap(const_cast<char*>(text_.data()), text_.size());  // NOLINT: it is not written to
  }
  StateFile(const StateFile&) = delete;
  StateFile& operator=(const StateFile&) = delete;

  /// The subject's line again where another one may have written.
  void add(const search::KeptRun& run) override {
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

 private:
  off_t size() const {
    struct stat now {};
    return ::fstat(file_.get(), &now) == 0 ? now.st_size : -1;
  }

  /// All or nothing.
  void write(const std::string& lines) {
    const off_t before = size();
    if (::write(file_.get(), lines.data(), lines.size()) == static_cast<ssize_t>(lines.size())) return;
    const int wrong = errno;
    if (::ftruncate(file_.get(), before) == 0) errno = wrong;
    fail();
  }

  [[noreturn]] void fail() const {
    throw io::EnvironmentError(fmt::format("{}: {}; name another file", name_, io::reason(errno)));
  }

  io::Descriptor file_;
  std::string_view text_;  ///< of the file, which is mapped: there may be a million runs
  off_t end_ = 0;          ///< of the file after the last line that was written here
  std::string written_;    ///< the last subject's line
  Time synced_ = 0;
};

}  // namespace

std::unique_ptr<search::Kept> open_state_file(const std::string& path) {
  return std::make_unique<StateFile>(path);
}

}  // namespace cbcan::app
