// SPDX-License-Identifier: MIT
#pragma once

/// The page for browsers, hostsim/web/page, which is part of the program.

#include <optional>
#include <span>
#include <string_view>

#include "adapters/http_message.hpp"

namespace cbcan::web {

struct PageFile {
  std::string_view name;
  std::string_view text;
};

/// In the order of their names; cmake/embed.cmake makes them.
std::span<const PageFile> page_files();

/// The file at `path`, "/" or "/page.js"; none where there is no such file.
std::optional<adapters::HttpResponse> page_at(std::string_view path);

}  // namespace cbcan::web
