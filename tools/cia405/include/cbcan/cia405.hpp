// SPDX-License-Identifier: MIT
#pragma once

/// The ten function blocks of CiA 405 for a C++ program that runs in cycles, as a PLC program does, on top of
/// the register contract (docs/reference/contract.md) over Modbus TCP. docs/reference/function-blocks.md is
/// the page with tables and an example.
///
///     cbcan::cia405::Link link({.host = "192.168.1.7", .port = 502});
///     cbcan::cia405::SdoRead4 speed(link);
///     ...each cycle:
///     link.poll(now);
///     speed.enable = !speed.confirm && speed.error == cbcan::cia405::KernelError::kNone;
///     speed.call(now);
///
/// Nothing blocks but run() and the look-up of a host's name, nothing else reads a clock, nothing starts a
/// thread; all objects of one Link belong to one
/// thread. Names, numbers and behaviour of the blocks are those of CiA 405 as PLC makers document them; what
/// those leave open is said here.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace cbcan::cia405 {

/// Microseconds since any moment; never goes back.
using Time = std::int64_t;

/// CANOPEN_KERNEL_ERROR. `error` of a block; `state` of GetCanopenKernelState.
enum class KernelError : std::uint8_t {
  kNone = 0x00,
  kOther = 0x01,     ///< `errorinfo` says more; blocks without `errorinfo` never have it
  kOverflow = 0x02,  ///< of the module's send or receive buffers
  kTimeout = 0x03,
  kBusOff = 0x10,
  kErrorPassive = 0x11,
  /// Invalid inputs, a network that does not exist, no connection or one that was lost, a response that is no
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
  kUnknown = 6,   ///< nobody watches the node: neither heartbeat nor guarding
  kNotAvail = 7,  ///< it is watched, and does not report
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
  /// An IP address, or a name: that is looked up at each attempt to connect, by getaddrinfo(3), which may
  /// block; its addresses are tried one after the other.
  std::string host = "127.0.0.1";
  int port = 502;
  Time response_timeout = 1'000'000;  ///< for a connection, and for each Modbus response; then it is lost
  Time reconnect_after = 1'000'000;   ///< between the end of a connection and the next attempt
};

class FunctionBlock;

/// For programs without cycles: one execution of the block, from a rising edge of `enable` to its end.
/// Blocks; its outputs stay until its next execution. False: `error` says why, kTimeout if it is `deadline`
/// that was over first; then the execution is cancelled. A Link whose blocks are run so has no other poll().
bool run(FunctionBlock& block, std::chrono::steady_clock::time_point deadline);

namespace detail {
struct Job;
struct Service;
class Window;
}  // namespace detail

/// One Modbus TCP connection to a module, or to several: Modbus unit ID n is `network` n of a block, and each
/// channel of each network has a window and a queue of its own. One request is under way at a time, so each
/// poll() is at most one step of one transaction; networks and channels take turns.
///
/// In a queue executions are served one after the other in the order of the rising edges of `enable`. The
/// connection makes itself at the first poll() and again after it was lost. When it is lost, or an attempt
/// fails, every execution that is enabled then ends with kInternal.
///
/// The library owns 3003h and 3004h of the module: it writes them whenever an execution needs another
/// time-out or mode. A transaction that it finds under way in R3700 at its first request is cancelled: its
/// program is gone.
class Link {
 public:
  /// Throws std::invalid_argument, with what is wrong, where settings are not in their ranges. Connects
  /// nothing yet.
  explicit Link(LinkSettings settings);
  /// After all of its blocks. An execution under way is not cancelled in the module.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Moves bytes and ends what is over; once per cycle, before the blocks are called.
  void poll(Time now);

  bool connected() const;
  /// Why there is no connection, for people; "" while there is one, or none has been tried.
  std::string problem() const;

  /// For programs that wait with poll(2) instead of a cycle time: the socket, or -1; and what it is waited
  /// for: POLLIN, POLLOUT, or 0 while nothing is under way. Valid until the next poll().
  int descriptor() const;
  short events() const;

 private:
  friend class FunctionBlock;
  detail::Window* window(std::uint8_t number, std::uint8_t channel);
  struct Connected;
  std::unique_ptr<Connected> connected_;
};

