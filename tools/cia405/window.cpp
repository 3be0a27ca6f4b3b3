// SPDX-License-Identifier: MIT
#include "window.hpp"

#include <algorithm>
#include <utility>

#include "cbcan/regmap.hpp"

namespace cbcan::cia405::detail {

namespace {

namespace object = regmap::object;

Service write_local(std::uint16_t index, std::vector<std::uint8_t> data) {
  const auto size = static_cast<std::uint16_t>(data.size());
  return {.write = true, .index = index, .size = size, .data = std::move(data)};
}

Service write_timeout(std::uint16_t ms) {
  return write_local(object::kSdoTimeout,
                     {static_cast<std::uint8_t>(ms), static_cast<std::uint8_t>(ms >> 8)});
}

Service write_mode(SdoMode mode) {
  return write_local(object::kTransferMode, {static_cast<std::uint8_t>(mode)});
}

bool changes_settings(const Transaction& transaction) {
  return transaction.command == regmap::kSdoWrite &&
         (transaction.index == object::kSdoTimeout || transaction.index == object::kTransferMode ||
          transaction.index == regmap::kNmtService);
}

Transaction transaction_of(const Service& service) {
  return {.command = service.write ? regmap::kSdoWrite : regmap::kSdoRead,
          .node = service.node,
          .index = service.index,
          .sub = service.sub,
          .size = service.size,
          .data = service.data};
}

bool fits(const Transaction& transaction, bool exact, std::uint16_t size) {
  if (transaction.command == regmap::kSdoWrite) return true;
  return exact ? size == transaction.size : size <= transaction.size;
}

}  // namespace

void Window::add(Job& job) {
  job.stage = Job::Stage::kQueued;
  job.window = this;
  queue_.push_back(&job);
}

void Window::remove(Job& job) {
  const bool begun = job.stage == Job::Stage::kBegun || job.stage == Job::Stage::kKernelState;
  if (begun) abandon();
  std::erase(queue_, &job);
  job.stage = Job::Stage::kIdle;
}

void Window::expire(Time now) {
  for (std::size_t i = 0; i < queue_.size();) {
    Job& job = *queue_[i];
    const bool waits = job.stage == Job::Stage::kQueued;
    const bool over = job.deadline && now >= *job.deadline;
    if (over && job.stage == Job::Stage::kBegun) {
      abandon();
      job.stage = Job::Stage::kKernelState;
    }
    if (over && waits)
      finish(job, KernelError::kTimeout);
    else
      ++i;
  }
}

std::optional<Request> Window::next() {
  if (queue_.empty() && !channel_.cancelling()) return std::nullopt;
  if (channel_.ready()) {
    Job& job = *queue_.front();
    if (job.stage == Job::Stage::kQueued) job.stage = Job::Stage::kBegun;
    channel_.begin(transaction_of(next_service(job)));
  }
  return channel_.next();
}

void Window::leave_to(Window& other) {
  channel_ = window::Channel(channel_.number());
  while (!queue_.empty()) {
    Job& job = *queue_.front();
    const bool anywhere = job.service.channel == 0;
    finish(job, KernelError::kInternal);
    if (anywhere) other.add(job);
  }
}

Service Window::next_service(const Job& job) {
  const Service& wanted = job.service;
  const auto because = [this](Purpose purpose, Service service) {
    purpose_ = purpose;
    return service;
  };
  if (job.stage == Job::Stage::kKernelState)
    return because(Purpose::kKernelState, Service::local(object::kKernelState, 1));
  if (wanted.on_bus && timeout_known_ != job.module_timeout_ms)
    return because(Purpose::kTimeout, write_timeout(job.module_timeout_ms));
  if (wanted.on_bus && mode_known_ != wanted.mode) return because(Purpose::kMode, write_mode(wanted.mode));
  if (wanted.own_id != Service::OwnId::kNotAsked && !job.own_id)
    return because(Purpose::kOwnId, Service::local(object::kOwnNodeId, 1));
  Service service = because(Purpose::kService, wanted);
  if (wanted.own_id == Service::OwnId::kAsSubIndex) service.sub = *job.own_id;
  return service;
}

void Window::answered(const Response& response) {
  channel_.answered(response);
  if (response.exception != 0 && !absent() && !queue_.empty()) finish(*queue_.front(), KernelError::kInternal);
  if (const std::optional<Result> result = channel_.take()) ended(*result);
}

void Window::ended(const Result& result) {
  Job& job = *queue_.front();
  if (!result.known) return restarted(job);
  if (purpose_ == Purpose::kKernelState) return take_kernel_state(job, result);
  const bool exact = purpose_ != Purpose::kService || job.service.exact;
  switch (static_cast<regmap::Result>(result.code)) {
    case regmap::Result::kSdoExecutionError: return failed(job, result.abort_code);
    case regmap::Result::kOk:
      if (fits(channel_.transaction(), exact, result.size)) return succeeded(job, result);
      break;
    case regmap::Result::kRestarted:
      if (channel_.number() == 1) break;
      return forget_settings();  // it was not executed: once more, with the next number
    case regmap::Result::kCommandCodeError:
    case regmap::Result::kNodeIdError:
    case regmap::Result::kIncomplete: break;
  }
  finish(job, KernelError::kInternal);
}

/// Whether it was carried out before, nobody knows.
void Window::restarted(Job& job) {
  forget_settings();
  finish(job, KernelError::kInternal);
}

void Window::succeeded(Job& job, const Result& result) {
  switch (purpose_) {
    case Purpose::kTimeout: timeout_known_ = job.module_timeout_ms; return;
    case Purpose::kMode: mode_known_ = job.service.mode; return;
    case Purpose::kOwnId: job.own_id = result.data[0]; return;
    case Purpose::kKernelState: return;
    case Purpose::kService: break;
  }
  const Transaction& transaction = channel_.transaction();
  lost_settings_ = transaction.command == regmap::kSdoWrite && transaction.index == regmap::kNmtService;
  if (changes_settings(transaction)) forget_settings();
  job.data = result.data;
  finish(job, KernelError::kNone);
}

/// A block whose TIMEOUT is over is not here any more: abort 0504 0000h is the node's, or else that of an NMT
/// command which the module could not send.
void Window::failed(Job& job, std::uint32_t abort_code) {
  if (purpose_ == Purpose::kService && job.service.has_errorinfo) {
    job.abort_code = abort_code;
    finish(job, KernelError::kOther);
  } else if (purpose_ == Purpose::kService && abort_code == window::abort_code::kTimedOut) {
    job.stage = Job::Stage::kKernelState;
  } else {
    finish(job, KernelError::kInternal);
  }
}

void Window::take_kernel_state(Job& job, const Result& result) {
  const std::uint8_t state = result.data.empty() ? std::uint8_t{0} : result.data[0];
  finish(job, state == 0 ? KernelError::kTimeout : static_cast<KernelError>(state));
}

/// The job leaves the queue.
void Window::finish(Job& job, KernelError error) {
  std::erase(queue_, &job);
  job.stage = Job::Stage::kDone;
  job.error = error;
}

/// The job at the head has no use any more for what has been started.
void Window::abandon() {
  if (!channel_.busy()) return;
  channel_.cancel();
  if (purpose_ == Purpose::kTimeout) timeout_known_.reset();
  if (purpose_ == Purpose::kMode) mode_known_.reset();
  if (purpose_ == Purpose::kService && changes_settings(channel_.transaction())) {  // who knows
    forget_settings();
    lost_settings_ = true;
  }
}

void Window::lost() {
  channel_.lost();
  forget_settings();
  while (!queue_.empty()) {
    Job& job = *queue_.front();
    const bool timed_out = job.stage == Job::Stage::kKernelState;
    finish(job, timed_out ? KernelError::kTimeout : KernelError::kInternal);
  }
}

void Window::forget_settings() {
  timeout_known_.reset();
  mode_known_.reset();
}

}  // namespace cbcan::cia405::detail
