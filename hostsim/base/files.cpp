// SPDX-License-Identifier: MIT
#include "base/files.hpp"

#include <filesystem>

namespace cbcan::base {

bool is_absolute(std::string_view path) {
  const bool has_drive = path.size() > 2 && path[1] == ':' && (path[2] == '/' || path[2] == '\\');
  return path.starts_with('/') || has_drive;
}

std::string path_in(const std::string& file_name, std::string_view path) {
  if (is_absolute(path)) return std::filesystem::path(path).lexically_normal().string();
  return (std::filesystem::path(file_name).parent_path() / path).lexically_normal().string();
}

}  // namespace cbcan::base
