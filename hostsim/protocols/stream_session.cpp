// SPDX-License-Identifier: MIT
#include "protocols/stream_session.hpp"

#include <cstdint>
#include <utility>

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
        if (dialogue_->killed) return received_.clear();
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

using namespace std::string_view_literals;

enum class Browser : std::uint8_t { kRuledOut, kMaybe, kFound };

/// Whether the first bytes of a connection are an HTTP request (RFC 9110, 9.3) or, where clients send text, a
/// TLS handshake (RFC 8446, 5.1). No protocol that is served here begins like that.
Browser browser_in(std::string_view begin, bool text) {
  constexpr std::string_view kHandshake = "\x16\x03";
  Browser found = Browser::kRuledOut;
  for (const std::string_view first : {"GET "sv, "HEAD "sv, "POST "sv, "PUT "sv, "DELETE "sv, "CONNECT "sv,
                                       "OPTIONS "sv, "TRACE "sv, "PATCH "sv, kHandshake}) {
    if (first == kHandshake && !text) continue;
    if (begin.starts_with(first)) return Browser::kFound;
    if (first.starts_with(begin)) found = Browser::kMaybe;
  }
  return found;
}

class WithoutBrowsers final : public StreamSession {
 public:
  WithoutBrowsers(std::unique_ptr<StreamSession> session, std::function<void()> on_browser)
      : session_(std::move(session)), on_browser_(std::move(on_browser)) {}

  void receive(std::string_view bytes) override {
    if (found_ == Browser::kRuledOut) return session_->receive(bytes);
    if (found_ == Browser::kFound) return;
    begin_ += bytes;
    found_ = browser_in(begin_, session_->is_text());
    if (found_ == Browser::kRuledOut) session_->receive(std::exchange(begin_, {}));
    if (found_ == Browser::kFound) on_browser_();
  }
  void end_input() override { session_->end_input(); }
  bool is_text() const override { return session_->is_text(); }
  bool wants_more() const override { return session_->wants_more(); }
  std::string_view unsent() const override { return session_->unsent(); }
  std::size_t segment() const override { return session_->segment(); }
  bool is_busy() const override { return session_->is_busy(); }
  bool has_ended() const override { return found_ == Browser::kFound || session_->has_ended(); }
  void sent(std::size_t count) override { session_->sent(count); }

 private:
  std::unique_ptr<StreamSession> session_;
  std::function<void()> on_browser_;
  Browser found_ = Browser::kMaybe;
  std::string begin_;  ///< bytes received until it is known
};

}  // namespace

MakeSession command_sessions(Execute execute) {
  return [execute = std::move(execute)] { return std::make_unique<CommandSession>(execute); };
}

std::unique_ptr<StreamSession> without_browsers(std::unique_ptr<StreamSession> session,
                                                std::function<void()> on_browser) {
  return std::make_unique<WithoutBrowsers>(std::move(session), std::move(on_browser));
}

}  // namespace cbcan::protocols
