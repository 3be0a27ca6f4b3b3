// SPDX-License-Identifier: MIT
// Every kind of transfer, every frame of it, every harm that can be done to that frame. What has to come of
// it is in one table, by what the frame is; and whatever comes of it, the rules at the end of this file hold.

#include "fault_rig.hpp"
#include "support/catch.hpp"
#include "support/frame_text.hpp"

namespace cbcan::test {
namespace {

constexpr Transfer kTransfers[] = {
    {"expedited read", false, 0, 4},  {"expedited write", true, 0, 4}, {"segmented read", false, 2, 20},
    {"segmented write", true, 2, 20}, {"block read", false, 3, 40},    {"block write", true, 3, 40},
};

/// What a frame is within its transfer.
enum class Role {
  // from the server
  kExpedited,
  kUpload,
  kSegment,
  kLastSegment,
  kWritten,
  kDownload,
  kTaken,
  kLastTaken,
  kBlockDownload,
  kAcknowledge,
  kLastAcknowledge,
  kBlockDownloadEnd,
  kBlockUpload,
  kBlockSegment,
  kBlockUploadEnd,
  // from the client
  kInitiate,
  kRequest,
  kLastRequest,
  kBlockOut,
  kBlockOutLast,
  kStart,
  kConfirm,
  kEnd,
  kGoodbye,
};

std::vector<FaultRig::WireFrame> undisturbed(const Transfer& transfer) {
  FaultRig rig(transfer);
  REQUIRE(rig.run(transfer, 0, FaultRig::kTimeout));
  REQUIRE(rig.reg(3700) == 0);
  rig.settle();
  return rig.wire();
}

Role role_of_response(const Transfer& transfer, std::uint8_t command, bool last) {
  if (transfer.mode == 0) return transfer.write ? Role::kWritten : Role::kExpedited;
  if (transfer.mode == 2) {
    if (command == 0x41) return Role::kUpload;
    if (command == 0x60) return Role::kDownload;
    if (transfer.write) return last ? Role::kLastTaken : Role::kTaken;
    return last ? Role::kLastSegment : Role::kSegment;
  }
  switch (command) {
    case 0xA4: return Role::kBlockDownload;
    case 0xA2: return last ? Role::kLastAcknowledge : Role::kAcknowledge;
    case 0xA1: return Role::kBlockDownloadEnd;
    case 0xC6: return Role::kBlockUpload;
    default: return (command & 0xE3) == 0xC1 ? Role::kBlockUploadEnd : Role::kBlockSegment;
  }
}

Role role_of_request(const Transfer& transfer, std::size_t number, std::uint8_t command, bool last,
                     bool closes_block) {
  if (number == 0) return Role::kInitiate;
  if (transfer.mode != 3) return last ? Role::kLastRequest : Role::kRequest;
  if (!transfer.write)
    return command == 0xA3 ? Role::kStart : command == 0xA2 ? Role::kConfirm : Role::kGoodbye;
  if ((command & 0xE3) == 0xC1) return Role::kEnd;
  return closes_block ? Role::kBlockOutLast : Role::kBlockOut;
}

Role role(const Transfer& transfer, const std::vector<FaultRig::WireFrame>& wire, std::size_t number) {
  const auto& [from_peer, frame] = wire[number];
  const bool next_from_other = number + 1 == wire.size() || wire[number + 1].from_peer != from_peer;
  const std::size_t from_end = wire.size() - 1 - number;
  if (!from_peer) return role_of_request(transfer, number, frame.data[0], from_end == 1, next_from_other);
  // The last of its kind: of segmented transfers the last frame, of acknowledgements the one before the end.
  return role_of_response(transfer, frame.data[0], from_end == (transfer.mode == 3 ? 2u : 0u));
}

constexpr std::uint32_t kOk = 0;
constexpr std::uint32_t kTimedOut = 0x05040000;
constexpr std::uint32_t kSync = 0x05040001;
constexpr std::uint32_t kBlockSize = 0x05040002;
constexpr std::uint32_t kSequence = 0x05040003;
constexpr std::uint32_t kCrc = 0x05040004;
constexpr std::uint32_t kReadLength = 0x05040005;
constexpr std::uint32_t kToggle = 0x05030000;
constexpr std::uint32_t kObjectLength = 0x06070010;
constexpr std::uint32_t kServersOwn = 0x06090030;
constexpr std::uint32_t kRefused = SdoPeer::kRefusal;
constexpr std::uint32_t kDeviceState = 0x08000022;

using Harm = FaultRig::Harm;
using Arrivals = FaultRig::Arrivals;

/// `mutate` changes the frame's bytes.
template <typename Mutate>
Harm changed(Mutate mutate) {
  return [mutate](const Frame& frame) {
    Frame other = frame;
    mutate(other);
    return Arrivals{{0, other}};
  };
}

using Outcomes = std::map<Role, std::uint32_t>;

struct Fault {
  const char* name;
  Harm harm;
  Outcomes outcome;  ///< of the transfer, by the frame that is hit; others are not hit
  /// A copy that comes when the next request has left cannot be told from its response: CANopen has no
  /// transaction numbers. CAN repeats a frame at once, so the next transfer begins after that.
  bool repeats = false;
};

using enum Role;

// A segment of a block is asked for again; for anything else the client waits in vain.
const Outcomes kLostResponse{
    {kExpedited, kTimedOut},   {kUpload, kTimedOut},          {kSegment, kTimedOut},
    {kLastSegment, kTimedOut}, {kWritten, kTimedOut},         {kDownload, kTimedOut},
    {kTaken, kTimedOut},       {kLastTaken, kTimedOut},       {kBlockDownload, kTimedOut},
    {kAcknowledge, kTimedOut}, {kLastAcknowledge, kTimedOut}, {kBlockDownloadEnd, kTimedOut},
    {kBlockUpload, kTimedOut}, {kBlockSegment, kOk},          {kBlockUploadEnd, kTimedOut}};
const Outcomes kOtherObject{{kExpedited, kTimedOut}, {kUpload, kTimedOut},        {kWritten, kTimedOut},
                            {kDownload, kTimedOut},  {kBlockDownload, kTimedOut}, {kBlockUpload, kTimedOut}};
const std::vector<Fault> kFaults{
    {"dropped response", [](const Frame&) { return Arrivals{}; }, kLostResponse},
    {"dropped request",
     [](const Frame&) { return Arrivals{}; },
     {{kInitiate, kTimedOut},
      {kRequest, kTimedOut},
      {kLastRequest, kTimedOut},
      {kBlockOut, kOk},
      {kBlockOutLast, kTimedOut},
      // Not told to start, the server does not understand that it is asked for the rest.
      {kStart, kRefused},
      {kConfirm, kTimedOut},
      {kEnd, kTimedOut},
      {kGoodbye, kOk}}},
    {"duplicated",
     [](const Frame& frame) {
       return Arrivals{{0, frame}, {0, frame}};
     },
     {{kExpedited, kOk},
      {kUpload, kSync},
      {kSegment, kToggle},
      {kLastSegment, kOk},
      {kWritten, kOk},
      {kDownload, kSync},
      {kTaken, kToggle},
      {kLastTaken, kOk},
      {kBlockDownload, kSync},
      // Confirms more segments than the next sub-block has.
      {kAcknowledge, kSequence},
      {kLastAcknowledge, kSync},
      {kBlockDownloadEnd, kOk},
      // C6h among the segments of a block is one with number 70.
      {kBlockUpload, kSequence},
      {kBlockSegment, kOk},
      {kBlockUploadEnd, kOk},
      {kRequest, kRefused},
      {kLastRequest, kOk},
      {kBlockOut, kOk},
      {kGoodbye, kOk}},
     true},
    {"delayed past the timeout",
     [](const Frame& frame) {
       return Arrivals{{FaultRig::kTimeout * 3 / 2, frame}};
     },
     kLostResponse},
    {"wrong toggle",
     changed([](Frame& frame) { frame.data[0] ^= 0x10; }),
     {{kSegment, kToggle}, {kLastSegment, kToggle}, {kTaken, kToggle}, {kLastTaken, kToggle}}},
    {"last bit too early", changed([](Frame& frame) { frame.data[0] |= 1; }), {{kSegment, kObjectLength}}},
    // Asked for one segment more than there are, the server refuses.
    {"last bit missing", changed([](Frame& frame) { frame.data[0] &= 0xFE; }), {{kLastSegment, kRefused}}},
    {"wrong command specifier",
     changed([](Frame& frame) { frame.data[0] = 0xE0; }),
     {{kExpedited, kSync},
      {kUpload, kSync},
      {kSegment, kSync},
      {kLastSegment, kSync},
      {kWritten, kSync},
      {kDownload, kSync},
      {kTaken, kSync},
      {kLastTaken, kSync},
      {kBlockDownload, kSync},
      {kAcknowledge, kSync},
      {kLastAcknowledge, kSync},
      {kBlockDownloadEnd, kSync},
      {kBlockUpload, kSync},
      {kBlockUploadEnd, kSync}}},
    {"wrong index", changed([](Frame& frame) { frame.data[1] = 0x01; }), kOtherObject},
    {"wrong sub-index", changed([](Frame& frame) { frame.data[3] = 0x01; }), kOtherObject},
    {"short DLC", changed([](Frame& frame) { frame.length = 0; }), kLostResponse},
    {"DLC without the multiplexer's last byte",
     changed([](Frame& frame) { frame.length = 3; }),
     {{kExpedited, kTimedOut},
      {kUpload, kTimedOut},
      {kSegment, kTimedOut},
      {kWritten, kTimedOut},
      {kDownload, kTimedOut},
      {kBlockDownload, kTimedOut},
      {kBlockUpload, kTimedOut},
      {kBlockSegment, kOk}}},
    {"size one above",
     changed([](Frame& frame) { ++frame.data[4]; }),
     {{kUpload, kReadLength}, {kBlockUpload, kReadLength}}},
    {"size one below",
     changed([](Frame& frame) { --frame.data[4]; }),
     {{kUpload, kObjectLength}, {kBlockUpload, kObjectLength}}},
    {"size FFFF FFFFh",
     changed([](Frame& frame) { std::fill(frame.data.begin() + 4, frame.data.end(), 0xFF); }),
     {{kUpload, kReadLength}, {kBlockUpload, kReadLength}}},
    {"bad CRC",
     changed([](Frame& frame) { frame.data[1] ^= 1; }),
     {{kBlockUploadEnd, kCrc}, {kEnd, kRefused}}},
    {"sequence number 0", changed([](Frame& frame) { frame.data[0] = 0; }), {{kBlockSegment, kSequence}}},
    {"sequence number beyond the sub-block",
     changed([](Frame& frame) { frame.data[0] = 7; }),
     {{kBlockSegment, kSequence}}},
    {"sequence number of a segment not sent",
     changed([](Frame& frame) { frame.data[1] = 5; }),
     {{kAcknowledge, kSequence}, {kLastAcknowledge, kSequence}}},
    {"block size 0",
     changed([](Frame& frame) { frame.data[frame.data[0] == 0xA4 ? 4 : 2] = 0; }),
     {{kBlockDownload, kBlockSize}, {kAcknowledge, kBlockSize}, {kLastAcknowledge, kBlockSize}}},
    {"block size 128",
     changed([](Frame& frame) { frame.data[frame.data[0] == 0xA4 ? 4 : 2] = 128; }),
     {{kBlockDownload, kBlockSize}, {kAcknowledge, kBlockSize}, {kLastAcknowledge, kBlockSize}}},
};

std::vector<std::uint8_t> counting_from(std::uint8_t first, std::size_t count) {
  std::vector<std::uint8_t> bytes;
  while (bytes.size() < count)
    bytes.push_back(first++);
  return bytes;
}

/// The rules that hold whatever was done to the transfer.
struct Rules {
  Rules(FaultRig& rig, const Transfer& transfer) : rig_(rig), transfer_(transfer) {}

