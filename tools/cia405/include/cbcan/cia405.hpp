// SPDX-License-Identifier: MIT
#pragma once

/// The ten function blocks of CiA 405 for a C++ program that runs in cycles like a PLC program, based on the
/// register contract (docs/reference/contract.md) over Modbus TCP. docs/reference/function-blocks.md has
/// tables and an example.
///
///     cbcan::cia405::Link link({.host = "192.168.1.7", .port = 502});
///     cbcan::cia405::SdoRead4 speed(link);
///     ...each cycle:
///     link.poll(now);
///     speed.enable = !speed.confirm && speed.error == cbcan::cia405::KernelError::kNone;
///     speed.call(now);
///
/// Only run() and the look-up of a host name block, and only run() reads a clock. No threads are started; all
/// objects of one Link belong to one thread. Names, numbers and behaviour of the blocks are those of CiA 405
/// as PLC makers document them; what they leave open is defined here.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace cbcan::cia405 {

/// Microseconds since any moment; never goes backwards.
using Time = std::int64_t;

/// CANOPEN_KERNEL_ERROR: `error` of a block, `state` of GetCanopenKernelState.
enum class KernelError : std::uint8_t {
  kNone = 0x00,
  kOther = 0x01,     ///< `errorinfo` has details; never set by blocks without `errorinfo`
  kOverflow = 0x02,  ///< of the module's send or receive buffers
  kTimeout = 0x03,
  kBusOff = 0x10,
  kErrorPassive = 0x11,
  /// Invalid inputs, a network that does not exist, no connection or a lost one, a response that is not the
  /// result of a transaction.
  kInternal = 0x21,
};

/// TRANSITION_STATE of Nmt.
enum class TransitionState : std::uint16_t {
  kStopRemoteNode = 0x0004,
  kStartRemoteNode = 0x0005,
  kResetNode = 0x0006,
  kResetCommunication = 0x0007,
  kEnterPreOperational = 0x007F,
  kAllExceptNmtAndSender = 0x0800,  ///< not implemented: kInternal
};

/// DEVICE_STATE of GetState.
enum class DeviceState : std::uint8_t {
  kInit = 0,
  kResetComm = 1,
  kResetApp = 2,
  kPreOperational = 3,
  kStopped = 4,
  kOperational = 5,
  kUnknown = 6,   ///< the node is not monitored, neither by heartbeat nor by guarding
  kNotAvail = 7,  ///< the node is monitored, and does not report
};

/// SDO_MODE of SdoWrite.
enum class SdoMode : std::uint8_t { kAuto = 0, kExpedited = 1, kSegmented = 2, kBlock = 3 };

/// EMCY_ERROR: an EMCY message (CiA 301, 7.2.7).
struct EmcyError {
  std::uint16_t error_code = 0;
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> error_field{};

  bool operator==(const EmcyError&) const = default;
};

struct LinkSettings {
  /// An IP address or a name. A name is looked up at each attempt to connect, by getaddrinfo(3), which may
  /// block; its addresses are tried one after the other.
  std::string host = "127.0.0.1";
  int port = 502;
  Time response_timeout = 1'000'000;  ///< for a connection, and for each Modbus response; then it is lost
  Time reconnect_after = 1'000'000;   ///< between the end of a connection and the next attempt
};

class FunctionBlock;

/// One execution of the block for programs without cycles, from a rising edge of `enable` to its end.
/// Blocks. The outputs stay until the next execution. False: `error` says why; it is kTimeout if `deadline`
/// passed first, and the execution is cancelled. Do not also call poll() of a Link whose blocks are run this
/// way.
bool run(FunctionBlock& block, std::chrono::steady_clock::time_point deadline);

namespace detail {
struct Job;
struct Service;
class Window;
}  // namespace detail

