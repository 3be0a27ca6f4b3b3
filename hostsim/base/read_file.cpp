// SPDX-License-Identifier: MIT
#include "base/read_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <numeric>
#include <set>

#include "base/error.hpp"
#include "base/files.hpp"

namespace cbcan::base {

namespace {

/// Blocks only while a writer has a pipe open. Returns errno; 0 = success.
int read_some(int file, std::string& text) {
  std::array<char, 65536> part;
  ssize_t count = 0;
  while ((count = ::read(file, part.data(), part.size())) < 0 && (errno == EAGAIN || errno == EINTR)) {
    pollfd readable{file, POLLIN, 0};
    ::poll(&readable, 1, -1);
  }
  if (count > 0) text.append(part.data(), static_cast<std::size_t>(count));
  return count < 0 ? errno : 0;
}

struct Closed {
  explicit Closed(int number) : file(number) {}
  Closed(const Closed&) = delete;
  Closed& operator=(const Closed&) = delete;
  ~Closed() { ::close(file); }
  int file;
};

std::string read_all(int file, const std::string& path) {
  std::string text;
  for (bool at_end = false; !at_end;) {
    const std::size_t before = text.size();
    if (read_some(file, text) != 0) throw UsageError(path + ": cannot be read");
    at_end = text.size() == before;
    if (text.size() > kMostFileBytes) throw UsageError(path + kTooLong);
    if (text.empty() && type_of(file) == S_IFIFO)
      throw UsageError(path +
                             ": a pipe that no program writes to; name a file, or start its writer first");
  }
  return text;
}

std::string names_in(const std::string& folder) {
  std::set<std::string> names;
  std::error_code unreadable;  // while it is read, names may go
  for (const auto& entry : std::filesystem::directory_iterator(folder, unreadable))
    if (!entry.is_directory(unreadable)) names.insert(entry.path().filename().string() + "\n");
  return std::accumulate(names.begin(), names.end(), std::string());
}

}  // namespace

mode_t type_of(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 ? status.st_mode & S_IFMT : 0;
}

std::optional<std::string> read_file(const std::string& path) {
  const int number = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (number < 0 && (errno == EMFILE || errno == ENFILE))
    throw std::runtime_error(path + ": Too many open files; raise the limit with `ulimit -n`");
  if (number < 0) return std::nullopt;
  const Closed closed(number);
  if (type_of(number) == S_IFDIR && path.ends_with('/')) return names_in(path);
  if (type_of(number) == S_IFDIR) throw UsageError(path + ": this is a folder; name a file in it");
  return read_all(number, path);
}

}  // namespace cbcan::base
