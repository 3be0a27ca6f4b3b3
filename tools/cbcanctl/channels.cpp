// SPDX-License-Identifier: MIT
#include "cbcanctl/channels.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace cbcan::tools {

namespace {

/// Changes the SDO timeout of its channel.
class TimeoutJob final : public Job {
 public:
  explicit TimeoutJob(std::uint16_t ms) : value_(descriptions::to_bytes(ms, 2)) {}

  std::optional<Transaction> next() override {
    if (step_ == 0) return sdo_read(0, regmap::object::kSdoTimeout, 0);
    return step_ == 1 && before_ ? std::optional(write(value_)) : std::nullopt;
  }
  void ended(const window::Result& result) override {
    if (step_++ == 0 && result.code == 0) before_ = result.data;
  }
  /// Restores the previous timeout, if it may have been changed.
  std::optional<Transaction> undo() const { return before_ ? std::optional(write(*before_)) : std::nullopt; }

 private:
  static Transaction write(const std::vector<std::uint8_t>& value) {
    return sdo_write(0, regmap::object::kSdoTimeout, 0, value);
  }

  std::vector<std::uint8_t> value_;
  int step_ = 0;
  std::optional<std::vector<std::uint8_t>> before_;
};

/// One channel and the job that it carries out.
class Worker {
 public:
  Worker(RegisterAccess& registers, unsigned channel) : registers_(registers), channel_(channel) {}

  bool exists() {
    exchange();
    return !channel_.absent();
  }

  bool idle() const { return job_ == nullptr; }

  void set_timeout(std::uint16_t ms) { begin(&timeout_.emplace(ms)); }

  /// Begins the job's next transaction; becomes idle if there is none.
  void begin(Job* job) {
    const std::optional<Transaction> transaction = job->next();
    job_ = transaction ? job : nullptr;
    if (transaction) start(*transaction);
  }

  /// True if its transaction has ended.
  bool look() {
    exchange();
    const std::optional<window::Result> result = channel_.take();
    if (!result) return false;
    if (!result->known) fail("the module has restarted, or another program uses its channels");
    if (result->code == static_cast<std::uint16_t>(regmap::Result::kRestarted)) {
      start(channel_.transaction());
      return false;
    }
    job_->ended(*result);
    begin(job_);
    return true;
  }

  /// Cancels a transaction in progress and restores the channel's timeout.
  void leave() {
    channel_.cancel();
    if (channel_.cancelling()) exchange();
    if (const auto undo = timeout_ ? timeout_->undo() : std::nullopt) start(*undo);
  }

 private:
  void start(const Transaction& transaction) {
    if (!channel_.ready()) exchange();
    channel_.begin(transaction);
    exchange();
  }

  void exchange() {
    const window::Response response = registers_.exchange(*channel_.next());
    channel_.answered(response);
    if (response.exception != 0 && !channel_.absent())
      fail(fmt::format("Modbus exception {:02X}h", response.exception));
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw window::Error(window::Error::Cause::kUnknown,
                        fmt::format("R{}: {}; it is not known whether the request was carried out",
                                    regmap::of_channel(regmap::kScannerInFirst, channel_.number()), why));
  }

  RegisterAccess& registers_;
  window::Channel channel_;
  Job* job_ = nullptr;
  std::optional<TimeoutJob> timeout_;
};

}  // namespace

std::optional<Transaction> ReadJob::next() {
  if (results_.size() == places_.size() || silent()) return std::nullopt;
  const auto [index, sub] = places_[results_.size()];
  return sdo_read(node_, index, sub);
}

bool ReadJob::silent() const {
  return !results_.empty() && results_.front().abort_code == window::abort_code::kTimedOut;
}

bool run(RegisterAccess& registers, std::span<Job* const> jobs, std::uint16_t sdo_timeout_ms) {
  std::vector<Worker> channels;
  for (unsigned channel = regmap::kMostChannels; channel > 1; --channel)
    if (Worker worker(registers, channel); worker.exists()) channels.push_back(worker);
  if (channels.empty()) return false;
  auto next = jobs.begin();
  const auto leave = [&] { std::ranges::for_each(channels, &Worker::leave); };
  try {
    for (Worker& channel : channels)
      if (sdo_timeout_ms != 0) channel.set_timeout(sdo_timeout_ms);
    for (std::ptrdiff_t busy = 1; busy != 0;) {
      bool ended = false;
      busy = 0;
      for (Worker& channel : channels) {
        if (!channel.idle()) ended |= channel.look();
        while (channel.idle() && next != jobs.end())
          channel.begin(*next++);
        busy += channel.idle() ? 0 : 1;
      }
      registers.progress(static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - jobs.begin() - busy, 0)));
      if (!ended && busy != 0) registers.wait();
    }
  } catch (...) {
    leave();
    throw;
  }
  leave();
  return true;
}

}  // namespace cbcan::tools
