// SPDX-License-Identifier: MIT
#include "cbcan/canopen/lss_master.hpp"

#include <span>
#include <utility>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

bool LssMaster::start(const Request& request, Time now) {
  Step first = Step::kAsk;
  switch (request.service) {
    case Service::kSwitchGlobal:
    case Service::kActivate: first = Step::kSend; break;
    case Service::kSelect: first = Step::kSelect; break;
    case Service::kFastscan:
      first = (request.argument >> Request::kGoOn & 1) != 0 ? Step::kBegin : Step::kSwitch;
      break;
    case Service::kSetNodeId:
    case Service::kSetBitRate:
    case Service::kStore: break;
    default:
      if (request.service < Service::kVendor || request.service > Service::kNodeId) return false;
  }
  request_ = request;
  if (request_.value == 0 && request.service == Service::kFastscan) request_.value = kStepMs;
  answer_ = {.outcome = Outcome::kBusy};
  part_ = tries_ = 0;
  enter(first, now);
  return true;
}

void LssMaster::enter(Step step, Time now) {
  constexpr std::size_t kByte = 8;
  step_ = step;
  heard_ = false;
  const std::uint32_t number = request_.identity[part_];
  switch (step) {
    case Step::kSend:
      if (request_.service == Service::kActivate) return send(lss::kActivateBitTiming, request_.value, now);
      [[fallthrough]];
    case Step::kAsk:
      return send(static_cast<std::uint8_t>(request_.service),
                  request_.argument | std::uint32_t{request_.value} << kByte, now);
    case Step::kSelect: return send(static_cast<std::uint8_t>(lss::kSelectVendor + part_), number, now);
    case Step::kSwitch: return send(lss::kSwitchStateGlobal, lss::kModeWaiting, now);
    case Step::kListen: return send(lss::kInquireNodeId, 0, now);
    case Step::kBegin: return scan(0, lss::kScanStart, 0, 0, now);
    case Step::kProbe: return scan(number, bit_, part_, part_, now);
    case Step::kConfirm:
      return scan(number, 0, part_,
                  part_ == lss::kSerial ? std::uint8_t{0} : static_cast<std::uint8_t>(part_ + 1), now);
  }
}

/// Bytes 1..7 of the request, the first one lowest.
void LssMaster::send(std::uint8_t command, std::uint64_t bytes, Time now) {
  Frame& frame = outbox_.frame();
  frame.id = lss::kRequestId;
  frame.length = lss::kLength;
  frame.data[0] = command;
  store_little_endian(std::span(frame.data).subspan(1), bytes);
  due_ = now + kSendTime;
  if (outbox_.send(now)) sent(now);
}

void LssMaster::scan(std::uint32_t number, std::uint8_t bit, std::uint8_t part, std::uint8_t next, Time now) {
  send(lss::kFastscan,
       number | std::uint64_t{bit} << 32 | std::uint64_t{part} << 40 | std::uint64_t{next} << 48, now);
}

/// The port has accepted the step's frame.
void LssMaster::sent(Time now) {
  if (step_ == Step::kSend) return end(Outcome::kDone);
  if (step_ == Step::kSwitch) return enter(Step::kListen, now);
  if (step_ == Step::kSelect && part_ != lss::kSerial) {
    ++part_;
    return enter(Step::kSelect, now);
  }
  due_ = now + (step_ < Step::kListen ? kResponseTime : milliseconds(request_.value));
}

void LssMaster::on_frame(const Frame& frame, Time /*now*/) {
  const bool awaited = busy() && !outbox_.waiting() && frame.id == lss::kResponseId && frame.flags == 0 &&
                       frame.length == lss::kLength;
  const std::uint8_t expected = step_ == Step::kSelect   ? lss::kSelected
                                : step_ == Step::kListen ? lss::kInquireNodeId
                                : step_ > Step::kListen  ? lss::kIdentified
                                                         : outbox_.frame().data[0];
  if (!awaited || frame.data[0] != expected) return;
  heard_ = true;
  if (step_ >= Step::kListen) return;
  const bool may_refuse = request_.service < Service::kSelect;
  answer_.value = request_.service == Service::kNodeId ? frame.data[1] : load_word(&frame.data[1]);
  if (may_refuse) answer_ = {Outcome::kBusy, frame.data[1], frame.data[2], 0};
  end(answer_.error == 0 ? Outcome::kDone : Outcome::kRefused);
}

void LssMaster::poll(Time now) {
  if (!busy()) return;
  if (outbox_.retry(now)) return sent(now);
  if (now < due_) return;
  if (!outbox_.waiting()) return time_over(now);
  outbox_.drop();
  end(Outcome::kNoResponse);
}

/// What a step without further responses means: in kProbe, that no device has this bit clear.
void LssMaster::time_over(Time now) {
  constexpr std::uint8_t kMostTries = 3;
  switch (step_) {
    case Step::kListen:
      if (!heard_) return enter(Step::kBegin, now);
      return ++tries_ == kMostTries ? end(Outcome::kNoResponse) : enter(Step::kSwitch, now);
    case Step::kBegin:
      if (heard_) return begin_part(lss::kVendor, now);
      break;
    case Step::kProbe:
      if (!heard_) request_.identity[part_] |= std::uint32_t{1} << bit_;
      return enter(bit_-- == 0 ? Step::kConfirm : Step::kProbe, now);
    case Step::kConfirm:
      if (heard_ && part_ == lss::kSerial) return end(Outcome::kDone);
      if (heard_) return begin_part(static_cast<std::uint8_t>(part_ + 1), now);
      break;
    default: break;
  }
  end(Outcome::kNoResponse);
}

void LssMaster::begin_part(std::uint8_t part, Time now) {
  part_ = part;
  answer_.error = static_cast<std::uint8_t>(part + 1);
  const bool known = (request_.argument >> part & 1) != 0;
  if (known) return enter(Step::kConfirm, now);
  request_.identity[part] = 0;
  bit_ = lss::kScanLastBit;
  enter(Step::kProbe, now);
}

}  // namespace cbcan
