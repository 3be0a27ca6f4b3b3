// SPDX-License-Identifier: MIT
#include "cbcanctl/channels.hpp"

#include <algorithm>

#include "common/data_words.hpp"

namespace cbcan::tools {

namespace {

constexpr auto kRestarted = static_cast<std::uint16_t>(regmap::Result::kRestarted);
constexpr auto kFailed = static_cast<std::uint16_t>(regmap::Result::kSdoExecutionError);

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

  /// Begins the job's next transaction; without one it is idle again.
  void begin(Job* job) {
    const std::optional<Transaction> transaction = job->next();
    job_ = transaction ? job : nullptr;
    if (!transaction) return;
    request_ = {
        0, transaction->command, transaction->node, transaction->index, transaction->sub, transaction->size};
    append_words(request_, transaction->data);
    count_ = static_cast<std::uint16_t>(transaction->command == regmap::kSdoRead
                                            ? regmap::kScannerData +
                                                  std::max<std::size_t>(2, (transaction->size + 1u) / 2)
                                            : regmap::kScannerData + 2);
    send();
  }

  /// True: its transaction has ended.
  bool look() {
    const auto in = registers_.look(in_, count_);
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

  /// Whatever is under way.
  void cancel() {
    const std::uint16_t zero = 0;
    if (!idle()) registers_.write(out_, std::span(&zero, 1));
  }

 private:
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
  std::vector<std::uint16_t> request_;
};

}  // namespace

bool run(RegisterAccess& registers, std::span<Job* const> jobs) {
  std::vector<ScannerClient> channels;
  for (unsigned channel = regmap::kMostChannels; channel > 1; --channel)
    if (ScannerClient client(registers, channel); client.exists()) channels.push_back(client);
  if (channels.empty()) return false;
  auto next = jobs.begin();
  try {
    while (true) {
      bool any = false;
      bool ended = false;
      for (ScannerClient& channel : channels) {
        if (!channel.idle()) ended |= channel.look();
        while (channel.idle() && next != jobs.end())
          channel.begin(*next++);
        any |= !channel.idle();
      }
      if (!any) return true;
      if (!ended) registers.wait();
    }
  } catch (...) {
    for (ScannerClient& channel : channels)
      channel.cancel();
    throw;
  }
}

}  // namespace cbcan::tools
