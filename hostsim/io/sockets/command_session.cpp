// SPDX-License-Identifier: MIT
#include "io/sockets/command_session.hpp"

#include <utility>

namespace cbcan::io {

namespace {

class CommandSession final : public StreamSession {
 public:
  explicit CommandSession(const Execute& execute) : execute_(execute) {}

  void receive(std::string_view bytes) override {
    received_ += bytes;
    execute_received();
  }
  std::string_view unsent() const override { return unsent_; }
  void sent(std::size_t count) override {
    unsent_.erase(0, count);
    execute_received();
  }

 private:
  /// While the client has more to read than that, its lines wait, and no more are read.
  void execute_received() {
    std::string_view rest = received_;
    for (; !rest.empty() && unsent_.size() < StreamServer::kMostUnsent; rest.remove_prefix(1)) {
      if (rest.front() == '\n') {
        end_line();
      } else if (line_.size() <= kLongestCommand) {
        line_ += rest.front();
      }
    }
    received_.erase(0, received_.size() - rest.size());
  }

  void end_line() {
    const std::string line = std::exchange(line_, {});
    std::string_view text = line;
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.size() > kLongestCommand) {
      unsent_ += "error: a line of more than " + std::to_string(kLongestCommand) + " characters\n";
    } else if (!text.empty()) {
      unsent_ += execute_(text);
    }
  }

  Execute execute_;
  std::string received_;  ///< not yet looked at
  std::string line_;
  std::string unsent_;
};

}  // namespace

StreamServer::MakeSession command_sessions(Execute execute) {
  return [execute = std::move(execute)] { return std::make_unique<CommandSession>(execute); };
}

}  // namespace cbcan::io
