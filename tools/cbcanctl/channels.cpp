// SPDX-License-Identifier: MIT
#include "cbcanctl/channels.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/text.hpp"

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

NodeConfiguration::NodeConfiguration(const PlannedNode& node, bool verify) : node_(node) {
  for (const PlannedObject& object : node.identity)
    steps_.push_back({Kind::kCheck, &object});
  for (const PlannedObject& object : node.objects) {
    steps_.push_back({Kind::kWrite, &object});
    if (object.value.size() > regmap::kMaxDataBytes)
      throw UsageError(fmt::format("node {}: {:04X}h:{:02X}: over 128 bytes, configure cannot write it",
                                   node.id, object.index, object.sub));
  }
  // An object may be written twice, such as 1600h:00, which is 0 while its mappings change.
  for (auto object = node.objects.begin(); verify && object != node.objects.end(); ++object)
    if (std::none_of(object + 1, node.objects.end(), [&](const PlannedObject& later) {
          return later.index == object->index && later.sub == object->sub;
        }))
      steps_.push_back({Kind::kReadBack, &*object});
  steps_.push_back({Kind::kStart, nullptr});
}

std::optional<Transaction> NodeConfiguration::next() {
  if (at_ == steps_.size() || !problem_.empty()) return std::nullopt;
  const auto [kind, object] = steps_[at_];
  constexpr std::uint8_t kStartNode = 5;
  if (kind == Kind::kStart) return sdo_write(0, regmap::kNmtService, node_.id, {kStartNode});
  if (kind == Kind::kWrite) return sdo_write(node_.id, object->index, object->sub, object->value);
  return sdo_read(node_.id, object->index, object->sub);
}

void NodeConfiguration::ended(const window::Result& response) {
  const auto [kind, object] = steps_[at_++];
  const std::string place =
      object == nullptr ? fmt::format("node {}: start", node_.id)
                        : fmt::format("node {}: {:04X}h:{:02X}", node_.id, object->index, object->sub);
  if (kind == Kind::kReadBack && response.abort_code == window::abort_code::kWriteOnly) return;
  if (kind == Kind::kWrite && response.abort_code == window::abort_code::kReadOnly) {
    steps_.insert(steps_.end() - 1, {Kind::kReadBack, object});
  } else if (response.code != 0) {
    problem_ = place;
    refusal_ = response;
  } else if ((kind == Kind::kCheck || kind == Kind::kReadBack) && response.data != object->value) {
    problem_ =
        fmt::format("{} is {}, not {}", place, base::hex(response.data, " "), base::hex(object->value, " "));
  }
}

}  // namespace cbcan::tools