  /// Within three SDO timeouts: the longest way is silence, the question for the rest, and silence again.
  void check_outcome(std::uint32_t expected) {
    const bool in_time = rig_.run(transfer_, 0, 3 * FaultRig::kTimeout);
    CHECK(in_time);
    CHECK(rig_.code() == expected);
    if (rig_.reg(3700) == 0) check_success(0);
    check_one_abort_and_silence();
  }

  /// Whatever is still under way, the next transfer is not touched by it.
  void check_next() {
    rig_.mend();
    const Transfer next{"next", false, 0, transfer_.size};
    CHECK(rig_.run(next, 0x40, 3 * FaultRig::kTimeout));
    CHECK(rig_.code() == 0);
    CHECK(rig_.data() == counting_from(0x40, next.size));
    rig_.settle();
  }

  bool was_aborted() const { return aborts_ != 0; }

 private:
  void check_success(std::uint8_t first) {
    const auto expected = counting_from(first, transfer_.size);
    if (transfer_.write) {
      const auto written = rig_.peer().written();
      CHECK(std::vector<std::uint8_t>(written.begin(), written.end()) == expected);
    } else {
      CHECK(rig_.data() == expected);
    }
  }

  /// At most one abort, with this transfer's multiplexer and the code that the PLC sees, and no frame after
  /// it.
  void check_one_abort_and_silence() {
    for (const auto& [from_peer, frame] : rig_.wire()) {
      if (from_peer) continue;
      if (aborts_ != 0) FAIL_CHECK("after the abort: " << text_of(frame));
      if (frame.data[0] != 0x80) continue;
      ++aborts_;
      char text[32];
      const std::uint32_t code = rig_.code();
      std::snprintf(text, sizeof text, "605#80002000%02X%02X%02X%02X", code & 0xFF, code >> 8 & 0xFF,
                    code >> 16 & 0xFF, code >> 24);
      CHECK(text_of(frame) == text);
    }
  }

