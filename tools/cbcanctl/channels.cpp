// SPDX-License-Identifier: MIT
#include "cbcanctl/channels.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <functional>

#include "common/data_words.hpp"

namespace cbcan::tools {

namespace {

constexpr auto kRestarted = static_cast<std::uint16_t>(regmap::Result::kRestarted);
constexpr auto kFailed = static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError);

/// Gives its channel another SDO timeout.
class TimeoutJob final : public Job {
 public:
  explicit TimeoutJob(std::uint16_t ms)
      : value_{static_cast<std::uint8_t>(ms), static_cast<std::uint8_t>(ms >> 8)} {}

  std::optional<Transaction> next() override {
    if (step_ == 0) return Transaction{regmap::kSdoRead, 0, regmap::object::kSdoTimeout, 0, 2, {}};
    return step_ == 1 && before_ ? std::optional(write(value_)) : std::nullopt;
  }
  void ended(const Response& response) override {
    if (step_++ == 0 && response.result == 0) before_ = response.data;
  }
  /// What puts back the one before, which is there once it may have been changed.
  std::optional<Transaction> undo() const { return before_ ? std::optional(write(*before_)) : std::nullopt; }

 private:
  static Transaction write(const std::vector<std::uint8_t>& value) {
    return {regmap::kSdoWrite, 0, regmap::object::kSdoTimeout, 0, 2, value};
  }

  std::vector<std::uint8_t> value_;
  int step_ = 0;
  std::optional<std::vector<std::uint8_t>> before_;
};

/// One channel's scanner window: a number for each request.
class ScannerClient {
 public:
  ScannerClient(RegisterAccess& registers, unsigned channel) : registers_(registers) {
    out_ = regmap::of_channel(regmap::kScannerOutFirst, channel);
    in_ = regmap::of_channel(regmap::kScannerInFirst, channel);
  }

  /// A channel that there is has taken a number, or says that it has started.
  bool exists() {
    const auto in = registers_.look(in_, regmap::kScannerData);
    if (!in || ((*in)[regmap::kScannerTaken] == 0 && (*in)[regmap::kScannerResult] == 0)) return false;
    number_ = (*in)[regmap::kScannerTaken];
    return true;
  }

  bool idle() const { return job_ == nullptr; }

  void set_timeout(std::uint16_t ms) { begin(&timeout_.emplace(ms)); }

  /// Begins the job's next transaction; without one it is idle again.
  void begin(Job* job) {
    const std::optional<Transaction> transaction = job->next();
    job_ = transaction ? job : nullptr;
    if (transaction) start(*transaction);
  }

  /// True: its transaction has ended.
  bool look() {
    const auto in = registers_.look(in_, count_);
    if (in && (*in)[regmap::kScannerTaken] != number_)
      throw ConnectionError(
          fmt::format("R{}: the module has restarted, or another program uses its channels; it is not "
                      "known whether the request was carried out",
                      in_));
    if (!in || (*in)[regmap::kScannerAnswered] != number_) return false;
    if ((*in)[regmap::kScannerResult] == kRestarted) {
      send();
      return false;
    }
    const std::span<const std::uint16_t> data = std::span(*in).subspan(regmap::kScannerData);
    Response response;
    response.result = (*in)[regmap::kScannerResult];
    if (response.result == kFailed) response.abort_code = data[0] | std::uint32_t{data[1]} << 16;
    if (response.result == 0)
      response.data = bytes_of(data, std::min<std::size_t>((*in)[regmap::kScannerSize], 2 * data.size()));
    job_->ended(response);
    begin(job_);
    return true;
  }

  /// Cancels whatever is under way, and leaves the channel as it was.
  void leave() {
    const std::uint16_t zero = 0;
    if (!idle()) registers_.write(out_, std::span(&zero, 1));
    if (const auto undo = timeout_ ? timeout_->undo() : std::nullopt) start(*undo);
  }

 private:
  void start(const Transaction& transaction) {
    request_ = {
        0, transaction.command, transaction.node, transaction.index, transaction.sub, transaction.size};
    append_words(request_, transaction.data);
    count_ = static_cast<std::uint16_t>(transaction.command == regmap::kSdoRead
                                            ? regmap::kScannerData +
                                                  std::max<std::size_t>(2, (transaction.size + 1u) / 2)
                                            : regmap::kScannerData + 2);
    send();
  }

  void send() {
    number_ = regmap::next_number(number_);
    request_[regmap::kScannerNumber] = number_;
    registers_.write(out_, request_);
  }

  RegisterAccess& registers_;
  std::uint16_t out_;
  std::uint16_t in_;
  std::uint16_t number_ = 0;
  std::uint16_t count_ = 0;  ///< of IN words that a result may have
  Job* job_ = nullptr;
  std::optional<TimeoutJob> timeout_;
  std::vector<std::uint16_t> request_;
};

}  // namespace

std::optional<Transaction> ReadJob::next() {
  if (responses_.size() == places_.size() || silent()) return std::nullopt;
  const auto [index, sub] = places_[responses_.size()];
  return Transaction{regmap::kSdoRead, node_, index, sub, regmap::kMaxDataBytes, {}};
}

bool ReadJob::silent() const {
  return !responses_.empty() && responses_.front().abort_code == abort_code::kTimedOut;
}

bool run(RegisterAccess& registers, std::span<Job* const> jobs, std::uint16_t sdo_timeout_ms) {
  std::vector<ScannerClient> channels;
  for (unsigned channel = regmap::kMostChannels; channel > 1; --channel)
    if (ScannerClient client(registers, channel); client.exists()) channels.push_back(client);
  if (channels.empty()) return false;
  auto next = jobs.begin();
  const auto leave = [&] {
    std::for_each(channels.begin(), channels.end(), std::mem_fn(&ScannerClient::leave));
  };
  try {
    for (ScannerClient& channel : channels)
      if (sdo_timeout_ms != 0) channel.set_timeout(sdo_timeout_ms);
    for (std::ptrdiff_t busy = 1; busy != 0;) {
      bool ended = false;
      busy = 0;
      for (ScannerClient& channel : channels) {
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
