// SPDX-License-Identifier: MIT
#include "cbcanctl/commands.hpp"

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "base/read_file.hpp"
#include "base/text.hpp"
#include "cbcan/sdo_abort_codes.hpp"

namespace cbcan::ctl {

namespace {

using Cause = window::Error::Cause;

volatile sig_atomic_t interrupt_seen = 0;

std::optional<std::uint32_t> abort_code_of(const window::Result& response) {
  if (response.code != static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError)) return std::nullopt;
  return response.abort_code;
}

std::string code_text(std::uint32_t code) {
  const std::string number = fmt::format("{:04X} {:04X}h", code >> 16, code & 0xFFFF);
  const regmap::AbortRow* row = regmap::find_abort(code);
  if (row == nullptr) return number + ": an abort code of the node's own";
  return fmt::format("{} {}: {}", number, row->name, row->meaning);
}

std::string reason(const window::Result& response) {
  if (const auto code = abort_code_of(response)) return code_text(*code);
  for (const regmap::NamedNumber& row : regmap::kResults)
    if (row.value == response.code) return fmt::format("{}: {}", row.name, row.meaning);
  return "R3700 is " + std::to_string(response.code) + ", which is no result";
}

/// "3003h of the coprocessor"
std::string own_name(std::uint16_t index) {
  return fmt::format("{:04X}h of the coprocessor", index);
}

void write_own(window::Client& client, std::uint16_t index, const tools::Bytes& value) {
  execute(client, tools::sdo_write(0, index, 0, value), own_name(index));
}

/// The registers of a connection, for tools::run(). Ctrl-C throws. Shows a progress bar on a terminal during
/// its lifetime.
class Registers final : public tools::RegisterAccess {
 public:
  Registers(window::Client& client, std::string_view what, std::size_t all)
      : client_(client), what_(what), all_(all) {}
  ~Registers() override {
    if (shown_) std::cerr << "\r\033[K" << std::flush;
  }
  Registers(const Registers&) = delete;
  Registers& operator=(const Registers&) = delete;

  window::Response exchange(const window::Request& request) override { return client_.exchange(request); }
  void wait() override { client_.pause(std::chrono::milliseconds(1)); }
  void progress(std::size_t ended) override {
    if (interrupted())
      throw window::Error(Cause::kInterrupted, "cancelled: no request is in progress any more");
    constexpr std::size_t kWidth = 40;
    const std::size_t full = kWidth * ended / std::max<std::size_t>(all_, 1);
    if (!terminal_ || full == shown_) return;
    std::cerr << fmt::format("\r[{:#<{}}{:{}}] {} {} of {}", "", full, "", kWidth - full, what_, ended, all_)
              << std::flush;
    shown_ = full;
  }

 private:
  window::Client& client_;
  std::string_view what_;
  std::size_t all_;
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  std::optional<std::size_t> shown_;  ///< filled part of the bar
};

}  // namespace

Refused::Refused(const window::Result& response, const std::string& what)
    : std::runtime_error((what.empty() ? "" : what + ": ") + reason(response)),
      result(response.code),
      abort_code(abort_code_of(response)) {}

void say(const std::string& line) {
  std::cerr << "cbcanctl: " << base::to_utf8(line) << "\n";
}

std::string read_file(const std::string& path) {
  if (auto text = base::read_file(path)) return *text;
  throw tools::UsageError(path + ": cannot be read; is the name right?");
}

descriptions::PlannedNetwork read_network(const std::string& path) {
  std::vector<std::string> remarks;
  descriptions::PlannedNetwork network = descriptions::read_network(path, base::read_file, remarks);
  std::ranges::for_each(remarks, say);
  return network;
}

bool interrupted() {
  return interrupt_seen != 0;
}

window::Client connect(const Options& options) {
  // The first response through a pseudo-terminal of QEMU takes up to one second.
  constexpr std::chrono::milliseconds kSerialResponse{1500}, kTcpResponse{1000};
  struct sigaction action {};
  action.sa_handler = [](int /*signal*/) { interrupt_seen = 1; };
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  window::Settings settings = options.target;
  settings.response_timeout =
      settings.rtu.empty() ? std::max(settings.timeout, kTcpResponse) : kSerialResponse;
  settings.interrupted = interrupted;
  settings.pass = window::plant_time(options.control);
  settings.occupied = [] { say("another program's transaction is in progress; waiting for it"); };
  return window::Client(std::move(settings));
}

void run(window::Client& client, std::span<tools::Job* const> jobs, std::string_view what,
         int sdo_timeout_ms) {
  Registers registers(client, what, jobs.size());
  if (tools::run(registers, jobs, static_cast<std::uint16_t>(sdo_timeout_ms))) return;
  const Borrowed timeout(client, own::kSdoTimeout, sdo_timeout_of(sdo_timeout_ms));
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    registers.progress(i);
    while (const auto transaction = jobs[i]->next())
      jobs[i]->ended(client.execute(*transaction));
  }
}

std::deque<tools::ReadJob> read_of_all(window::Client& client, const std::vector<tools::ObjectPlace>& places,
                                       int sdo_timeout_ms) {
  std::deque<tools::ReadJob> jobs;
  std::vector<tools::Job*> list;
  for (std::uint16_t node = 1; node <= kMaxNode; ++node)
    list.push_back(&jobs.emplace_back(node, places));
  run(client, list, "node", sdo_timeout_ms);
  return jobs;
}

tools::Bytes execute(window::Client& client, const tools::Transaction& transaction, const std::string& what) {
  const window::Result response = client.execute(transaction);
  if (response.code == static_cast<std::uint16_t>(regmap::Result::kOk)) return response.data;
  const bool silent = abort_code_of(response) == window::abort_code::kTimedOut && transaction.node != 0;
  throw Refused(response, what.empty() && silent ? fmt::format("node {}", transaction.node) : what);
}

tools::Bytes own::read(window::Client& client, std::uint16_t index, std::uint8_t sub, std::size_t size) {
  tools::Bytes value = execute(client, tools::sdo_read(0, index, sub, size), own_name(index));
  if (value.size() != size)
    throw window::Error(Cause::kNoWindow, fmt::format("{}: {} bytes instead of {}: this is no CBCAN window",
                                                      own_name(index), value.size(), size));
  return value;
}

Borrowed::Borrowed(window::Client& client, std::uint16_t index, const tools::Bytes& value)
    : client_(client), index_(index) {
  if (!value.empty()) before_ = own::read(client, index, 0, value.size());
  if (before_ == value) return;
  changed_ = true;
  try {
    write_own(client, index, value);
  } catch (const Refused&) {
    throw;
  } catch (...) {
    put_back();  // a cancelled write may have been carried out
    throw;
  }
}

void Borrowed::put_back() noexcept {
  if (!changed_) return;
  interrupt_seen = 0;  // the next Ctrl-C counts again
  try {
    write_own(client_, index_, before_);
  } catch (const std::exception& error) {
    say(own_name(index_) + " was " + tools::print_value(before_) +
        " and could not be restored: " + error.what());
  }
}

tools::Bytes sdo_timeout_of(int timeout_ms) {
  return timeout_ms == 0 ? tools::Bytes() : descriptions::to_bytes(static_cast<unsigned>(timeout_ms), 2);
}

}  // namespace cbcan::ctl
