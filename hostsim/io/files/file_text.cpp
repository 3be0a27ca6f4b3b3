// SPDX-License-Identifier: MIT
#include "io/files/file_text.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>

#include "io/errors.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::io {

namespace {

/// Waits for it only where somebody has it open for writing. The errno: 0 = there was nothing wrong.
int read_some(int file, std::string& text) {
  std::array<char, 65536> part;
  ssize_t count = 0;
  while ((count = ::read(file, part.data(), part.size())) < 0 && is_temporary(errno)) {
    pollfd readable{file, POLLIN, 0};
    ::poll(&readable, 1, -1);
  }
  if (count > 0) text.append(part.data(), static_cast<std::size_t>(count));
  return count < 0 ? errno : 0;
}

bool is_pipe(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISFIFO(status.st_mode);
}

}  // namespace

std::optional<std::string> read_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file) return std::nullopt;
  std::string text;
  for (bool at_end = false; !at_end;) {
    const std::size_t before = text.size();
    if (read_some(file.get(), text) != 0) return std::nullopt;
    at_end = text.size() == before;
    if (text.size() > kMostFileBytes)
      throw UsageError(path + ": more than 16 MiB; write a plant, EDS or parameter file");
    if (text.empty() && is_pipe(file.get()))
      throw UsageError(path + ": a pipe that no program writes to; name a file, or start its writer first");
  }
  return text;
}

void write_file(const std::string& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw EnvironmentError(path + ": " + reason(errno) + "; write another file");
}

}  // namespace cbcan::io
