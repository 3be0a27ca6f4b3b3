// SPDX-License-Identifier: MIT
#pragma once

/// One SDO client and the requests of a PLC to it: one at a time, with its services, its checks and its
/// result (docs/reference/contract.md). A channel has the window R3700..R3769, a scanner window or both; if
/// both have a request they take turns. Requests to other nodes use the channel's own client, those to the
/// own node the LocalNode that all channels share.
///
/// The owner calls the functions below as described for Coprocessor, and poll() at the time that it returned,
/// or that due() returns after another call. Not re-entrant.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/built_if.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/configuration.hpp"
#include "cbcan/coprocessor/local_node.hpp"
#include "cbcan/coprocessor/register_window.hpp"
#include "cbcan/coprocessor/scanner_window.hpp"
#include "cbcan/coprocessor/settings.hpp"
#include "cbcan/regmap.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class Channel {
 public:
  /// `number`: from 0, for OtherChannels.
  Channel(RegisterWindow window, ScannerWindow scanner, LocalNode& node, CanPort& port,
          const CoprocessorSettings& settings, std::uint8_t number = 0)
      : window_(window),
        number_(number),
        node_(node),
        port_(port),
        settings_(settings),
        client_(port, data_),
        scanner_(scanner) {}
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  void start(Time now);

  void on_sdo_response(const Frame& frame, Time now);
  /// A node, 1..127, has reported its state.
  void on_news(std::uint8_t node, NodeMonitor::News news, Time now) {
    if (news == NodeMonitor::News::kBootUp) {
      client_.on_boot_up(node, now);
      follow_sdo();
    }
    if (activity_ == Activity::kNodeState && node == node_of_service_)
      end_node_state(node_.monitor().last_state(node));
  }
  /// One request of the PLC has written registers first..first+count-1, some of them in OUT, which begins at
  /// `out`.
  void on_registers_written(std::size_t out, std::size_t first, std::size_t count, Time now) {
    if constexpr (!kServices.scanner_window) return;
    const std::size_t from = std::max(first, out);
    const std::size_t end = std::min(first + count, out + kScannerOutWords);
    if (!scanner_->on_written(from - out, end - from)) return;
    if (activity_ != Activity::kIdle && served_ == Window::kScanner) {
      ++counters_.cancelled;
      cancel(now);
    }
    wake_at(now);
  }

  Time poll(Time now) {
    if (now >= due_) work(now);
    return due_;
  }
  Time due() const { return due_; }
  void wake_at(Time time) {
    if (time < due_) due_ = time;
  }
  /// The own node may be due earlier.
  void follow_node() { wake_at(node_.deadline()); }
  /// Call it before each poll() of a channel that has the window R3700..R3769.
  void check_flag(Time now) {
    const bool execute = window_.flag() == regmap::kExecute;
    if (execute != flagged_) on_flag(execute, now);
  }

  struct Counters {
    std::uint32_t executed = 0;   ///< requests begun, of either window
    std::uint32_t failed = 0;     ///< ended with a result other than 0
    std::uint32_t cancelled = 0;  ///< cancelled by the PLC while in progress
  };
  const Counters& counters() const { return counters_; }
  const CoprocessorSettings& settings() const { return settings_; }
  /// The request in R3700..R3769 has been copied and is in progress.
  bool executes_registers() const {
    return serves_registers() && activity_ != Activity::kIdle && activity_ != Activity::kHeldBack;
  }
  CanPort& port() const { return port_; }
  SdoClient& sdo_client() { return client_; }
  const SdoClient& sdo_client() const { return client_; }
  /// 3003h and 3004h of each window; R3700..R3769 first.
  std::array<Transfers, 2>& all_transfers() { return transfers_; }

  // What OtherChannels needs:

  struct Request {
    std::uint16_t command;
    std::uint16_t node;
    std::uint16_t index;
    std::uint16_t sub;
    std::uint16_t size;
  };
  /// The request that waits or is in progress. Each word is read once: the PLC may write to it at any time.
  Request request() const {
    const volatile std::uint16_t* const word = words() - regmap::kWindowFirst;
    return {word[regmap::kCommand], word[regmap::kNodeId], word[regmap::kObjectIndex],
            word[regmap::kObjectSubIndex], word[regmap::kDataSize]};
  }
  /// The other node whose SDO server the request uses; 0 = none. A request that begin() rejects may name one
  /// too.
  std::uint8_t server_of(const Request& request) const {
    const bool write = request.command == regmap::kSdoWrite;
    const bool service = write ? request.index == regmap::kNmtService
                               : request.index == regmap::kNodeStateService && request.sub == 0;
    if (service || request.node == settings_.node_id || request.node > nmt::kMaxNode) return 0;
    return static_cast<std::uint8_t>(request.node);
  }
  std::uint8_t number() const { return number_; }
  /// When another channel may send a request to this node; kNever = not before the end of this channel's
  /// transfer.
  Time node_free_from(std::uint8_t node, Time now) { return client_.node_free_from(node, now); }
  /// An NMT command or a node state request is in progress.
  bool in_service() const { return activity_ == Activity::kNmtCommand || activity_ == Activity::kNodeState; }
  void begin(Time now);
  /// The request waits until resume(); the PLC may write it again meanwhile.
  void hold_back();
  bool held_back() const { return activity_ == Activity::kHeldBack; }
  /// Hands the request to OtherChannels again.
  void resume(Time now);
  /// The own node has been reset.
  void reset();

 private:
  enum class Activity : std::uint8_t { kIdle, kHeldBack, kSdo, kNmtCommand, kNodeState };
  /// The two windows. Each has its own 3003h and 3004h, which are written through it.
  enum class Window : std::uint8_t { kRegisters, kScanner };

  void work(Time now);
  void on_flag(bool execute, Time now);
  void begin_waiting(Time now);
  void begin_between_boots(Time now);
  void follow_sdo();
  /// The words of the request, in the order of R3700..R3769.
  const std::uint16_t* words() const { return serves_registers() ? window_.words() : scanner_->words(); }
  std::uint16_t* data_words() const;
  void load_data(std::uint8_t* to, std::size_t size) const;
  void begin_nmt(std::uint16_t addressed, Time now);
  void begin_node_state(std::uint8_t node, Time now);
  void begin_local(bool read, std::uint16_t index, std::uint8_t sub, std::size_t size, Time now);
  void begin_sdo(const Request& request, SdoClient::Direction direction, Time now);
  void cancel(Time now);
  bool others_wait() const;
  void leave();
  void send_command(Time now);
  void end_sdo();
  void end_node_state(nmt::State state) { end_with_state(static_cast<std::uint8_t>(state)); }
  void end_node_state_unanswered(Time now);
  void end_with_state(std::uint8_t state) { end_read(&state, 1); }
  void end_read(const std::uint8_t* bytes, std::size_t size);
  void end(AbortCode code);
  void finish(regmap::Result result, std::size_t size = 0);
  bool serves_registers() const { return !kServices.scanner_window || served_ == Window::kRegisters; }
  bool scanner_waits() const { return kServices.scanner_window && scanner_->waiting(); }
  Transfers& transfers() { return transfers_[static_cast<std::size_t>(served_)]; }

  RegisterWindow window_;
  bool flagged_ = false;  ///< the last poll has seen CA0Eh in R3700: its request waits or is in progress
  Activity activity_ = Activity::kIdle;
  Window served_ = Window::kScanner;  ///< whose request is in progress, or was last
  SdoClient::Direction direction_ = SdoClient::Direction::kRead;  ///< of the SDO transfer
  bool command_refused_ = false;
  std::uint8_t number_;
  std::uint8_t node_of_service_ = 0;             ///< of the NMT command (0 = all) or the node state request
  nmt::Command command_ = nmt::Command::kStart;  ///< of the NMT service
  Time due_ = 0;            ///< poll() has work to do then; may be too early, never too late
  Time deadline_ = kNever;  ///< of an NMT command or a node state request
  LocalNode& node_;
  CanPort& port_;
  CoprocessorSettings settings_;
  SdoClient client_;
  [[no_unique_address]] BuiltIf<kServices.scanner_window, ScannerWindow> scanner_;
  std::array<Transfers, 2> transfers_{};  ///< 3003h and 3004h, by Window
  Counters counters_;
  std::array<std::uint8_t, regmap::kMaxDataBytes> data_;  ///< of the client's transfer
};

/// What the own node, the first channel and the manager ask of further channels (further_channels.hpp): an
/// interface, so that an image without them does not contain their code.
class OtherChannels {
 public:
  /// A request is waiting in this channel: calls its begin() or its hold_back().
  virtual void begin_or_hold_back(Channel& channel, Time now) = 0;
  /// For the manager: when it may send a request to this node; kNever = not yet.
  virtual Time node_free_from(std::uint8_t node, Time now) = 0;
  /// A response that the first channel does not await.
  virtual void on_sdo_response(const Frame& frame, Time now) = 0;
  // Events, which wake the first channel when another is due: for all of them,
  virtual void on_registers_written(std::size_t first, std::size_t count, Time now) = 0;
  // and for the further ones.
  virtual void on_news(std::uint8_t node, NodeMonitor::News news, Time now) = 0;
  virtual void poll(Time now) = 0;
  virtual void add_to(Channel::Counters& sums) const = 0;

  /// Number of further channels.
  std::size_t count() const { return count_; }
  /// A request waits for the end of another one.
  bool any_waits() const { return waiting_count_ != 0; }

 protected:
  ~OtherChannels() = default;

  std::size_t count_ = 0;
  std::size_t waiting_count_ = 0;
};

}  // namespace cbcan
