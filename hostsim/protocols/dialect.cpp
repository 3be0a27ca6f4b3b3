// SPDX-License-Identifier: MIT
#include "protocols/dialect.hpp"

#include <optional>

#include "base/text.hpp"
#include "boards/common/slcan_port.hpp"
#include "protocols/adapter.hpp"

namespace cbcan::protocols {

namespace {

/// The same implementation as on microcontrollers.
class Slcan final : public Dialect {
 public:
  explicit Slcan(std::uint16_t kbit) : kbit_(kbit), port_(kbit) {}

  void begin(Time /*now*/) override { port_.emplace(kbit_); }
  bool hear(char c, Frame& frame) override {
    port_->on_char(c);
    return port_->receive(frame);
  }
  bool is_open() const override { return true; }
  bool try_send(const Frame& frame) override { return port_->try_send(frame); }
  void say(std::string& text) override {
    for (char c = 0; port_->next_char(c);)
      text += c;
  }
  Time poll(Time now) override { return port_->poll(now); }
  BusState state() const override { return port_->state(); }
  std::string_view problem() const override { return {}; }

 private:
  std::uint16_t kbit_;
  std::optional<boards::SlcanPort> port_;
};

/// Sends an echo request once a second to detect a lost connection.
class Socketcand final : public Dialect {
 public:
  explicit Socketcand(std::string bus) : bus_(std::move(bus)) {}

  void begin(Time now) override {
    step_ = Step::kGreeting;
    reader_ = {};
    said_.clear();
    problem_.clear();
    heard_at_ = now_ = now;
  }
  bool hear(char c, Frame& frame) override {
    if (!reader_.on_char(c)) return false;
    heard_at_ = now_;
    const auto words = base::words_of(reader_.element());
    const std::string_view word = words.empty() ? std::string_view() : words.front();
    if (step_ != Step::kOpen) {
      greet(word);
    } else if (word == "frame") {
      const auto received = socketcand::parse_received(socketcand::Words(words).subspan(1));
      if (received) frame = *received;
      return received.has_value();
    }
    return false;
  }
  bool is_open() const override { return step_ == Step::kOpen; }
  bool try_send(const Frame& frame) override {
    if (said_.size() > kMostUnsaid) return false;
    socketcand::append_send(said_, frame);
    return true;
  }
  void say(std::string& text) override { text += std::exchange(said_, {}); }
  Time poll(Time now) override {
    now_ = now;
    if (now >= heard_at_ + kPatience) problem_ = "is silent; is it a socketcand?";
    if (now < ask_at_) return ask_at_;
    if (is_open()) said_ += "< echo >";
    return ask_at_ = now + kSecond;
  }
  BusState state() const override { return BusState::kActive; }
  std::string_view problem() const override { return problem_; }

 private:
  enum class Step : std::uint8_t { kGreeting, kOpening, kSwitching, kOpen };
  static constexpr Time kPatience = 5 * kSecond;
  static constexpr std::size_t kMostUnsaid = 1024;

  void greet(std::string_view word) {
    if (word != (step_ == Step::kGreeting ? "hi" : "ok")) {
      problem_ = "does not open the bus " + bus_;
    } else if (step_ == Step::kGreeting) {
      step_ = Step::kOpening;
      said_ += "< open " + bus_ + " >";
    } else if (step_ == Step::kOpening) {
      step_ = Step::kSwitching;
      said_ += "< rawmode >";
    } else {
      step_ = Step::kOpen;
    }
  }

  std::string bus_;
  Step step_ = Step::kGreeting;
  socketcand::ElementReader reader_;
  std::string said_;
  std::string problem_;
  Time heard_at_ = 0;
  Time ask_at_ = 0;
  Time now_ = 0;
};

}  // namespace

std::unique_ptr<Dialect> slcan_dialect(std::uint16_t kbit_per_second) {
  return std::make_unique<Slcan>(kbit_per_second);
}

std::unique_ptr<Dialect> socketcand_dialect(std::string bus) {
  return std::make_unique<Socketcand>(std::move(bus));
}

}  // namespace cbcan::protocols