  FaultRig& rig_;
  const Transfer& transfer_;
  unsigned aborts_ = 0;
};

/// The server is told, but after its own abort.
bool server_is_told(std::uint32_t code) {
  return code != kOk && code != kRefused;
}

TEST_CASE("fault sweep: every harm to every frame of every kind of transfer") {
  unsigned cases = 0;
  for (const Transfer& transfer : kTransfers) {
    const auto wire = undisturbed(transfer);
    for (std::size_t number = 0; number < wire.size(); ++number) {
      for (const Fault& fault : kFaults) {
        const auto expected = fault.outcome.find(role(transfer, wire, number));
        if (expected == fault.outcome.end()) continue;
        INFO(transfer.name << ", frame " << number << " " << text_of(wire[number].frame) << ": "
                           << fault.name);
        FaultRig rig(transfer);
        rig.hurt(number, fault.harm);
        Rules rules(rig, transfer);
        rules.check_outcome(expected->second);
        CHECK(rules.was_aborted() == server_is_told(expected->second));
        if (fault.repeats) rig.settle();
        rules.check_next();
        ++cases;
      }
    }
  }
  CHECK(cases == 200);
}

TEST_CASE("fault sweep: the server aborts, or boots, at every frame of every kind of transfer") {
  for (const Transfer& transfer : kTransfers) {
    const auto wire = undisturbed(transfer);
    for (std::size_t number = 0; number < wire.size(); ++number) {
      const bool over = role(transfer, wire, number) == Role::kGoodbye;
      for (const auto& [instead, code] :
           {std::pair{"585#8000200030000906", kServersOwn}, std::pair{"585#8000000030000906", kServersOwn},
            std::pair{"585#8000200000000000", std::uint32_t{0x08000000}},
            std::pair{"705#00", kDeviceState}}) {
        INFO(transfer.name << ", frame " << number << ": " << instead);
        FaultRig rig(transfer);
        rig.interrupt(number, frame_from(instead));
        Rules rules(rig, transfer);
        rules.check_outcome(over ? kOk : code);
        CHECK_FALSE(rules.was_aborted());
        if (over) rig.settle();
        rules.check_next();
      }
    }
  }
}

TEST_CASE("fault sweep: the port refuses each frame of every kind of transfer once") {
  for (const Transfer& transfer : kTransfers) {
    const auto wire = undisturbed(transfer);
    const auto sent =
        std::count_if(wire.begin(), wire.end(), [](const auto& frame) { return !frame.from_peer; });
    for (std::size_t number = 0; number < static_cast<std::size_t>(sent); ++number) {
      INFO(transfer.name << ", try " << number);
      FaultRig rig(transfer);
      rig.refuse(number, false);
      Rules rules(rig, transfer);
      rules.check_outcome(kOk);
      rig.settle();
      CHECK(rig.wire().size() + (number + 1 == static_cast<std::size_t>(sent) ? 1u : 0u) >= wire.size());
      rules.check_next();
    }
  }
}

TEST_CASE("fault sweep: the port refuses every frame from each one on") {
  for (const Transfer& transfer : kTransfers) {
    const auto wire = undisturbed(transfer);
    std::size_t sent = 0;
    for (std::size_t number = 0; number < wire.size(); ++number) {
      if (wire[number].from_peer) continue;
      INFO(transfer.name << ", frame " << number);
      FaultRig rig(transfer);
      rig.refuse(sent++, true);
      Rules rules(rig, transfer);
      rules.check_outcome(role(transfer, wire, number) == Role::kGoodbye ? kOk : kTimedOut);
      CHECK_FALSE(rules.was_aborted());  // there was no way to tell
      rules.check_next();
    }
  }
}

}  // namespace
}  // namespace cbcan::test
