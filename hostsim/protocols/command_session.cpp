// SPDX-License-Identifier: MIT
#include <utility>

#include "protocols/dialogue.hpp"

namespace cbcan::protocols {

namespace {

class CommandSession final : public StreamSession {
 public:
  explicit CommandSession(const Execute& execute) : execute_(execute) {}

  void receive(std::string_view bytes) override {
    received_ += bytes;
    execute_received();
  }
  void end_input() override {
    ended_ = true;
    execute_received();
  }
  bool wants_more() const override { return received_.size() < kMostUnsent; }
  std::string_view unsent() const override { return dialogue_->unsent; }
  bool is_busy() const override { return dialogue_->waiting || !received_.empty(); }
  void sent(std::size_t count) override {
    dialogue_->unsent.erase(0, count);
    execute_received();
  }

 private:
  /// While the client has kMostUnsent characters to read, its lines wait, and no more are read.
  void execute_received() {
    std::string_view rest = received_;
    for (; !rest.empty() && !dialogue_->waiting && dialogue_->unsent.size() < kMostUnsent;
         rest.remove_prefix(1)) {
      if (rest.front() == '\n') {
        end_line();
      } else if (line_.size() <= kLongestCommand) {
        line_ += rest.front();
      }
    }
    received_.erase(0, received_.size() - rest.size());
    if (ended_ && received_.empty() && !std::exchange(line_, {}).empty())
      dialogue_->unsent += "error: the last line has no end, so it was not executed\n";
  }

  void end_line() {
    const std::string line = std::exchange(line_, {});
    std::string_view text = line;
    if (text.ends_with('\r')) text.remove_suffix(1);
    if (text.size() > kLongestCommand) {
      dialogue_->unsent += "error: a line of more than " + std::to_string(kLongestCommand) + " characters\n";
    } else if (!text.empty()) {
      dialogue_->unsent += execute_(text, dialogue_);
    }
  }

  Execute execute_;
  std::string received_;  ///< not yet processed
  std::string line_;
  bool ended_ = false;
  std::shared_ptr<Dialogue> dialogue_ = std::make_shared<Dialogue>();
};

}  // namespace

MakeSession command_sessions(Execute execute) {
  return [execute = std::move(execute)] { return std::make_unique<CommandSession>(execute); };
}

}  // namespace cbcan::protocols
