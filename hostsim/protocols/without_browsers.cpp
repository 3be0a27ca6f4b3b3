// SPDX-License-Identifier: MIT
#include <cstdint>
#include <string>
#include <utility>

#include "protocols/stream_session.hpp"

namespace cbcan::protocols {

namespace {

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

std::unique_ptr<StreamSession> without_browsers(std::unique_ptr<StreamSession> session,
                                                std::function<void()> on_browser) {
  return std::make_unique<WithoutBrowsers>(std::move(session), std::move(on_browser));
}

}  // namespace cbcan::protocols
