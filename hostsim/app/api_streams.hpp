// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "app/event_json.hpp"
#include "io/http/http_server.hpp"
#include "io/sockets/command_session.hpp"
#include "plant/control.hpp"

namespace cbcan::app {

/// Server-sent events from `next` on that the query wants, and the values that it watches. Throws
/// plant::Refused. Control and names outlive it.
std::unique_ptr<io::HttpStream> event_stream(plant::Control& control, const journal::FindName& find,
                                             const Query& query, std::uint64_t next);

/// Executes the lines of `body` one after the other; each waits for the response to the one before.
std::unique_ptr<io::HttpStream> command_stream(io::Execute execute, std::string body);

}  // namespace cbcan::app
