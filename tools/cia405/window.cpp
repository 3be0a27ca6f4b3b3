// SPDX-License-Identifier: MIT
#include "window.hpp"

#include <algorithm>
#include <utility>

#include "cbcan/regmap.hpp"
#include "common/data_words.hpp"

namespace cbcan::cia405::detail {

namespace {

namespace object = regmap::object;

constexpr std::uint32_t kAbortTimeout = 0x05040000;

constexpr std::size_t at(std::uint16_t address) {
  return static_cast<std::size_t>(address - regmap::kWindowFirst);
}

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

bool changes_settings(const Service& service) {
  return service.write && (service.index == object::kSdoTimeout || service.index == object::kTransferMode ||
                           service.index == regmap::kNmtService);
}

/// R3700..R3706+n.
std::vector<std::uint16_t> start_words(const Service& service) {
  std::vector<std::uint16_t> words{regmap::kExecute, service.write ? regmap::kSdoWrite : regmap::kSdoRead,
                                   service.node,     service.index,
                                   service.sub,      service.size};
  tools::append_words(words, service.data);
  return words;
}

std::vector<std::uint8_t> data_bytes(std::span<const std::uint16_t> words, std::size_t size) {
  return tools::bytes_of(words.subspan(at(regmap::kData)), size);
}

/// `words` are R3700..: a module that has restarted has 0 there.
bool is_of(const Service& service, std::span<const std::uint16_t> words) {
  const std::vector<std::uint16_t> asked = start_words(service);
  return std::ranges::equal(words.first(at(regmap::kDataSize)).subspan(1),
                            std::span(asked).first(at(regmap::kDataSize)).subspan(1));
}

bool fits(const Service& service, std::uint16_t size) {
  return service.exact ? size == service.size : size <= service.size;
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
  if (flag_ == Flag::kToCancel) return clear();
  if (queue_.empty()) return std::nullopt;
  if (flag_ == Flag::kUnknown) return clear();
  return running_ ? poll() : begin();
}

/// Whatever is under way in the window is cancelled.
Request Window::clear() {
  asked_ = Asked::kClear;
  flag_ = Flag::kClear;
  if (channel_ == 1) return {.write_address = regmap::kExecuteFlag, .words = {0}};
  return {.write_address = regmap::of_channel(regmap::kScannerOutFirst, channel_),
          .words = {0},
          .read_address = regmap::of_channel(regmap::kScannerInFirst, channel_),
          .count = regmap::kScannerTaken + 1};
}

/// The numbers go on behind the last one. A channel that there is has taken one, or says that it has started.
void Window::cleared(std::span<const std::uint16_t> words) {
  if (channel_ == 1) return;
  number_ = words[regmap::kScannerTaken];
  absent_ = number_ == 0 && words[regmap::kScannerResult] == 0;
}

void Window::leave_to(Window& other) {
  absent_ = false;
  asked_ = Asked::kNothing;
  flag_ = Flag::kUnknown;
  while (!queue_.empty()) {
    Job& job = *queue_.front();
    const bool anywhere = job.service.channel == 0;
    finish(job, KernelError::kInternal);
    if (anywhere) other.add(job);
  }
}

Request Window::poll() {
  asked_ = Asked::kPoll;
  if (channel_ != 1)
    return {.read_address = regmap::of_channel(regmap::kScannerInFirst, channel_),
            .count = regmap::kScannerInWords};
  return {.read_address = regmap::kWindowFirst, .count = regmap::kWindowWords};
}

Request Window::begin() {
  Job& job = *queue_.front();
  if (job.stage == Job::Stage::kQueued) job.stage = Job::Stage::kBegun;
  running_ = true;
  asked_ = Asked::kStart;
  transaction_ = next_service(job);
  std::vector<std::uint16_t> words = start_words(transaction_);
  if (channel_ == 1) return {.write_address = regmap::kWindowFirst, .words = std::move(words)};
  number_ = regmap::next_number(number_);
  words[regmap::kScannerNumber] = number_;
  return {.write_address = regmap::of_channel(regmap::kScannerOutFirst, channel_), .words = std::move(words)};
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

void Window::answered(std::span<const std::uint16_t> words) {
  switch (std::exchange(asked_, Asked::kNothing)) {
    case Asked::kPoll: return channel_ == 1 ? polled(words) : polled(in_order(words));
    case Asked::kClear: return cleared(words);
    case Asked::kNothing:
    case Asked::kStart: return;
  }
}

/// The words of IN as those of R3700..R3769. A module that has taken another number last has restarted.
std::vector<std::uint16_t> Window::in_order(std::span<const std::uint16_t> in) const {
  if (in[regmap::kScannerTaken] != number_) return std::vector<std::uint16_t>(regmap::kWindowWords);
  std::vector<std::uint16_t> words = start_words(transaction_);
  words.resize(regmap::kWindowWords);
  const bool answered = in[regmap::kScannerAnswered] == number_;
  words[0] = answered ? in[regmap::kScannerResult] : regmap::kExecute;
  words[at(regmap::kDataSize)] = in[regmap::kScannerSize];
  std::ranges::copy(in.subspan(regmap::kScannerData), words.begin() + at(regmap::kData));
  return words;
}

void Window::polled(std::span<const std::uint16_t> words) {
  if (running_ && words[0] != regmap::kExecute) ended(words);
}

void Window::ended(std::span<const std::uint16_t> words) {
  running_ = false;
  Job& job = *queue_.front();
  if (!is_of(transaction_, words)) return restarted(job);
  if (purpose_ == Purpose::kKernelState) return take_kernel_state(job, words);
  const std::uint16_t size = words[at(regmap::kDataSize)];
  const std::uint32_t code = words[at(regmap::kData)] | std::uint32_t{words[at(regmap::kData) + 1]} << 16;
  switch (static_cast<regmap::Result>(words[0])) {
    case regmap::Result::kSdoExecutionError: return failed(job, code);
    case regmap::Result::kOk:
      if (transaction_.write || fits(transaction_, size)) return succeeded(job, words);
      break;
    case regmap::Result::kRestarted:
      if (channel_ == 1) break;
      return forget_settings();  // it was not executed: once more, with the next number
    case regmap::Result::kCommandCodeError:
    case regmap::Result::kNodeIdError:
    case regmap::Result::kIncomplete: break;
  }
  finish(job, KernelError::kInternal);
}

/// Whether it was carried out before, nobody knows.
void Window::restarted(Job& job) {
  flag_ = Flag::kUnknown;
  forget_settings();
  finish(job, KernelError::kInternal);
}

void Window::succeeded(Job& job, std::span<const std::uint16_t> words) {
  switch (purpose_) {
    case Purpose::kTimeout: timeout_known_ = job.module_timeout_ms; return;
    case Purpose::kMode: mode_known_ = job.service.mode; return;
    case Purpose::kOwnId: job.own_id = data_bytes(words, 1)[0]; return;
    case Purpose::kKernelState: return;
    case Purpose::kService: break;
  }
  lost_settings_ = transaction_.write && transaction_.index == regmap::kNmtService;
  if (changes_settings(transaction_)) forget_settings();
  if (!transaction_.write) job.data = data_bytes(words, words[at(regmap::kDataSize)]);
  finish(job, KernelError::kNone);
}

/// A block whose TIMEOUT is over is not here any more: abort 0504 0000h is the node's, or else that of an NMT
/// command which the module could not send.
void Window::failed(Job& job, std::uint32_t abort_code) {
  if (purpose_ == Purpose::kService && job.service.has_errorinfo) {
    job.abort_code = abort_code;
    finish(job, KernelError::kOther);
  } else if (purpose_ == Purpose::kService && abort_code == kAbortTimeout) {
    job.stage = Job::Stage::kKernelState;
  } else {
    finish(job, KernelError::kInternal);
  }
}

void Window::take_kernel_state(Job& job, std::span<const std::uint16_t> words) {
  const bool good = words[0] == static_cast<std::uint16_t>(regmap::Result::kOk);
  const std::uint8_t state = good ? data_bytes(words, 1)[0] : std::uint8_t{0};
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
  if (!running_) return;
  running_ = false;
  flag_ = Flag::kToCancel;
  if (purpose_ == Purpose::kTimeout) timeout_known_.reset();
  if (purpose_ == Purpose::kMode) mode_known_.reset();
  if (purpose_ == Purpose::kService && changes_settings(transaction_)) {  // who knows
    forget_settings();
    lost_settings_ = true;
  }
}

void Window::refused() {
  absent_ = channel_ != 1 && asked_ == Asked::kClear;
  if (absent_) return;
  asked_ = Asked::kNothing;
  running_ = false;
  flag_ = Flag::kUnknown;
  if (!queue_.empty()) finish(*queue_.front(), KernelError::kInternal);
}

void Window::lost() {
  asked_ = Asked::kNothing;
  running_ = false;
  flag_ = Flag::kUnknown;
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
