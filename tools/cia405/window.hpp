// SPDX-License-Identifier: MIT
#pragma once

/// One channel of a network: the queue of executions, and the transactions that each of them takes. Knows no
/// socket: it is asked for the next request and given the response.

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "cbcan/cia405.hpp"
#include "cbcan/window.hpp"

namespace cbcan::cia405::detail {

using window::Request, window::Response, window::Result, window::Transaction;

/// What a block wants of the window: one object read or written.
struct Service {
  /// Whether the module's own node ID (3001h) is read first, and then is the sub-index.
  enum class OwnId : std::uint8_t { kNotAsked, kAsked, kAsSubIndex };

  /// A read of the module's own object dictionary.
  static Service local(std::uint16_t index, std::uint16_t size) {
    return {.exact = true, .index = index, .size = size};
  }

  bool write = false;
  bool on_bus = false;  ///< the module's SDO time-out matters
  bool exact = false;   ///< a response of another size is none
  std::uint8_t node = 0;
  std::uint16_t index = 0;
  std::uint16_t sub = 0;
  std::uint16_t size = 0;
  std::vector<std::uint8_t> data{};  ///< to write
  SdoMode mode = SdoMode::kAuto;
  OwnId own_id = OwnId::kNotAsked;
  std::uint8_t channel = 1;    ///< 0 = any
  bool has_errorinfo = false;  ///< the block can show an abort code
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
  Window* window = nullptr;
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
  explicit Window(std::uint8_t channel) : channel_(channel) {}

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
  /// The connection is gone: every job ends.
  void lost();

  std::size_t jobs() const { return queue_.size(); }
  /// The module has no such channel.
  bool absent() const { return channel_.absent(); }
  /// Every job goes to that window, or ends where it wants this channel and no other.
  void leave_to(Window& other);
  /// 3003h and 3004h of all channels may have become others since the last call.
  bool take_lost_settings() { return std::exchange(lost_settings_, false); }
  void forget_settings();

 private:
  /// What the transaction under way is for.
  enum class Purpose : std::uint8_t { kTimeout, kMode, kOwnId, kService, kKernelState };

  Service next_service(const Job& job);

  void ended(const Result& result);
  void restarted(Job& job);
  void succeeded(Job& job, const Result& result);
  void failed(Job& job, std::uint32_t abort_code);
  void take_kernel_state(Job& job, const Result& result);
  void finish(Job& job, KernelError error);
  void abandon();

  window::Channel channel_;
  bool lost_settings_ = false;
  std::deque<Job*> queue_;
  Purpose purpose_ = Purpose::kService;
  std::optional<std::uint16_t> timeout_known_;  ///< value of 3003h
  std::optional<SdoMode> mode_known_;           ///< value of 3004h
};

}  // namespace cbcan::cia405::detail
