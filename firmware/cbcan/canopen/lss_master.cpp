// SPDX-License-Identifier: MIT
#include "cbcan/canopen/lss_master.hpp"

#include <span>

#include "cbcan/canopen/dictionary/little_endian.hpp"

namespace cbcan {

namespace {

/// Their responses have an error code.
constexpr bool configures(std::uint8_t service) {
  return service == lss::kConfigureNodeId || service == lss::kConfigureBitTiming ||
         service == lss::kStoreConfiguration;
}

constexpr bool has_no_response(std::uint8_t service) {
  return service == lss::kSwitchStateGlobal || service == lss::kActivateBitTiming;
}

}  // namespace

bool LssMaster::start(const Request& request, Time now) {
  const std::uint8_t service = request.service;
  const bool scans = service == lss::kFastscan;
  const bool selects = service == lss::kSelectVendor;
  const bool inquires = service >= lss::kInquireVendor && service <= lss::kInquireNodeId;
  if (!scans && !selects && !inquires && !configures(service) && !has_no_response(service)) return false;
  request_ = request;
  if (scans && request.value == 0) request_.value = kStepMs;
  answer_ = {Outcome::kBusy, service, 0, 0, request.identity};
  part_ = tries_ = 0;
  const bool goes_on = (request.argument >> Request::kGoOn & 1) != 0;
  enter(scans ? (goes_on ? Step::kBegin : Step::kSwitch) : selects ? Step::kSelect : Step::kAsk, now);
  return true;
}

void LssMaster::enter(Step step, Time now) {
  step_ = step;
  heard_ = false;
  const std::uint32_t number = answer_.identity[part_];
  const auto scan = [&](std::uint64_t low, std::uint64_t bit, std::uint64_t part, std::uint64_t next) {
    send(lss::kFastscan, low | bit << 32 | part << 40 | next << 48, now);
  };
  switch (step) {
    case Step::kAsk:
      return send(request_.service, request_.argument | std::uint32_t{request_.value} << 8, now);
    case Step::kSelect: return send(static_cast<std::uint8_t>(lss::kSelectVendor + part_), number, now);
    case Step::kSwitch: return send(lss::kSwitchStateGlobal, lss::kModeWaiting, now);
    case Step::kListen: return send(lss::kInquireNodeId, 0, now);
    case Step::kBegin: return scan(0, lss::kScanStart, 0, 0);
    case Step::kOddOne: return scan(0, lss::kScanLastBit, lss::kSerial, lss::kSerial);
    case Step::kProbe: return scan(number, bit_, part_, part_);
    case Step::kSibling: return scan(number | std::uint64_t{1} << bit_, bit_, part_, part_);
    case Step::kConfirm: return scan(number, 0, part_, (part_ + 1u) % answer_.identity.size());
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

void LssMaster::sent(Time now) {
  if (step_ == Step::kAsk && has_no_response(request_.service)) return end(Outcome::kDone);
  if (step_ == Step::kSwitch) return enter(Step::kListen, now);
  if (step_ == Step::kSelect && part_ != lss::kSerial) {
    ++part_;
    return enter(Step::kSelect, now);
  }
  due_ = now + (step_ < Step::kListen ? kResponseTime : milliseconds(request_.value));
}

void LssMaster::on_frame(const Frame& frame, Time /*now*/) {
  const std::uint8_t expected = step_ == Step::kSelect  ? lss::kSelected
                                : step_ > Step::kListen ? lss::kIdentified
                                                        : outbox_.frame().data[0];
  if (!busy() || outbox_.waiting() || frame.id != lss::kResponseId || frame.flags != 0 ||
      frame.length != lss::kLength || frame.data[0] != expected)
    return;
  heard_ = true;
  if (step_ == Step::kOddOne || step_ == Step::kSibling) answer_.specific = 1;
  if (step_ >= Step::kListen) return;
  if (configures(expected))
    answer_ = {Outcome::kBusy, expected, frame.data[1], frame.data[2], answer_.identity};
  else if (step_ == Step::kAsk)
    answer_.identity[0] = load_word(&frame.data[1]);
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

/// In kProbe silence means that no device has this bit clear.
void LssMaster::time_over(Time now) {
  constexpr std::uint8_t kMostTries = 3;
  if (step_ == Step::kProbe && heard_) return enter(Step::kSibling, now);
  if (step_ == Step::kProbe || step_ == Step::kSibling) {
    if (step_ == Step::kProbe) answer_.identity[part_] |= std::uint32_t{1} << bit_;
    return enter(bit_-- == 0 ? Step::kConfirm : Step::kProbe, now);
  }
  if (step_ == Step::kListen && !heard_) return enter(Step::kBegin, now);
  if (step_ == Step::kListen && ++tries_ != kMostTries) return enter(Step::kSwitch, now);
  if (step_ == Step::kListen || heard_ == (step_ == Step::kOddOne)) return end(Outcome::kNoResponse);
  if (step_ == Step::kBegin) return enter(Step::kOddOne, now);
  if (step_ == Step::kConfirm && part_++ == lss::kSerial) return end(Outcome::kDone);
  answer_.error = static_cast<std::uint8_t>(part_ + 1);
  bit_ = lss::kScanLastBit;
  if ((request_.argument >> part_ & 1) != 0) return enter(Step::kConfirm, now);
  answer_.identity[part_] = 0;
  enter(Step::kProbe, now);
}

}  // namespace cbcan
