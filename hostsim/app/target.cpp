// SPDX-License-Identifier: MIT
#include "app/target.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"
#include "config/config.hpp"
#include "io/loop/reactor.hpp"
#include "io/loop/system.hpp"

namespace cbcan::app {

namespace {

class Target final : public plant::Bench, private plant::View {
 public:
  explicit Target(const config::TargetPlace& place)
      : client_(window::Settings{.host = place.server.host,
                                 .port = place.server.port,
                                 .rtu = place.line.device,
                                 .baud = static_cast<int>(place.line.baud),
                                 .parity = place.line.parity.front(),
                                 .response_timeout = std::chrono::seconds(5)}) {
    read(1, regmap::kWindowFirst, 1);
    started_ = io::Reactor::now();
  }

  plant::View& view() override { return *this; }

  void check(std::string_view line) override {
    plant::check_command(line);
    const std::string_view name = base::words_of(line).front();
    if (name != "read" && name != "write" && name != "trigger")
      plant::refuse("{}: cannot be done there: --target has registers alone", name);
  }

  std::string execute(std::string_view line) override try {
    check(line);
    const plant::Words words = base::words_of(line);
    if (words[0] == "read") {
      const auto [network, first, count] = plant::read_of(words, networks());
      return fmt::format("ok {}\n", base::joined(read(network, first, count)));
    }
    const plant::Writing writing = plant::writing_of(words, networks());
    window::Request request;
    request.write_address = static_cast<std::uint16_t>(writing.first);
    request.words = writing.words;
    if (const auto response = exchange(writing.network, request); response.exception != 0)
      plant::refuse("writing R{}: Modbus exception {:02X}h", writing.first, response.exception);
    const bool executes = writing.first == regmap::kWindowFirst && writing.words.front() == regmap::kExecute;
    transactions_ += executes ? 1 : 0;
    written_[writing.network] = executes ? writing.words : std::vector<std::uint16_t>{};
    return "ok\n";
  } catch (const plant::Refused& refused) {
    return fmt::format("{}{}\n", plant::kError, refused.what());
  }

  void advance(Time until) override {
    constexpr Time kPeriod = kMillisecond;  // of the polling of the registers
    const Time end = started_ + std::min(until, now() + kPeriod);
    while (io::Reactor::now() < end)
      reactor_.poll(end);
  }

 private:
  Time now() const override { return io::Reactor::now() - started_; }
  Time started() const override { return started_; }
  std::size_t networks() const override { return config::kMostNetworks; }
  std::uint32_t transactions(std::size_t /*network*/) override { return transactions_; }
  bool has_exact_time() const override { return false; }

  sim::World& world(std::size_t /*network*/) override {
    throw plant::NotObservable("nodes and frames cannot be seen there: --target has registers alone");
  }

  window::Response exchange(std::size_t network, const window::Request& request) try {
    return client_.exchange(static_cast<int>(network), request);
  } catch (const window::Error& error) {
    throw io::EnvironmentError(error.what());
  }

  std::vector<std::uint16_t> read(std::size_t network, std::uint32_t first, std::size_t count) override {
    window::Request request;
    request.read_address = static_cast<std::uint16_t>(first);
    request.count = static_cast<std::uint16_t>(count);
    window::Response response = exchange(network, request);
    if (response.exception != 0)
      plant::refuse("reading R{}: Modbus exception {:02X}h", first, response.exception);
    if (first == regmap::kWindowFirst && response.words.front() != regmap::kExecute) check_own(network);
    return std::move(response.words);
  }

  /// The start rule: throws if the response in R3700.. is not to this client's request.
  void check_own(std::size_t network) {
    const std::vector<std::uint16_t> written = std::exchange(written_[network], {});
    if (written.empty() || window::is_known(written, read(network, regmap::kWindowFirst, written.size())))
      return;
    throw io::EnvironmentError(client_.place() + ": " + window::kNotKnown);
  }

  io::Reactor reactor_;
  window::Client client_;
  Time started_ = io::Reactor::now();
  std::uint32_t transactions_ = 0;
  /// R3700.. of the transaction in progress, by network.
  std::map<std::size_t, std::vector<std::uint16_t>> written_;
};

}  // namespace

std::unique_ptr<plant::Bench> open_target(const config::TargetPlace& place) {
  return std::make_unique<Target>(place);
}

}  // namespace cbcan::app
