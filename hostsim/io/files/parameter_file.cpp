// SPDX-License-Identifier: MIT
#include "io/files/parameter_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/read_file.hpp"
#include "io/loop/system.hpp"

namespace cbcan::io {

namespace {

/// Makes sure that a rename is on the disk.
bool sync_folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const Descriptor opened(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return opened && ::fsync(opened.get()) == 0;
}

/// Always creates a new file, so that a link at this path does not redirect the writing.
bool write_whole(const std::string& path, const std::string& text) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return false;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wbx"), std::fclose);
  if (!file) return false;
  return std::fwrite(text.data(), 1, text.size(), file.get()) == text.size() &&
         std::fflush(file.get()) == 0 && ::fsync(::fileno(file.get())) == 0;
}

}  // namespace

std::optional<std::string> ParameterFile::text_of(const std::string& path) {
  std::optional<std::string> text = base::read_file(path);
  if (!text && ::access(path.c_str(), F_OK) == 0)
    throw UsageError(path + ": this file with stored parameters cannot be read; check its permissions");
  return text;
}

bool ParameterFile::write(const std::string& text) {
  const std::string fresh = path_ + ".new";
  if (write_whole(fresh, text) && std::rename(fresh.c_str(), path_.c_str()) == 0 && sync_folder_of(path_))
    return true;
  warn_(path_ + ": parameters could not be stored: " + reason(errno));
  static_cast<void>(::unlink(fresh.c_str()));
  return false;
}

}  // namespace cbcan::io
