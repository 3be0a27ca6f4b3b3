// SPDX-License-Identifier: MIT
#pragma once

/// The HTTP API, described in docs/reference/http.md.

#include <functional>
#include <string_view>

#include "journal/journal.hpp"
#include "plant/control.hpp"
#include "protocols/dialogue.hpp"
#include "protocols/http_message.hpp"
#include "web/event_json.hpp"

namespace cbcan::web {

class Api {
 public:
  /// What the API needs from the program; all of it outlives the API.
  struct Parts {
    plant::Control& control;
    const journal::FindName& find;
    protocols::Execute execute;     ///< executes a line of docs/reference/commands.md
    std::function<void()> advance;  ///< does what is due
    std::function<Json()> about;    ///< describes the program, for /api/time
    std::function<Json()> wires;    ///< those of the plant, for /api/wires
  };

  explicit Api(Parts parts) : parts_(std::move(parts)), texts_(parts_.control.journal(), parts_.find) {}

  protocols::HttpResponse respond(const protocols::HttpRequest& request);

 private:
  Parts parts_;
  EventTexts texts_;
};

}  // namespace cbcan::web
