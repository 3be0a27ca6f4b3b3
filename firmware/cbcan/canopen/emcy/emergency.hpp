// SPDX-License-Identifier: MIT
#pragma once

/// EMCY producer (CiA 301, 7.2.7): one message when an error occurs and one when it has ended, never repeated.
/// Objects, if the dictionary has them: 1001h error register, 1003h error history, 1014h COB-ID, 1015h inhibit
/// time in 100 us. Without 1014h nothing is sent. Nothing blocks, nothing is allocated; not re-entrant.

#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/count.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// Error codes of a device's communication (CiA 301, table 26); those of PDOs are in pdo.hpp.
enum class EmergencyCode : std::uint16_t {
  kReset = 0x0000,
  kOverflow = 0x8110,  ///< the controller has lost frames
  kErrorPassive = 0x8120,
  kBusOffRecovered = 0x8140,
  kHeartbeat = 0x8130,   ///< life guard error or heartbeat error
  kSyncLength = 0x8240,  ///< SYNC with a counter although 1019h is 0, or the reverse
};

/// Bits of the error register, 1001h.
struct ErrorRegister {
  static constexpr std::uint8_t kGeneric = 0x01;
  static constexpr std::uint8_t kCurrent = 0x02;
  static constexpr std::uint8_t kVoltage = 0x04;
  static constexpr std::uint8_t kTemperature = 0x08;
  static constexpr std::uint8_t kCommunication = 0x10;
  static constexpr std::uint8_t kProfile = 0x20;
  static constexpr std::uint8_t kManufacturer = 0x80;
};

/// Observes the messages that are sent.
class EmergencyApplication {
 public:
  /// The port has accepted this message; bytes as on the bus.
  virtual void on_emergency_sent(const std::array<std::uint8_t, 8>& /*message*/) {}

 protected:
  ~EmergencyApplication() = default;
};

class Emergency : public Part {
 public:
  /// Limits of errors present and of messages waiting. What exceeds them is not reported, only counted.
  static constexpr std::size_t kMostErrors = 16;
  static constexpr std::size_t kMostWaiting = 16;

  /// The manufacturer's five bytes of a message.
  using Info = std::array<std::uint8_t, 5>;

  Emergency(ObjectDictionary& dictionary, CanPort& port, EmergencyApplication& application)
      : dictionary_(dictionary), port_(port), application_(application) {}

  static constexpr bool owns(std::uint16_t index) {
    return index == object::kErrorHistory || index == object::kEmergencyCobId ||
           index == object::kEmergencyInhibitTime;
  }
  AbortCode check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const;
  void configure(std::uint16_t index, Time now);
  /// Initialising begins: what has been reported is forgotten, but with `application` = false 1001h shows the
  /// errors again.
  void forget(bool application);
  /// Clears 1003h, but for errors since forget().
  void reset(std::uint8_t node_id, Time now);
  /// Messages go out in Pre-operational and Operational; in other states they wait.
  void on_state(nmt::State state, Time now);
  void poll(Time now) {
    if (now >= due_) send_waiting(now);
  }
  Time deadline() const { return due_; }

  /// The error with this code is present, with these bits of 1001h (the generic bit is added). Reported once
  /// until error_over().
  void error(std::uint16_t code, std::uint8_t register_bits, const Info& info, Time now);
  /// The error has ended: sends EMCY 0000h with the remaining bits of 1001h.
  void error_over(std::uint16_t code, Time now);
  bool has(std::uint16_t code) const { return place_of(code) != error_count_; }

  struct Counters {
    Count sent{};
    Count lost{};  ///< errors or messages beyond the limits
  };
  const Counters& counters() const { return counters_; }

 private:
  struct Error {
    std::uint16_t code;
    std::uint8_t register_bits;
  };
  struct Message {
    std::uint16_t code;
    std::uint8_t error_register;
    Info info;
  };

  static constexpr std::uint8_t kMostRemembered = 254;  ///< in 1003h

  std::size_t place_of(std::uint16_t code) const;
  void enqueue(const Message& message, Time now);
  void remember(const Message& message);
  void clear_history();
  void send_waiting(Time now);
  std::uint8_t update_register();

  std::uint8_t error_count_ = 0;
  std::uint8_t first_waiting_ = 0;
  std::uint8_t waiting_count_ = 0;
  bool running_ = false;
  std::uint32_t cob_id_ = 0;
  std::uint32_t inhibit_time_ = 0;  ///< us
  ObjectDictionary& dictionary_;
  CanPort& port_;
  EmergencyApplication& application_;
  Time due_ = kNever;
  Time next_allowed_ = 0;  ///< by the inhibit time
  std::array<Error, kMostErrors> errors_;
  std::array<Message, kMostWaiting> waiting_;
  Counters counters_;
};

}  // namespace cbcan
