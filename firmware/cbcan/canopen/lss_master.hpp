// SPDX-License-Identifier: MIT
#pragma once

/// Layer setting services, the master's side (CiA 305): finds devices that have no node ID, and gives devices
/// a node ID and a bit rate. One request at a time; it ends after its time limits at the latest:
///
///   lss::             on the bus        ends
///   kSwitchStateGlobal, kActivateBitTiming
///                     04h, 15h          when it is sent: they have no response
///   kSelectVendor     40h..43h          with the response, or after kResponseTime
///   kConfigureNodeId, kConfigureBitTiming, kStoreConfiguration
///                     11h, 13h, 17h     the same
///   kInquireVendor.. kInquireNodeId
///                     5Ah..5Eh          the same
///   kFastscan         04h, 5Eh, 51h..   after up to 263 steps
///
/// A scan finds one device without a node ID and puts it into the configuration state, where the other
/// services concern it. A part of the identity that is known takes one step, an unknown one 33 to 65: a bit
/// that is clear is also asked for the opposite, which shows whether there is another device. Each step lasts
/// its whole time, as several devices may respond to it, each in its own time. A device that takes longer is
/// not found, or the scan ends without one, but never with another one. Before that all devices are put into
/// the waiting state, and asked whether one has missed that, as a second one in the configuration state would
/// get the same node ID. Without this, kGoOn finds the next device. Devices with CANopenNode then respond to
/// every step; a request that has no response by the standard shows that, and the scan ends with kNoResponse.
///
/// Nothing blocks, nothing is allocated; not re-entrant. Decided where the standard is not specific: frames
/// of other lengths than 8 are ignored, and so are responses to another service.

#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/lss.hpp"
#include "cbcan/canopen/outbox.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class LssMaster {
 public:
  static constexpr Time kResponseTime = 2 * kSecond;  ///< devices store in flash meanwhile
  static constexpr Time kSendTime = kSecond;          ///< for the port to accept a frame
  static constexpr std::uint16_t kStepMs = 20;

  struct Request {
    /// Bits of `argument`, by number: the first four are those of the known parts of the identity.
    static constexpr std::uint8_t kGoOn = 7;

    std::uint8_t service = 0;  ///< command specifier, of a selection its first one
    // Bytes 1 to 3 of the frame; of a scan see above, and the time of a step in ms, 0 = kStepMs.
    std::uint8_t argument = 0;
    std::uint16_t value = 0;
    lss::Identity identity{};  ///< of a selection or a scan
  };

  enum class Outcome : std::uint8_t { kNone, kBusy, kDone, kRefused, kNoResponse };
  struct Answer {
    Outcome outcome = Outcome::kNone;
    std::uint8_t service = 0;
    std::uint8_t error = 0;     ///< of kRefused; of a scan: parts that were reached, 0 = no device responds
    std::uint8_t specific = 0;  ///< error 255: the manufacturer's code; a scan: 1 = several devices fit
    lss::Identity identity{};   ///< that a scan has found; the first is the value of an inquiry
  };

  /// It outlives this.
  explicit LssMaster(CanPort& port) : outbox_(port) {}

  /// False: there is no such service. A request in progress ends without an outcome.
  bool start(const Request& request, Time now);
  /// A frame from the bus; ignored unless it is an LSS response.
  void on_frame(const Frame& frame, Time /*now*/);
  /// Does what is due.
  void poll(Time now);
  Time deadline() const { return busy() ? earlier(due_, outbox_.deadline()) : kNever; }

  bool busy() const { return answer_.outcome == Outcome::kBusy; }
  const Answer& answer() const { return answer_; }
  const Request& request() const { return request_; }

 private:
  /// kListen and the following ones last their whole time.
  enum class Step : std::uint8_t {
    kSelect,
    kAsk,
    kSwitch,
    kListen,
    kBegin,
    kOddOne,
    kProbe,
    kSibling,
    kConfirm
  };

  void enter(Step step, Time now);
  void send(std::uint8_t command, std::uint64_t bytes, Time now);
  void sent(Time now);
  void time_over(Time now);
  void end(Outcome outcome) { answer_.outcome = outcome; }

  Outbox outbox_;
  Request request_;
  Answer answer_;
  Step step_ = Step::kAsk;
  std::uint8_t part_ = 0;
  std::uint8_t bit_ = 0;
  std::uint8_t tries_ = 0;
  bool heard_ = false;  ///< a response in this step
  Time due_ = kNever;
};

}  // namespace cbcan
