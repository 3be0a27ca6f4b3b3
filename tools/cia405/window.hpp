// SPDX-License-Identifier: MIT
#pragma once

/// One channel of a network: the queue of executions, and the transactions that each of them takes. Knows no
/// socket: it is asked for the next request and given the response.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "cbcan/cia405.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/window.hpp"

namespace cbcan::cia405::detail {

using window::Request, window::Response, window::Result, window::Transaction;

/// Of the module's own object dictionary.
inline Transaction local_read(std::uint16_t index, std::uint16_t size, std::uint16_t sub = 0) {
  return {.command = regmap::kSdoRead, .index = index, .sub = sub, .size = size};
}

/// What a block wants of the window: one object read or written.
struct Service {
  /// Whether the module's own node ID (3001h) is read first, and then is the sub-index.
  enum class OwnId : std::uint8_t { kNotAsked, kAsked, kAsSubIndex };

  Transaction transaction{};
  bool on_bus = false;  ///< the module's SDO time-out matters
  bool access =
      false;  ///< any object: it may be smaller than asked for, and the block can show an abort code
  SdoMode mode = SdoMode::kAuto;
  OwnId own_id = OwnId::kNotAsked;
  std::uint8_t channel = 1;  ///< 0 = any
};

/// One execution of a block, from the rising edge of its `enable` on.
struct Job {
  enum class Stage : std::uint8_t {
    kIdle,         ///< in no queue
    kQueued,       ///< nothing of it has been sent
    kBegun,        ///< at the head of the queue, requests have been sent
    kKernelState,  ///< timed out: its error is what 3002h says
    kDone,
  };

  Stage stage = Stage::kIdle;
  Window* window = nullptr;  ///< in whose queue it is
  Service service{};
  std::optional<Time> deadline{};
  std::uint16_t module_timeout_ms = 0;  ///< 3003h for it

  KernelError error = KernelError::kNone;
  std::uint32_t abort_code = 0;
  std::optional<std::uint8_t> own_id{};
  std::vector<std::uint8_t> data{};  ///< read
};

class Window {
 public:
  /// `changes`, of the network, counts what may have changed 3003h and 3004h of its channels.
  Window(std::uint8_t channel, unsigned& changes) : channel_(channel), changes_(changes) {}

  /// The job is the caller's and stays where it is until it is kDone or has been removed.
  void add(Job& job);
  /// The job is cancelled.
  void remove(Job& job);

  /// Ends what has taken too long.
  void expire(Time now);
  /// The next request, if there is something to do. Its response goes to answered() before next() is called
  /// again.
  std::optional<Request> next();
  void answered(const Response& response);
  /// Every job ends, or goes to that window if there is one, and the job may be there.
  void leave_to(Window* other);

  std::size_t jobs() const { return queue_.size(); }
  /// The module has no such channel.
  bool absent() const { return channel_.absent(); }

 private:
  /// What the transaction under way is for.
  enum class Purpose : std::uint8_t { kTimeout, kMode, kOwnId, kService, kKernelState };

  Transaction next_transaction(const Job& job);
  void ended(const Result& result);
  void succeeded(Job& job, const Result& result);
  void failed(Job& job, std::uint32_t abort_code);
  void finish(Job& job, KernelError error);
  void abandon();

  window::Channel channel_;
  unsigned& changes_;
  std::deque<Job*> queue_;
  Purpose purpose_ = Purpose::kService;
  struct {
    unsigned changes = 0;  ///< when it was so
    std::optional<std::uint16_t> timeout_ms{};
    std::optional<SdoMode> mode{};
  } known_;  ///< values of 3003h and 3004h
};

}  // namespace cbcan::cia405::detail
