// SPDX-License-Identifier: MIT
#pragma once

/// The HTTP API, described in docs/reference/http.md.

#include <functional>
#include <string>

#include "plant/control.hpp"
#include "protocols/dialogue.hpp"
#include "protocols/http_site.hpp"
#include "web/event_json.hpp"

namespace cbcan::web {

/// What the API needs from the program; all of it outlives the API.
struct ApiParts {
  plant::Control& control;
  const journal::FindName& find;
  protocols::Execute execute;     ///< executes a line of docs/reference/commands.md
  std::function<void()> advance;  ///< does what is due
  std::function<Json()> about;    ///< describes the program, for /api/time
  std::string wires;              ///< the answer to /api/wires
};

protocols::HttpSite::Handler api_of(ApiParts parts);

}  // namespace cbcan::web
