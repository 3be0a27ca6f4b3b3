// SPDX-License-Identifier: MIT
#include <poll.h>

#include <algorithm>
#include <limits>

#include "cbcan/cia405.hpp"
#include "window.hpp"

namespace cbcan::cia405 {

namespace {

namespace object = regmap::object;

constexpr std::uint8_t kHighestNode = 127;
constexpr std::uint32_t kLongestTimeout = std::numeric_limits<std::uint16_t>::max();

using detail::Service;
using OwnId = Service::OwnId;

/// An object of the module.
Service read_local(std::uint16_t index, std::uint16_t size, OwnId own_id = OwnId::kNotAsked) {
  return {.transaction = window::sdo_read(0, index, 0, size), .own_id = own_id};
}

/// An object of the module with a sub-index for each node, also the own one.
std::optional<Service> read_about(std::uint8_t device, std::uint16_t index, std::uint16_t size) {
  if (device > kHighestNode) return std::nullopt;
  Service service = read_local(index, size, device == 0 ? OwnId::kAsSubIndex : OwnId::kNotAsked);
  service.transaction.sub = device;
  return service;
}

/// 0 if nothing was read.
std::uint8_t first_byte(const detail::Job& done) {
  return done.data.empty() ? std::uint8_t{0} : done.data[0];
}

/// Decodes the eight bytes of an EMCY message.
KernelError take(EmcyError& emcy, std::span<const std::uint8_t> message) {
  emcy = {};
  if (message.empty()) return KernelError::kNone;
  emcy.error_code = static_cast<std::uint16_t>(message[0] | message[1] << 8);
  emcy.error_register = message[2];
  std::ranges::copy(message.subspan(3), emcy.error_field.begin());
  return emcy.error_code == 0 ? KernelError::kNone : KernelError::kOther;
}

/// 3003h for a block's TIMEOUT: longer by an eighth and 100 ms, so that the block's timer expires first even
/// if its clock is slow.
std::uint16_t module_timeout(std::uint32_t ms) {
  constexpr std::uint32_t kMargin = 100;
  return ms == 0 ? std::uint16_t{0}
                 : static_cast<std::uint16_t>(std::min(ms + ms / 8 + kMargin, kLongestTimeout));
}

using std::chrono::milliseconds, std::chrono::steady_clock;

void cycle(Link& link, FunctionBlock& block) {
  const auto since = steady_clock::now().time_since_epoch();
  const Time now = std::chrono::duration_cast<std::chrono::microseconds>(since).count();
  link.poll(now);
  block.call(now);
}

/// Cycles until `ended`; false = the deadline came first. Between cycles it waits for the link, at most 10
/// ms.
template <typename Ended>
bool cycle_until(Link& link, FunctionBlock& block, steady_clock::time_point deadline, Ended ended) {
  while (cycle(link, block), !ended()) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - steady_clock::now());
    if (left <= milliseconds(0)) return false;
    pollfd wanted{link.descriptor(), link.events(), 0};
    ::poll(&wanted, 1, static_cast<int>(std::min(left, milliseconds(10)).count()));
  }
  return true;
}

}  // namespace

FunctionBlock::FunctionBlock(Link& link) : link_(link), job_(std::make_unique<detail::Job>()) {}

FunctionBlock::~FunctionBlock() {
  if (job_->window != nullptr) job_->window->remove(*job_);
}

void FunctionBlock::call(Time now) {
  if (enable && !enabled_) start(now);
  if (!enable && enabled_) stop();
  if (enable && job_->stage == detail::Job::Stage::kDone) finish();
  enabled_ = enable;
}

void FunctionBlock::start(Time now) {
  std::optional<Service> wanted = service();
  detail::Window* const chosen = link_.window(network, wanted ? wanted->channel : std::uint8_t{1});
  if (!wanted || chosen == nullptr || timeout > kLongestTimeout) {
    error = KernelError::kInternal;
    return;
  }
  *job_ = {};
  job_->service = std::move(*wanted);
  job_->module_timeout_ms = module_timeout(timeout);
  if (timeout != 0) job_->deadline = now + Time{1000} * timeout;
  chosen->add(*job_);
}

void FunctionBlock::stop() {
  if (job_->window != nullptr) job_->window->remove(*job_);
  *job_ = {};
  confirm = false;
  error = show(*job_);
}

void FunctionBlock::finish() {
  job_->stage = detail::Job::Stage::kIdle;
  const KernelError shown = show(*job_);
  error = job_->error == KernelError::kNone ? shown : job_->error;
  confirm = error == KernelError::kNone;
}