/// What all blocks have. Inputs are taken at the rising edge of `enable` and not looked at until the next
/// one; outputs change in call() alone.
///
/// * Done: when the response is there `confirm` is true and stays so until call() finds `enable` false.
/// * Cancelled: call() with `enable` false before that takes the execution back; in the module it is
///   cancelled if it has begun. Nothing that comes later is seen.
/// * Ended by an error: `error` is not kNone, and stays so until call() finds `enable` false.
///
/// After call() with `enable` false all outputs are 0, and the block is ready for the next execution.
class FunctionBlock {
 public:
  bool enable = false;
  /// 1..247: Modbus unit ID. A network without a module is kInternal.
  std::uint8_t network = 1;
  /// In ms, from the rising edge of `enable`, 0..65535; 0 = none. When it is over and the transaction has
  /// begun, that is cancelled, and `error` is the kernel's state if that is an error, else kTimeout. The
  /// module's own time-out (3003h) is set to an eighth and 100 ms more, at most 65535.
  std::uint32_t timeout = 0;

  bool confirm = false;
  KernelError error = KernelError::kNone;

  /// Once per cycle. A block that is not called keeps its outputs, while its execution goes on.
  void call(Time now);

  FunctionBlock(const FunctionBlock&) = delete;
  FunctionBlock& operator=(const FunctionBlock&) = delete;

 protected:
  /// `link` is the caller's and outlives the block.
  explicit FunctionBlock(Link& link);
  /// Cancels what is under way.
  virtual ~FunctionBlock();

 private:
  friend bool run(FunctionBlock& block, std::chrono::steady_clock::time_point deadline);

  /// What the inputs ask for; none = they are invalid.
  virtual std::optional<detail::Service> service() const = 0;
  /// What was read, or an abort code, becomes the specific outputs; others become 0. kNone = confirm.
  virtual KernelError show(const detail::Job& done);

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

  std::uint8_t device = 0;  ///< 1..127; 0 = all, but the own node
  TransitionState state{};

 private:
  std::optional<detail::Service> service() const override;
};

/// RECV_EMCY: goes on with the scan of all devices' last EMCY messages, up to the next that is worth a look.
/// There is one scan in a module, whoever asks.
class RecvEmcy final : public FunctionBlock {
 public:
  explicit RecvEmcy(Link& link) : FunctionBlock(link) {}

  /// Whose message `errorinfo` is. With kOther an error; with `confirm` and `errorinfo` 0 a device whose
  /// errors are over, or 0: nothing found in a full round.
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
      errorinfo{};  ///< with kOther an error; with `confirm` its code is 0, and all is 0 where there was none

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

/// GET_CANOPEN_KERNEL_STATE: how the module's CAN controller is, and its node ID.
class GetCanopenKernelState final : public FunctionBlock {
 public:
  explicit GetCanopenKernelState(Link& link) : FunctionBlock(link) {}

  KernelError state = KernelError::kNone;  ///< kNone, kOverflow, kBusOff or kErrorPassive
  std::uint8_t device = 0;                 ///< 1..127

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// GET_STATE: the NMT state of a device, as heartbeat or node guarding tell it.
class GetState final : public FunctionBlock {
 public:
  explicit GetState(Link& link) : FunctionBlock(link) {}

  std::uint8_t device = 0;  ///< 1..127; 0 = the own node

  DeviceState state = DeviceState::kInit;

 private:
  std::optional<detail::Service> service() const override;
  KernelError show(const detail::Job& done) override;
};

/// What blocks of SDO access have: the object, and the abort code of a transfer that failed.
class SdoAccess : public FunctionBlock {
 public:
  std::uint8_t device = 0;  ///< 1..127; 0 = the module's own object dictionary
  /// 1..16; 0 = any that is free. Executions of different channels with different devices are under way at
  /// the same time. A channel that the module does not have is kInternal.
  std::uint8_t channel = 1;
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;

  std::uint32_t errorinfo = 0;  ///< with kOther the SDO abort code

 protected:
  using FunctionBlock::FunctionBlock;
  /// Of `size` bytes, 1..128.
  std::optional<detail::Service> read(std::size_t size) const;
  std::optional<detail::Service> write(std::span<const std::uint8_t> bytes, SdoMode mode) const;
  KernelError show(const detail::Job& done) override;
};

/// SDO_READ: an object of up to 128 bytes.
class SdoRead final : public SdoAccess {
 public:
  explicit SdoRead(Link& link) : SdoAccess(link) {}

  /// The caller's buffer; its size, 1 or more, is DATALENGTH as an input, and 128 bytes of it are used at
  /// most. It has to stay as it is until the end of the execution, and is written once, with `confirm`.
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
