// SPDX-License-Identifier: MIT
#include "window.hpp"

namespace cbcan::cia405::detail {

namespace {

namespace object = regmap::object;

bool changes_settings(const Transaction& transaction) {
  return transaction.command == regmap::kSdoWrite &&
         (transaction.index == object::kSdoTimeout || transaction.index == object::kTransferMode ||
          transaction.index == regmap::kNmtService);
}

bool fits(const Transaction& transaction, bool may_be_smaller, std::uint16_t size) {
  if (transaction.command == regmap::kSdoWrite) return true;
  return may_be_smaller ? size <= transaction.size : size == transaction.size;
}

}  // namespace

void Window::add(Job& job) {
  job.stage = Job::Stage::kQueued;
  job.window = this;
  queue_.push_back(&job);
}

void Window::remove(Job& job) {
  if (queue_.front() == &job) abandon();
  finish(job, KernelError::kNone);
}

void Window::expire(Time now) {
  for (std::size_t i = queue_.size(); i-- > 0;) {
    Job& job = *queue_[i];
    if (!job.deadline || now < *job.deadline) continue;
    if (job.stage == Job::Stage::kQueued) finish(job, KernelError::kTimeout);
    if (job.stage != Job::Stage::kBegun) continue;
    abandon();
    job.stage = Job::Stage::kKernelState;
  }
}

std::optional<Request> Window::next() {
  if (queue_.empty() && !channel_.cancelling()) return std::nullopt;
  if (channel_.ready()) {
    Job& job = *queue_.front();
    if (job.stage == Job::Stage::kQueued) job.stage = Job::Stage::kBegun;
    channel_.begin(next_transaction(job));
  }
  return channel_.next();
}

Transaction Window::next_transaction(const Job& job) {
  const auto because = [this](Purpose purpose, Transaction transaction) {
    purpose_ = purpose;
    return transaction;
  };
  const Service& wanted = job.service;
  const std::uint16_t timeout = job.module_timeout_ms;
  if (known_.changes != changes_) known_ = {.changes = changes_};
  if (job.stage == Job::Stage::kKernelState)
    return because(Purpose::kKernelState, window::sdo_read(0, object::kKernelState, 0, 1));
  if (wanted.on_bus && known_.timeout_ms != timeout)
    return because(Purpose::kTimeout, window::sdo_write(0, object::kSdoTimeout, 0, bytes_of(timeout)));
  if (wanted.on_bus && known_.mode != wanted.mode)
    return because(Purpose::kMode,
                   window::sdo_write(0, object::kTransferMode, 0, {static_cast<std::uint8_t>(wanted.mode)}));
  if (wanted.own_id != Service::OwnId::kNotAsked && !job.own_id)
    return because(Purpose::kOwnId, window::sdo_read(0, object::kOwnNodeId, 0, 1));
  Transaction transaction = because(Purpose::kService, wanted.transaction);
  if (wanted.own_id == Service::OwnId::kAsSubIndex) transaction.sub = *job.own_id;
  return transaction;
}

void Window::answered(const Response& response) {
  channel_.answered(response);
  if (response.exception != 0 && !absent() && !queue_.empty())
    finish(*queue_.front(), KernelError::kInternal);
  if (const std::optional<Result> result = channel_.take()) ended(*result);
}

void Window::ended(const Result& result) {
  Job& job = *queue_.front();
  const auto code = static_cast<regmap::Result>(result.code);
  const bool is_service = purpose_ == Purpose::kService;
  const bool access = is_service && job.service.access;
  const bool failed = code == regmap::Result::kSdoExecutionError;
  if (!result.known) {  // then 3003h and 3004h are unknown too
    known_ = {};
    finish(job, KernelError::kInternal);
  } else if (purpose_ == Purpose::kKernelState) {
    const std::uint8_t state = result.data.empty() ? std::uint8_t{0} : result.data[0];
    finish(job, state == 0 ? KernelError::kTimeout : static_cast<KernelError>(state));
  } else if (failed && access) {
    job.abort_code = result.abort_code;
    finish(job, KernelError::kOther);
  } else if (failed && is_service && result.abort_code == window::abort_code::kTimedOut) {
    // Not by the block's TIMEOUT: by the node, or the module could not send an NMT command.
    job.stage = Job::Stage::kKernelState;
  } else if (code == regmap::Result::kRestarted && channel_.number() != 1) {
    known_ = {};  // it was not executed: repeat it with the next number
  } else if (code == regmap::Result::kOk && fits(channel_.transaction(), access, result.size)) {
    succeeded(job, result);
  } else {
    finish(job, KernelError::kInternal);
  }
}

void Window::succeeded(Job& job, const Result& result) {
  if (purpose_ == Purpose::kTimeout) known_.timeout_ms = job.module_timeout_ms;
  if (purpose_ == Purpose::kMode) known_.mode = job.service.mode;
  if (purpose_ == Purpose::kOwnId) job.own_id = result.data[0];
  if (purpose_ != Purpose::kService) return;
  if (changes_settings(channel_.transaction())) ++changes_;
  job.data = result.data;
  finish(job, KernelError::kNone);
}

/// The job leaves the queue.
void Window::finish(Job& job, KernelError error) {
  std::erase(queue_, &job);
  job.stage = Job::Stage::kDone;
  job.window = nullptr;
  job.error = error;
}

/// Cancels the transaction of the job at the head; it may already have been carried out.
void Window::abandon() {
  if (!channel_.busy()) return;
  channel_.cancel();
  if (changes_settings(channel_.transaction())) ++changes_;
}

void Window::leave_to(Window* other) {
  while (!queue_.empty()) {
    Job& job = *queue_.front();
    const bool timed_out = job.stage == Job::Stage::kKernelState;
    finish(job, timed_out ? KernelError::kTimeout : KernelError::kInternal);
    if (other != nullptr && job.service.channel == 0) other->add(job);
  }
}

}  // namespace cbcan::cia405::detail
