// SPDX-License-Identifier: MIT
#include "config/demo_plant.hpp"

#include <algorithm>
#include <utility>

namespace cbcan::config {
namespace {

constexpr std::string_view kFolder = "demo:/";

std::optional<std::string> read_demo_file(std::string_view name) {
  const auto file = std::ranges::find(demo_files(), name, &EmbeddedFile::name);
  if (file == demo_files().end()) return std::nullopt;
  return std::string(file->text);
}

}  // namespace

text::FileReader with_demo_plant(text::FileReader disk) {
  return [disk = std::move(disk)](const std::string& path) {
    return path.starts_with(kFolder) ? read_demo_file(path.substr(kFolder.size())) : disk(path);
  };
}

}  // namespace cbcan::config
