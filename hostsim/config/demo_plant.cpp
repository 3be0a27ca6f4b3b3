// SPDX-License-Identifier: MIT
#include "config/plant_file.hpp"

#include <algorithm>

#include "devices/devices.hpp"

namespace cbcan::config {
namespace {

constexpr std::string_view kFolder = "demo:/";

std::optional<std::string> read_embedded(std::span<const EmbeddedFile> files, std::string_view name) {
  const auto file = std::ranges::find(files, name, &EmbeddedFile::name);
  if (file == files.end()) return std::nullopt;
  return std::string(file->text);
}

}  // namespace

base::FileReader with_demo_plant(base::FileReader disk) {
  return [disk = std::move(disk)](const std::string& path) {
    for (const auto& [folder, files] : {std::pair(kFolder, demo_files()), {devices::kShelf, shelf_files()}})
      if (path.starts_with(folder)) return read_embedded(files, path.substr(folder.size()));
    return disk(path);
  };
}

}  // namespace cbcan::config