/// One Modbus TCP connection to a module, or to several: Modbus unit ID n is `network` n of a block, and each
/// channel of each network has its own window and queue. One request is in progress at a time, so each poll()
/// is at most one step of one transaction; networks and channels take turns.
///
/// In a queue, executions are served one after the other in the order of the rising edges of `enable`. The
/// first poll() makes the connection, and a later one makes it again after a loss. When it is lost, or an
/// attempt fails, every enabled execution ends with kInternal.
///
/// The library owns 3003h and 3004h of the module: it writes them whenever an execution needs another timeout
/// or mode. Its first request cancels a transaction in progress in R3700: the program that started it no
/// longer runs.
class Link {
 public:
  /// Throws std::invalid_argument if a setting is out of range. Does not connect yet.
  explicit Link(LinkSettings settings);
  /// Must outlive its blocks. An execution in progress is not cancelled in the module.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Sends, receives and handles timeouts; call once per cycle, before the blocks.
  void poll(Time now);

  bool connected() const;
  /// Why there is no connection, as text; "" while there is one, or before the first attempt.
  std::string problem() const;

  /// Socket for programs that wait with poll(2) instead of a cycle time, or -1, and its events: POLLIN,
  /// POLLOUT, or 0 while nothing is in progress. Valid until the next poll().
  int descriptor() const;
  short events() const;

 private:
  friend class FunctionBlock;
  detail::Window* window(std::uint8_t number, std::uint8_t channel);
  struct Connected;
  std::unique_ptr<Connected> connected_;
};

/// Common to all blocks. Inputs are read only at the rising edge of `enable`; outputs change only in call().
///
/// * Done: `confirm` becomes true with the response, and stays true until call() finds `enable` false.
/// * Cancelled: call() with `enable` false before that cancels the execution, also in the module if it has
///   begun there. Later responses are ignored.
/// * Ended by an error: `error` is not kNone, and stays unchanged until call() finds `enable` false.
///
/// After call() with `enable` false all outputs are 0, and the block is ready for the next execution.
class FunctionBlock {
 public:
  bool enable = false;
  /// 1..247: Modbus unit ID. A network without a module gives kInternal.
  std::uint8_t network = 1;
  /// Limit in ms, from the rising edge of `enable`, 0..65535; 0 = none. When it expires after the transaction
  /// has begun, the transaction is cancelled, and `error` is the kernel's state if that is an error, else
  /// kTimeout. The module's own timeout (3003h) is set to an eighth and 100 ms more, at most 65535.
  std::uint32_t timeout = 0;

  bool confirm = false;
  KernelError error = KernelError::kNone;

  /// Call once per cycle. A block that is not called keeps its outputs, while its execution continues.
  void call(Time now);

  FunctionBlock(const FunctionBlock&) = delete;
  FunctionBlock& operator=(const FunctionBlock&) = delete;

 protected:
  /// The caller owns `link`, which outlives the block.
  explicit FunctionBlock(Link& link);
  /// Cancels an execution in progress.
  virtual ~FunctionBlock();

 private:
  friend bool run(FunctionBlock& block, std::chrono::steady_clock::time_point deadline);

  /// The service that the inputs request; none = invalid inputs.
  virtual std::optional<detail::Service> service() const = 0;
  /// Sets the block's own outputs from the data or abort code; the others to 0. kNone = confirm.
  virtual KernelError show(const detail::Job& /*done*/) { return KernelError::kNone; }

  void start(Time now);
  void stop();
  void finish();

  Link& link_;
  bool enabled_ = false;
  std::unique_ptr<detail::Job> job_;
};

/// NMT: changes the NMT state of a device, or of all.
class Nmt final : public FunctionBlock {
 public:
  explicit Nmt(Link& link) : FunctionBlock(link) {}

  std::uint8_t device = 0;  ///< 1..127; 0 = all, except the own node
  TransitionState state{};

 private:
  std::optional<detail::Service> service() const override;
};

/// RECV_EMCY: continues the scan of all devices' last EMCY messages, up to the next one to report. A module
/// has one scan, common to all clients.
class RecvEmcy final : public FunctionBlock {
 public:
  explicit RecvEmcy(Link& link) : FunctionBlock(link) {}

