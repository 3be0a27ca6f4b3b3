// SPDX-License-Identifier: MIT
#pragma once

/// The page for browsers, hostsim/page, which is part of the program.

#include <optional>
#include <span>
#include <string_view>

#include "io/http/http_server.hpp"

namespace cbcan::app {

struct PageFile {
  std::string_view name;
  std::string_view text;
};

/// In the order of their names; cmake/embed.cmake makes them.
std::span<const PageFile> page_files();

/// The file at `path`, "/" or "/page.js"; none where there is no such file.
std::optional<io::HttpResponse> page_at(std::string_view path);

}  // namespace cbcan::app