std::optional<Service> Nmt::service() const {
  const auto code = static_cast<std::uint16_t>(state);
  const bool known = std::ranges::any_of(
      regmap::kNmtCommands, [code](const regmap::NmtRow& row) { return row.state_code == code; });
  if (!known || device > kHighestNode) return std::nullopt;
  const std::uint16_t who = device == 0 ? regmap::kNmtAllNodes : device;
  return Service{.transaction = window::sdo_write(0, regmap::kNmtService, who, detail::bytes_of(code)),
                 .on_bus = true};
}

std::optional<Service> RecvEmcy::service() const {
  return read_local(object::kEmergencyScan, 9);
}

KernelError RecvEmcy::show(const detail::Job& done) {
  device = first_byte(done);
  const std::span<const std::uint8_t> bytes = done.data;
  return take(errorinfo, bytes.subspan(bytes.empty() ? 0 : 1));
}

std::optional<Service> RecvEmcyDev::service() const {
  return read_about(device, object::kLastEmergency, 8);
}

KernelError RecvEmcyDev::show(const detail::Job& done) {
  return take(errorinfo, done.data);
}

std::optional<Service> GetLocalNodeId::service() const {
  return read_local(object::kOwnNodeId, 1);
}

KernelError GetLocalNodeId::show(const detail::Job& done) {
  device = first_byte(done);
  return KernelError::kNone;
}

std::optional<Service> GetCanopenKernelState::service() const {
  return read_local(object::kKernelState, 1, OwnId::kAsked);
}

KernelError GetCanopenKernelState::show(const detail::Job& done) {
  state = static_cast<KernelError>(first_byte(done));
  device = done.data.empty() ? std::uint8_t{0} : *done.own_id;
  return KernelError::kNone;
}

std::optional<Service> GetState::service() const {
  return read_about(device, object::kDeviceState, 1);
}

KernelError GetState::show(const detail::Job& done) {
  state = static_cast<DeviceState>(first_byte(done));
  return KernelError::kNone;
}

std::optional<Service> SdoAccess::read(std::size_t size) const {
  if (device > kHighestNode || size == 0 || size > regmap::kMaxDataBytes) return std::nullopt;
  return Service{.transaction = window::sdo_read(device, index, subindex, size),
                 .on_bus = device != 0,
                 .access = true,
                 .channel = channel};
}

std::optional<Service> SdoAccess::write(std::span<const std::uint8_t> bytes, SdoMode mode) const {
  std::optional<Service> service = read(bytes.size());
  if (!service || mode > SdoMode::kBlock) return std::nullopt;
  service->transaction.command = regmap::kSdoWrite;
  service->transaction.data.assign(bytes.begin(), bytes.end());
  service->mode = mode;
  return service;
}

KernelError SdoAccess::show(const detail::Job& done) {
  errorinfo = done.abort_code;
  return KernelError::kNone;
}

std::optional<Service> SdoRead::service() const {
  return read(std::min(data.size(), std::size_t{regmap::kMaxDataBytes}));
}

KernelError SdoRead::show(const detail::Job& done) {
  if (done.data.size() > data.size()) return KernelError::kInternal;
  std::ranges::copy(done.data, data.begin());
  datalength = static_cast<std::uint16_t>(done.data.size());
  return SdoAccess::show(done);
}

std::optional<Service> SdoRead4::service() const {
  return read(data.size());
}

KernelError SdoRead4::show(const detail::Job& done) {
  data = {};
  std::ranges::copy(done.data, data.begin());
  datalength = static_cast<std::uint8_t>(done.data.size());
  return SdoAccess::show(done);
}

std::optional<Service> SdoWrite::service() const {
  return write(data, mode);
}

std::optional<Service> SdoWrite4::service() const {
  if (datalength > data.size()) return std::nullopt;
  return write(std::span(data).first(datalength), SdoMode::kAuto);
}

bool run(FunctionBlock& block, steady_clock::time_point deadline) {
  Link& link = block.link_;
  block.enable = false;
  cycle(link, block);
  block.error = KernelError::kNone;
  block.enable = true;
  const auto ended = [&] { return block.confirm || block.error != KernelError::kNone; };
  if (cycle_until(link, block, deadline, ended)) return block.confirm;
  block.enable = false;  // cancels the execution, also in the module: at most one second
  cycle_until(link, block, steady_clock::now() + std::chrono::seconds(1), [&] { return link.events() == 0; });
  block.error = KernelError::kTimeout;
  return false;
}

}  // namespace cbcan::cia405
