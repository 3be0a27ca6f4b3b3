// SPDX-License-Identifier: MIT
#include "protocols/stream_session.hpp"

#include "support/catch.hpp"

namespace cbcan::io {

TEST_CASE("Command server: each line is executed once and answered in order, in pieces of any size") {
  std::vector<std::string> executed;
  const auto session = protocols::command_sessions([&](std::string_view line, const auto&) {
    executed.emplace_back(line);
    return "did " + std::string(line) + "\n";
  })();
  for (const char c : std::string("one\r\n\ntwo\nthr"))
    session->receive(std::string(1, c));
  CHECK(session->unsent() == "did one\ndid two\n");
  session->receive("ee\nfour\n");
  CHECK(session->unsent() == "did one\ndid two\ndid three\ndid four\n");
  session->receive(std::string(protocols::kLongestCommand, 'x') + "\n");
  session->receive(std::string(protocols::kLongestCommand + 1, 'y') + "\nz\n");
  CHECK(session->unsent().ends_with("x\nerror: a line of more than 1000 characters\ndid z\n"));
  CHECK(executed == std::vector<std::string>{"one", "two", "three", "four",
                                             std::string(protocols::kLongestCommand, 'x'), "z"});
}

TEST_CASE("Command server: lines wait while their client does not read, and all are answered when it does") {
  const std::string response(100'000, 'r');
  std::size_t executed = 0;
  const auto session = protocols::command_sessions([&](std::string_view, const auto&) {
    ++executed;
    return response;
  })();
  std::string lines;
  for (int i = 0; i < 500; ++i)
    lines += "faults\n";
  session->receive(lines);
  CHECK(executed == 1);
  std::size_t heard = 0;
  while (!session->unsent().empty()) {
    CHECK(session->unsent().size() < protocols::StreamSession::kMostUnsent + response.size());
    const std::size_t part = std::min<std::size_t>(50'000, session->unsent().size());
    session->sent(part);
    heard += part;
  }
  CHECK(executed == 500);
  CHECK(heard == 500 * response.size());
}

}  // namespace cbcan::io
