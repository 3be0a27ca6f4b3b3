// SPDX-License-Identifier: MIT
#include "web/page.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace cbcan::web {

namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".svg", "image/svg+xml"},
}};

}  // namespace

std::optional<protocols::HttpResponse> page_at(std::string_view path) {
  const std::string_view name =
      path == "/" ? "index.html" : path.substr(std::min<std::size_t>(1, path.size()));
  const auto file = std::ranges::find(page_files(), name, &config::EmbeddedFile::name);
  if (file == page_files().end()) return std::nullopt;
  const auto type = std::ranges::find_if(kTypes, [&](const auto& row) { return name.ends_with(row.first); });
  return protocols::HttpResponse{
      .type = std::string(type == kTypes.end() ? "text/plain; charset=utf-8" : type->second),
      .body = std::string(file->text)};
}

}  // namespace cbcan::web
