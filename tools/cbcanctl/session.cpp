// SPDX-License-Identifier: MIT
#include "cbcanctl/session.hpp"

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <iostream>
#include <thread>

namespace cbcan::ctl {

namespace {

volatile sig_atomic_t interrupt_seen = 0;

void on_interrupt(int /*signal*/) {
  interrupt_seen = 1;
}

std::optional<std::uint32_t> abort_code_of(const tools::Response& response) {
  if (response.result != static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError)) return std::nullopt;
  return response.abort_code;
}

std::string code_text(std::uint32_t code) {
  const std::string number = fmt::format("{:04X} {:04X}h", code >> 16, code & 0xFFFF);
  const regmap::AbortRow* row = regmap::find_abort(code);
  if (row == nullptr) return number + ": an abort code of the node's own";
  return fmt::format("{} {}: {}", number, row->name, row->meaning);
}

std::string reason(const tools::Response& response) {
  if (const auto code = abort_code_of(response)) return code_text(*code);
  for (const regmap::NamedNumber& row : regmap::kResults)
    if (row.value == response.result) return fmt::format("{}: {}", row.name, row.meaning);
  return "R3700 is " + std::to_string(response.result) + ", which is no result";
}

tools::Transaction own_object(std::uint16_t command, std::uint16_t index, std::size_t size) {
  tools::Transaction transaction;
  transaction.command = command;
  transaction.index = index;
  transaction.size = static_cast<std::uint16_t>(size);
  return transaction;
}

}  // namespace

Refused::Refused(const tools::Response& response, const std::string& what)
    : std::runtime_error((what.empty() ? "" : what + ": ") + reason(response)),
      result(response.result),
      abort_code(abort_code_of(response)) {}

void say(const std::string& line) {
  std::cerr << "cbcanctl: " << line << "\n";
}

void listen_for_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
  return interrupt_seen != 0;
}

void forget_interrupt() {
  interrupt_seen = 0;
}

tools::WindowClient connect(const Options& options) {
  return tools::WindowClient(options.target, interrupted, say);
}

void Registers::wait() {
  if (interrupted()) throw tools::Interrupted("cancelled: 0 written to the channels");
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void run(tools::WindowClient& client, std::span<tools::Job* const> jobs, const char* what) {
  Registers registers(client);
  if (tools::run(registers, jobs)) return;
  const bool progress = isatty(STDERR_FILENO) != 0;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (progress) std::cerr << fmt::format("\r{} {} of {} ", what, i + 1, jobs.size()) << std::flush;
    while (const auto transaction = jobs[i]->next())
      jobs[i]->ended(client.execute(*transaction));
    if (progress) std::cerr << "\r\033[K" << std::flush;
  }
}

tools::Bytes execute(tools::WindowClient& client, const tools::Transaction& transaction,
                     const std::string& what) {
  const tools::Response response = client.execute(transaction);
  if (response.result != static_cast<std::uint16_t>(regmap::Result::kOk)) throw Refused(response, what);
  return response.data;
}

namespace own {

std::string name(std::uint16_t index) {
  return fmt::format("{:04X}h of the coprocessor", index);
}

tools::Bytes read(tools::WindowClient& client, std::uint16_t index, std::uint8_t sub, std::size_t size) {
  tools::Transaction transaction = own_object(regmap::kSdoRead, index, size);
  transaction.sub = sub;
  tools::Bytes value = execute(client, transaction, name(index));
  if (value.size() != size)
    throw tools::ConnectionError(
        fmt::format("{}: {} bytes instead of {}: this is no CBCAN window", name(index), value.size(), size));
  return value;
}

void write(tools::WindowClient& client, std::uint16_t index, const tools::Bytes& value) {
  tools::Transaction transaction = own_object(regmap::kSdoWrite, index, value.size());
  transaction.data = value;
  execute(client, transaction, name(index));
}

std::uint8_t node_id(tools::WindowClient& client) {
  return read(client, kOwnNodeId, 0, 1)[0];
}

}  // namespace own

}  // namespace cbcan::ctl
