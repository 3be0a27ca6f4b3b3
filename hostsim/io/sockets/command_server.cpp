// SPDX-License-Identifier: MIT
#include "io/sockets/command_server.hpp"

#include <utility>

namespace cbcan::io {

class CommandServer::Session final : public StreamSession {
 public:
  explicit Session(const Execute& execute) : execute_(execute) {}

  void receive(std::string_view bytes) override {
    for (const char c : bytes) {
      if (c == '\n') {
        end_line();
      } else if (line_.size() <= kLongestLine) {
        line_ += c;
      }
    }
  }
  std::string_view unsent() const override { return unsent_; }
  void sent(std::size_t count) override { unsent_.erase(0, count); }

 private:
  void end_line() {
    const std::string line = std::exchange(line_, {});
    std::string_view text = line;
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.size() > kLongestLine) {
      unsent_ += "error: a line of more than " + std::to_string(kLongestLine) + " characters\n";
    } else if (!text.empty()) {
      unsent_ += execute_(text);
    }
  }

  const Execute& execute_;
  std::string line_;
  std::string unsent_;
};

CommandServer::CommandServer(Reactor& reactor, const StreamAddress& address, Execute execute, Warn warn)
    : execute_(std::move(execute)),
      server_(
          reactor, "control", address, [this] { return std::make_unique<Session>(execute_); },
          std::move(warn)) {}

}  // namespace cbcan::io
