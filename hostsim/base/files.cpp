// SPDX-License-Identifier: MIT
#include "base/files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "base/text.hpp"

namespace cbcan::base {

namespace {

struct Kind {
  std::string_view name, use;
  std::string_view
      marks;  ///< words, one of which begins a line in such a file, and in none of the kinds after it
};
constexpr std::array kKinds{
    Kind{"an EDS or DCF file", "--node 5=FILE is a node made from it", "[FileInfo] [DeviceInfo]"},
    Kind{"a Lua device", "--node 5=FILE is a node made from it", ""},
    Kind{kScenario, "cbcan-sim run FILE plays it", "[[step]]"},
    Kind{kPlantFile, "cbcan-sim --config FILE takes it",
         "[module] [plc] [can] [log] [modbus] [rtu] [time] [random] [control] [http] [explore] [[wire]] "
         "[[network]] "
         "plant device"},
    Kind{kNetworkFile, "--network-file FILE takes it", "[network] [[node.pdos]] pdos identity on_loss"},
};

bool is_of(const Kind& kind, std::string_view path, std::string_view text) {
  if (kind.marks.empty()) return same_text(leaf_of(path), "lua");
  const auto marks = words_of(kind.marks);
  while (!text.empty()) {
    const std::string_view line = trim(take_line(text));
    const std::string_view begin = line.substr(0, line.find_first_of(" \t=#"));
    if (std::ranges::any_of(marks, [=](std::string_view mark) { return same_text(begin, mark); }))
      return true;
  }
  return false;
}

}  // namespace

bool is_absolute(std::string_view path) {
  const bool has_drive = path.size() > 2 && path[1] == ':' && (path[2] == '/' || path[2] == '\\');
  const bool is_port = path.size() > 3 && path.starts_with("COM") &&
                       path.find_first_not_of("0123456789", 3) == std::string_view::npos;
  return path.starts_with('/') || has_drive || is_port;
}

std::string path_in(const std::string& file_name, std::string_view path) {
  if (is_absolute(path)) return std::filesystem::path(path).lexically_normal().string();
  return (std::filesystem::path(file_name).parent_path() / path).lexically_normal().string();
}

std::string relative_path(const std::string& file_name, const std::string& path) {
  const auto folder = std::filesystem::path(file_name).lexically_normal().parent_path();
  return std::filesystem::path(path).lexically_normal().lexically_relative(folder).string();
}

std::string other_kind(std::string_view path, std::string_view text, std::string_view wanted) {
  const auto kind = std::ranges::find_if(kKinds, [&](const Kind& each) { return is_of(each, path, text); });
  const bool is_both = wanted == kNetworkFile && is_of(kKinds.back(), path, text);
  if (kind == kKinds.end() || kind->name == wanted || is_both) return {};
  return fmt::format("this is {}, not {}; {}", kind->name, wanted, kind->use);
}

}  // namespace cbcan::base
