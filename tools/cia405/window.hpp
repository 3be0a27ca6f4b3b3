// SPDX-License-Identifier: MIT
#pragma once

/// One channel of a network: the queue of executions, and the transactions of each. Uses no socket: the
/// caller takes the next request and passes the response.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "cbcan/cia405.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"

namespace cbcan::cia405::detail {

using window::Request, window::Response, window::Result, window::Transaction;

/// Low byte first.
inline std::vector<std::uint8_t> bytes_of(std::uint16_t number) {
  return {static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8)};
}

/// A block's request: one object read or written.
struct Service {
  /// Whether the module's own node ID (3001h) is read first, and used as the sub-index.
  enum class OwnId : std::uint8_t { kNotAsked, kAsked, kAsSubIndex };

  Transaction transaction{};
  bool on_bus = false;  ///< the module's SDO time-out matters
  bool access =
      false;  ///< SDO access: the object may be smaller than requested, and the block can show an abort code
  SdoMode mode = SdoMode::kAuto;
  OwnId own_id = OwnId::kNotAsked;
  std::uint8_t channel = 1;  ///< 0 = any
};

/// One execution of a block, from the rising edge of its `enable` on.
struct Job {
  enum class Stage : std::uint8_t {
    kIdle,         ///< not in a queue
    kQueued,       ///< nothing has been sent
    kBegun,        ///< at the head of the queue, requests have been sent
    kKernelState,  ///< timed out: 3002h gives its error
    kDone,
  };

  Stage stage = Stage::kIdle;
  Window* window = nullptr;  ///< whose queue it is in
  Service service{};
  std::optional<Time> deadline{};
  std::uint16_t module_timeout_ms = 0;  ///< value of 3003h

  KernelError error = KernelError::kNone;
  std::uint32_t abort_code = 0;
  std::optional<std::uint8_t> own_id{};
  std::vector<std::uint8_t> data{};  ///< read
};

class Window {
 public:
  /// `changes`: the network's count of events that may have changed 3003h and 3004h of its channels.
  Window(std::uint8_t channel, unsigned& changes) : channel_(channel), changes_(changes) {}

  /// The caller owns the job and keeps it in place until it is kDone or has been removed.
  void add(Job& job);
  /// The job is cancelled.
  void remove(Job& job);

  /// Ends jobs that have taken too long.
  void expire(Time now);
  /// The next request, if any. Its response must go to answered() before next() is called again.
  std::optional<Request> next();
  void answered(const Response& response);
  /// Ends every job, or moves it to `other` if that is not null and the job accepts any channel.
  void leave_to(Window* other);

  std::size_t jobs() const { return queue_.size(); }
  /// The module has no such channel.
  bool absent() const { return channel_.absent(); }

 private:
  /// Purpose of the transaction in progress.
  enum class Purpose : std::uint8_t { kTimeout, kMode, kOwnId, kService, kKernelState };

  Transaction next_transaction(const Job& job);
  void ended(const Result& result);
  void succeeded(Job& job, const Result& result);
  void finish(Job& job, KernelError error);
  void abandon();

  window::Channel channel_;
  unsigned& changes_;
  std::deque<Job*> queue_;
  Purpose purpose_ = Purpose::kService;
  struct {
    unsigned changes = 0;  ///< at the time of these values
    std::optional<std::uint16_t> timeout_ms{};
    std::optional<SdoMode> mode{};
  } known_;  ///< values of 3003h and 3004h
};

}  // namespace cbcan::cia405::detail
