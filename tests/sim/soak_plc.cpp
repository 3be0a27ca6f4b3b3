// SPDX-License-Identifier: MIT
#include "sim/soak_plc.hpp"

namespace cbcan::test {

namespace {

constexpr std::uint16_t kRead = 5055, kWrite = 5066;
constexpr std::uint16_t kAbsentNode = 99, kNmtObject = 0x1F82, kModeObject = 0x3004;
constexpr Time kLongest = 60 * kSecond;  ///< of a transaction, whatever goes wrong
constexpr std::uint32_t kNoObject = 0x06020000, kTimeout = 0x05040000, kCancelled = 0x08000000;

std::uint16_t word_of(const Bytes& bytes, std::size_t k) {
  const auto at = [&](std::size_t i) { return i < bytes.size() ? bytes[i] : 0u; };
  return static_cast<std::uint16_t>(at(2 * k) | at(2 * k + 1) << 8);
}

/// Command, node, index, sub-index, size and data.
template <class Words>
std::size_t put(const SoakRequest& request, Words words) {
  const auto head = request.head();
  auto next = std::copy(head.begin(), head.end(), words);
  const std::size_t count = (request.data.size() + 1) / 2;
  for (std::size_t k = 0; k < count; ++k)
    *next++ = word_of(request.data, k);
  return head.size() + count;
}

}  // namespace

// ---- Doors

void FlagDoor::begin(const SoakRequest& request) {
  flag() = 0xCA0E;
  const std::size_t count = put(request, network_.registers.begin() + regmap::kCommand);
  network_.written(regmap::kExecuteFlag, 1 + count);
}

std::optional<SoakResult> FlagDoor::look() {
  if (flag() == 0xCA0E) return std::nullopt;
  SoakResult result{flag(), network_.registers.at(regmap::kDataSize)};
  std::copy_n(network_.registers.begin() + regmap::kData, regmap::kDataWords, result.words.begin());
  return result;
}

void ScannerDoor::begin(const SoakRequest& request) {
  number_ = number_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(number_ + 1);
  out_.fill(0);
  out_[0] = number_;
  put(request, out_.begin() + 1);
  exchange();
}

std::optional<SoakResult> ScannerDoor::look() {
  exchange();
  if (in_[0] != number_) return std::nullopt;
  SoakResult result{in_[1], in_[3]};
  std::copy_n(in_.begin() + 4, regmap::kDataWords, result.words.begin());
  return result;
}

void ScannerDoor::exchange() {
  std::copy(out_.begin(), out_.end(), network_.registers.begin() + regmap::kScannerOutFirst);
  network_.written(regmap::kScannerOutFirst, out_.size());
  std::copy_n(network_.registers.begin() + regmap::kScannerInFirst, in_.size(), in_.begin());
}

// ---- The program

void SoakPlc::act() {
  wake_ = network_.now + period_;
  switch (phase_) {
    case Phase::kStarting:
      if (door_.ready()) go_on();
      break;
    case Phase::kIdle: begin(); break;
    case Phase::kWaiting: wait(); break;
  }
}

void SoakPlc::go_on() {
  phase_ = Phase::kIdle;
  period_ = (5 + random_.below(60)) * kMillisecond;
  wake_ = network_.now + random_.below(1050) * kMillisecond;
}

void SoakPlc::begin() {
  request_ = choose();
  begun_ = network_.now;
  begun_in_ = network_.lives;
  cancelled_ = false;
  phase_ = Phase::kWaiting;
  if (request_.kind == SoakRequest::Kind::kNmt) network_.harm();
  door_.begin(request_);
}

void SoakPlc::wait() {
  const Time waited = network_.now - begun_;
  const bool restarted = begun_in_ != network_.lives;
  const bool switched_off = random_.below(20'000) == 0;
  if ((restarted && door_.notices_restart()) || switched_off) {
    end_without_result();
    door_.switch_on();
    phase_ = Phase::kStarting;
    wake_ = network_.now + 3 * kSecond;
  } else if (const auto result = door_.look()) {
    judge(*result);
    result_in_ = network_.lives;
    ++ended;
    go_on();
  } else if (waited > kLongest) {
    complain("no result");
    end_without_result();
  } else if (waited > patience_ && !cancelled_) {
    cancelled_ = true;
    if (!door_.cancel()) end_without_result();
  }
}

void SoakPlc::end_without_result() {
  ++ended;
  ++unknown;
  go_on();
}

SoakRequest SoakPlc::choose_transfer(bool write) {
  const bool number = random_.below(2) == 0;
  SoakRequest request;
  request.kind = write ? SoakRequest::Kind::kWrite : SoakRequest::Kind::kRead;
  request.command = write ? kWrite : kRead;
  request.node = SoakNetwork::kNodes.at(random_.below(3));
  request.index = static_cast<std::uint16_t>((number ? SoakObjects::kNumbers : SoakObjects::kTexts) + place_);
  request.sub = static_cast<std::uint16_t>(1 + random_.below(SoakObjects::kSubs));
  request.size = number ? 4 : SoakObjects::kMostBytes;
  if (!write) return request;
  if (!number) request.size = static_cast<std::uint16_t>(5 + random_.below(SoakObjects::kMostBytes - 4));
  request.id = ++id_;
  request.data = written_by(request.id, request.size);
  return request;
}

SoakRequest SoakPlc::choose() {
  using Kind = SoakRequest::Kind;
  constexpr std::array<std::uint8_t, 4> kServices{1, 128, 129, 130};
  const std::uint32_t chance = random_.below(1000);
  SoakRequest request = choose_transfer(chance % 2 == 0 && chance >= 30);
  if (chance < 20) {
    request.kind = Kind::kMissing;
    request.index = 0x2FFF;
  } else if (chance < 26) {
    request.kind = Kind::kAbsent;
    request.node = kAbsentNode;
  } else if (chance < 28) {
    request = {Kind::kNmt, kWrite, 0, kNmtObject, request.node, 1, 0, {kServices.at(random_.below(4))}};
  } else if (chance < 30) {
    constexpr std::array<std::uint8_t, 3> kModes{0, 2, 3};
    request = {Kind::kMode, kWrite, 0, kModeObject, 0, 1, 0, {kModes.at(random_.below(3))}};
  } else if (request.kind == Kind::kRead && chance < 500) {
    request = {Kind::kClock, kRead, request.node, SoakObjects::kClock, 0, 4, 0, {}};
  }
  return request;
}

// ---- The model

void SoakPlc::judge(const SoakResult& result) {
  if (result.code == 0) return judge_good(result);
  if (result.code == 4) return judge_abort(result.number());
  const bool first_of_module = result.code == 5 && !door_.notices_restart() && result_in_ != network_.lives;
  if (!first_of_module) return complain("result " + std::to_string(result.code));
  ++unknown;
}

void SoakPlc::judge_good(const SoakResult& result) {
  ++good;
  switch (request_.kind) {
    case SoakRequest::Kind::kRead:
      if (!was_there(result.bytes())) complain("read a wrong value");
      break;
    case SoakRequest::Kind::kWrite:
      if (!was_there(request_.data)) complain("believed a write that was not executed");
      break;
    case SoakRequest::Kind::kClock:
      if (!is_now(result)) complain("read an old value");
      break;
    case SoakRequest::Kind::kNmt:
    case SoakRequest::Kind::kMode: break;
    case SoakRequest::Kind::kMissing:
    case SoakRequest::Kind::kAbsent: complain("found what is not there"); break;
  }
}

/// The object has these bytes, or had them since the request began.
bool SoakPlc::was_there(const Bytes& bytes) const {
  const Witness::Object& object = network_.node(static_cast<std::uint8_t>(request_.node))
                                      .object(request_.index, static_cast<std::uint8_t>(request_.sub));
  return object.now == bytes || (object.before == bytes && object.changed >= begun_);
}

/// The node's clock, in 32 bits, has been read since the request began.
bool SoakPlc::is_now(const SoakResult& result) const {
  const std::uint32_t age = static_cast<std::uint32_t>(network_.now) - result.number();
  return result.size == 4 && age <= network_.now - begun_;
}

void SoakPlc::judge_abort(std::uint32_t code) {
  ++failed;
  if (code == 0) return complain("an abort without a code");
  if (cancelled_ && code == kCancelled) return;
  if (request_.kind == SoakRequest::Kind::kAbsent && code == kTimeout) return;
  if (request_.kind == SoakRequest::Kind::kMissing && code == kNoObject) return;
  if (network_.quiet_since(begun_)) complain("abort " + std::to_string(code) + " where nothing goes wrong");
}

void SoakPlc::complain(const std::string& what) {
  constexpr std::size_t kEnough = 20;
  if (wrong.size() == kEnough) return;
  wrong.push_back("PLC " + std::to_string(place_) + ", " + std::to_string(network_.now) + " us, node " +
                  std::to_string(request_.node) + ", object " + std::to_string(request_.index) + ":" +
                  std::to_string(request_.sub) + ", begun " + std::to_string(begun_) + ": " + what);
}

}  // namespace cbcan::test
