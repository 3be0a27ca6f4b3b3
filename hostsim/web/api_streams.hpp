// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "adapters/dialogue.hpp"
#include "adapters/http_message.hpp"
#include "plant/control.hpp"
#include "web/event_json.hpp"

namespace cbcan::web {

/// Server-sent events from number `next` on that match the query, and the values that it watches. Throws
/// plant::Refused. Control and names outlive it.
std::unique_ptr<adapters::HttpStream> event_stream(plant::Control& control, const journal::FindName& find,
                                                   const Query& query, std::uint64_t next);

/// Executes the lines of `body` one after the other; each waits for the response to the one before.
std::unique_ptr<adapters::HttpStream> command_stream(adapters::Execute execute, std::string body);

}  // namespace cbcan::web
