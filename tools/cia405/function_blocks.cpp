// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>

#include "cbcan/cia405.hpp"
#include "cbcan/regmap.hpp"
#include "window.hpp"

namespace cbcan::cia405 {

namespace {

namespace object = regmap::object;

constexpr std::uint8_t kHighestNode = 127;
constexpr std::uint32_t kLongestTimeout = std::numeric_limits<std::uint16_t>::max();

using detail::Service;
using OwnId = Service::OwnId;

/// An object of the module with a sub-index for each node, the own one too.
std::optional<Service> read_about(std::uint8_t device, std::uint16_t index, std::uint16_t size) {
  if (device > kHighestNode) return std::nullopt;
  Service service = Service::local(index, size);
  service.sub = device;
  if (device == 0) service.own_id = OwnId::kAsSubIndex;
  return service;
}

/// From the eight bytes of the message.
EmcyError emcy_from(std::span<const std::uint8_t> message) {
  EmcyError emcy;
  emcy.error_code = static_cast<std::uint16_t>(message[0] | message[1] << 8);
  emcy.error_register = message[2];
  std::ranges::copy(message.subspan(3), emcy.error_field.begin());
  return emcy;
}

/// 3003h for a block's TIMEOUT: longer by an eighth and 100 ms, so that the block's timer is the first, also
/// where its clock is slow.
std::uint16_t module_timeout(std::uint32_t ms) {
  constexpr std::uint32_t kMargin = 100;
  return ms == 0 ? std::uint16_t{0}
                 : static_cast<std::uint16_t>(std::min(ms + ms / 8 + kMargin, kLongestTimeout));
}

KernelError verdict(const EmcyError& emcy) {
  return emcy.error_code == 0 ? KernelError::kNone : KernelError::kOther;
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

KernelError FunctionBlock::show(const detail::Job& /*done*/) {
  return KernelError::kNone;
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
  confirm = false;
  error = KernelError::kNone;
  reset();
}

void FunctionBlock::finish() {
  job_->stage = detail::Job::Stage::kIdle;
  error = job_->error;
  if (error == KernelError::kNone)
    error = show(*job_);
  else
    show_abort(job_->abort_code);
  confirm = error == KernelError::kNone;
}

std::optional<Service> Nmt::service() const {
  const auto code = static_cast<std::uint16_t>(state);
  const bool known = std::ranges::any_of(
      regmap::kNmtCommands, [code](const regmap::NmtRow& row) { return row.state_code == code; });
  if (!known || device > kHighestNode) return std::nullopt;
  const std::uint16_t who = device == 0 ? regmap::kNmtAllNodes : device;
  return Service{.write = true,
                 .on_bus = true,
                 .index = regmap::kNmtService,
                 .sub = who,
                 .size = 2,
                 .data = {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8)}};
}

std::optional<Service> RecvEmcy::service() const {
  return Service::local(object::kEmergencyScan, 9);
}

KernelError RecvEmcy::show(const detail::Job& done) {
  device = done.data[0];
  errorinfo = emcy_from(std::span(done.data).subspan(1));
  return verdict(errorinfo);
}

void RecvEmcy::reset() {
  device = 0;
  errorinfo = {};
}

std::optional<Service> RecvEmcyDev::service() const {
  return read_about(device, object::kLastEmergency, 8);
}

KernelError RecvEmcyDev::show(const detail::Job& done) {
  errorinfo = emcy_from(done.data);
  return verdict(errorinfo);
}

void RecvEmcyDev::reset() {
  errorinfo = {};
}

std::optional<Service> GetLocalNodeId::service() const {
  return Service::local(object::kOwnNodeId, 1);
}

KernelError GetLocalNodeId::show(const detail::Job& done) {
  device = done.data[0];
  return KernelError::kNone;
}

void GetLocalNodeId::reset() {
  device = 0;
}

std::optional<Service> GetCanopenKernelState::service() const {
  Service service = Service::local(object::kKernelState, 1);
  service.own_id = OwnId::kAsked;
  return service;
}

KernelError GetCanopenKernelState::show(const detail::Job& done) {
  state = static_cast<KernelError>(done.data[0]);
  device = *done.own_id;
  return KernelError::kNone;
}

void GetCanopenKernelState::reset() {
  state = KernelError::kNone;
  device = 0;
}

std::optional<Service> GetState::service() const {
  return read_about(device, object::kDeviceState, 1);
}

KernelError GetState::show(const detail::Job& done) {
  state = static_cast<DeviceState>(done.data[0]);
  return KernelError::kNone;
}

void GetState::reset() {
  state = DeviceState::kInit;
}

std::optional<Service> SdoAccess::read(std::size_t size) const {
  if (device > kHighestNode || size == 0 || size > regmap::kMaxDataBytes) return std::nullopt;
  return Service{.on_bus = device != 0,
                 .node = device,
                 .index = index,
                 .sub = subindex,
                 .size = static_cast<std::uint16_t>(size),
                 .channel = channel,
                 .has_errorinfo = true};
}

std::optional<Service> SdoAccess::write(std::span<const std::uint8_t> bytes, SdoMode mode) const {
  std::optional<Service> service = read(bytes.size());
  if (!service || mode > SdoMode::kBlock) return std::nullopt;
  service->write = true;
  service->data.assign(bytes.begin(), bytes.end());
  service->mode = mode;
  return service;
}

std::optional<Service> SdoRead::service() const {
  return read(std::min(data.size(), std::size_t{regmap::kMaxDataBytes}));
}

KernelError SdoRead::show(const detail::Job& done) {
  if (done.data.size() > data.size()) return KernelError::kInternal;
  std::ranges::copy(done.data, data.begin());
  datalength = static_cast<std::uint16_t>(done.data.size());
  return KernelError::kNone;
}

void SdoRead::reset() {
  SdoAccess::reset();
  datalength = 0;
}

std::optional<Service> SdoRead4::service() const {
  return read(data.size());
}

KernelError SdoRead4::show(const detail::Job& done) {
  std::ranges::copy(done.data, data.begin());
  datalength = static_cast<std::uint8_t>(done.data.size());
  return KernelError::kNone;
}

void SdoRead4::reset() {
  SdoAccess::reset();
  data = {};
  datalength = 0;
}

std::optional<Service> SdoWrite::service() const {
  return write(data, mode);
}

std::optional<Service> SdoWrite4::service() const {
  if (datalength > data.size()) return std::nullopt;
  return write(std::span(data).first(datalength), SdoMode::kAuto);
}

}  // namespace cbcan::cia405