  /// The device that sent `errorinfo`. With kOther an error. With `confirm` and `errorinfo` 0 a device whose
  /// errors have ended; or 0: nothing found in a full round.
  std::uint8_t device = 0;
  EmcyError errorinfo{};

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// RECV_EMCY_DEV: the last EMCY message of a device.
class RecvEmcyDev final : public FunctionBlock {
 public:
  explicit RecvEmcyDev(Link& link) : FunctionBlock(link) {}

  std::uint8_t device = 0;  ///< 1..127; 0 = the own node

  EmcyError
      errorinfo{};  ///< with kOther an error; with `confirm` its code is 0; all 0 if there was no message

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// GET_LOCAL_NODE_ID: the module's node ID.
class GetLocalNodeId final : public FunctionBlock {
 public:
  explicit GetLocalNodeId(Link& link) : FunctionBlock(link) {}

  std::uint8_t device = 0;  ///< 1..127

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// GET_CANOPEN_KERNEL_STATE: the state of the module's CAN controller, and its node ID.
class GetCanopenKernelState final : public FunctionBlock {
 public:
  explicit GetCanopenKernelState(Link& link) : FunctionBlock(link) {}

  KernelError state = KernelError::kNone;  ///< kNone, kOverflow, kBusOff or kErrorPassive
  std::uint8_t device = 0;                 ///< 1..127

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// GET_STATE: the NMT state of a device, from heartbeat or node guarding.
class GetState final : public FunctionBlock {
 public:
  explicit GetState(Link& link) : FunctionBlock(link) {}

  std::uint8_t device = 0;  ///< 1..127; 0 = the own node

  DeviceState state = DeviceState::kInit;

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// Common to the SDO blocks: the object, and the abort code of a failed transfer.
class SdoAccess : public FunctionBlock {
 public:
  std::uint8_t device = 0;  ///< 1..127; 0 = the module's own object dictionary
  /// 1..16; 0 = any free channel. Executions on different channels with different devices run at the same
  /// time. A channel that the module does not have gives kInternal.
  std::uint8_t channel = 1;
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;

  std::uint32_t errorinfo = 0;  ///< with kOther the SDO abort code

 protected:
  using FunctionBlock::FunctionBlock;
  /// Service that reads `size` bytes, 1..128.
  std::optional<detail::Service> read(std::size_t size) const;
  std::optional<detail::Service> write(std::span<const std::uint8_t> bytes, SdoMode mode) const;
  KernelError show(const detail::Job& done) override;
};

/// SDO_READ: an object of up to 128 bytes.
class SdoRead final : public SdoAccess {
 public:
  explicit SdoRead(Link& link) : SdoAccess(link) {}

  /// The caller's buffer; its size, at least 1, is DATALENGTH as an input; at most 128 bytes are used. It
  /// must stay valid and unchanged until the end of the execution, and is written once, with `confirm`.
  std::span<std::uint8_t> data{};

  std::uint16_t datalength = 0;  ///< bytes read

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// SDO_READ4: an object of up to 4 bytes.
class SdoRead4 final : public SdoAccess {
 public:
  explicit SdoRead4(Link& link) : SdoAccess(link) {}

  std::array<std::uint8_t, 4> data{};  ///< low byte first; bytes from `datalength` on are 0
  std::uint8_t datalength = 0;         ///< bytes read

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// SDO_WRITE: an object of up to 128 bytes.
class SdoWrite final : public SdoAccess {
 public:
  explicit SdoWrite(Link& link) : SdoAccess(link) {}

  SdoMode mode = SdoMode::kAuto;
  std::span<const std::uint8_t> data{};  ///< copied at the rising edge; its size, 1..128, is DATALENGTH

 private:
  std::optional<detail::Service> service() const override;
};

/// SDO_WRITE4: an object of up to 4 bytes.
class SdoWrite4 final : public SdoAccess {
 public:
  explicit SdoWrite4(Link& link) : SdoAccess(link) {}

  std::array<std::uint8_t, 4> data{};  ///< low byte first
  std::uint8_t datalength = 0;         ///< 1..4

 private:
  std::optional<detail::Service> service() const override;
};

}  // namespace cbcan::cia405
