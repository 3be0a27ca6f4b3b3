// SPDX-License-Identifier: MIT
#pragma once

/// The PLC's side of the register window (docs/reference/contract.md) for C++ programs, over Modbus TCP and
/// RTU. It needs POSIX and libmodbus.
///
///     cbcan::window::Client client({.host = "192.168.1.7"});
///     const auto name = client.execute(cbcan::window::sdo_read(1, 0x1008, 0));
///     if (name.code == 0) use(name.data);
///
/// `Client` is for programs that may block: each call returns with its response or at its timeout. `Channel`
/// is for programs that may not block: it uses no socket and no clock, returns which registers to write and
/// read next, and takes their words. Nothing here starts a thread; an object belongs to one thread at a time.
/// Addresses are Modbus addresses: R3700 is 3700.

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cbcan::window {

/// One Modbus request for holding registers: FC 16 if it only writes, FC 3 if it only reads, FC 23, which
/// writes first, if it does both (Modbus Application Protocol V1.1b3, section 6).
struct Request {
  std::uint16_t write_address = 0;
  std::vector<std::uint16_t> words{};  ///< to write
  std::uint16_t read_address = 0;
  std::uint16_t count = 0;  ///< of registers to read
};

struct Response {
  std::uint8_t exception = 0;          ///< exception code; 0 = none
  std::vector<std::uint16_t> words{};  ///< as many as the request reads
};

/// What a PLC program writes to R3701..R3705, and the data that follow.
struct Transaction {
  std::uint16_t command = 0;  ///< 5055 = SDO read, 5066 = SDO write
  std::uint16_t node = 0;     ///< 1..127; 0 = the coprocessor itself
  std::uint16_t index = 0;
  std::uint16_t sub = 0;
  std::uint16_t size = 0;            ///< in bytes, 1..128: of `data`, or the longest value to be read
  std::vector<std::uint8_t> data{};  ///< to write, low byte first
};

/// Request of at most `size` bytes. Numbers are not checked here.
Transaction sdo_read(unsigned node, unsigned index, unsigned sub, std::size_t size = 128);
Transaction sdo_write(unsigned node, unsigned index, unsigned sub, std::vector<std::uint8_t> data);

/// The outcome of a transaction.
struct Result {
  /// False: the module has restarted, or another program has written to the window. Whether the transaction
  /// was executed is unknown, and the other members are meaningless.
  bool known = true;
  std::uint16_t code =
      0;  ///< R3700: 0 = done, 4 = SDO abort; in a scanner window 5 = restarted, not executed
  std::uint32_t abort_code = 0;      ///< with code 4
  std::uint16_t size = 0;            ///< R3705, in bytes
  std::vector<std::uint8_t> data{};  ///< after a successful read: `size` bytes, at most as many as requested
};

/// The start rule (docs/reference/contract.md, TX-10). `written` and `now` begin at R3700 and may be short.
/// False: R3701..R3704 differ from the request, so a 0 in R3700 is not its result: the module has restarted.
bool is_known(std::span<const std::uint16_t> written, std::span<const std::uint16_t> now);
inline constexpr const char* kNotKnown =
    "the module has restarted, or another program has written to R3701..R3704; it is not known whether the "
    "request was carried out";

/// SDO abort codes that programs treat specially (CiA 301, table 22).
namespace abort_code {
inline constexpr std::uint32_t kTimedOut = 0x0504'0000;
inline constexpr std::uint32_t kWriteOnly = 0x0601'0001;
inline constexpr std::uint32_t kReadOnly = 0x0601'0002;
inline constexpr std::uint32_t kNoObject = 0x0602'0000;
inline constexpr std::uint32_t kNoSubIndex = 0x0609'0011;
}  // namespace abort_code

/// One channel of a module, with one transaction at a time: channel 1 uses R3700..R3769, the others a scanner
/// window. The caller carries out the request of next(), and passes the response to answered() before it
/// calls next() again; without a response it calls lost().
class Channel {
 public:
  /// How to treat a transaction found in R3700: cancel it as a remnant, or wait before each transaction until
  /// that of another program has ended. In a scanner window it is always cancelled.
  enum class Found : std::uint8_t { kIsCancelled, kIsWaitedFor };

  /// `number` is 1..16.
  explicit Channel(unsigned number, Found found = Found::kIsCancelled) : number_(number), found_(found) {}

  unsigned number() const { return number_; }
  /// A transaction has begun and has no result yet.
  bool busy() const { return stage_ != Stage::kIdle; }
  /// Not busy, and a transaction begun now would be the next request.
  bool ready() const { return !busy() && flag_ == Flag::kClear; }
  /// The next request cancels the transaction.
  bool cancelling() const { return flag_ == Flag::kToCancel; }
  /// The last response brought no result: the next request may be delayed.
  bool waiting() const { return waiting_; }
  /// Waiting for another program's transaction.
  bool occupied() const { return waiting_ && stage_ == Stage::kBegun; }
  /// The module has no such channel, and the transaction has ended without a result; known after the first
  /// response.
  bool absent() const { return absent_; }

  /// Call only when not busy.
  void begin(Transaction transaction);
  /// The last transaction begun.
  const Transaction& transaction() const { return transaction_; }
  /// Ends the transaction without a result.
  void cancel();

  /// None = there is nothing to do.
  std::optional<Request> next();
  /// An exception ends the transaction without a result.
  void answered(const Response& response);
  /// Call when the connection is lost: ends the transaction without a result.
  void lost();
  /// The result, once.
  std::optional<Result> take() { return std::exchange(result_, std::nullopt); }

 private:
  /// What the module may still hold apart from the transaction.
  enum class Flag : std::uint8_t { kUnknown, kClear, kToCancel };
  enum class Stage : std::uint8_t { kIdle, kBegun, kSent };
  enum class Asked : std::uint8_t { kNothing, kClear, kLook, kStart, kPoll };

  bool is_scanner() const { return number_ != 1; }
  Request clear();
  Request look();
  Request start();
  Request poll();
  void on_head(std::span<const std::uint16_t> words);
  void on_poll(std::span<const std::uint16_t> words);
  bool is_ours(std::span<const std::uint16_t> words) const;
  bool has_ended(std::span<const std::uint16_t> words) const;
  Result result_in(std::span<const std::uint16_t> words) const;

  unsigned number_;
  Found found_;
  Flag flag_ = Flag::kUnknown;
  Stage stage_ = Stage::kIdle;
  Asked asked_ = Asked::kNothing;
  bool waiting_ = false;
  bool absent_ = false;
  std::uint16_t request_number_ = 0;  ///< of the last request through a scanner window
  Transaction transaction_{};
  std::optional<Result> result_{};
};

/// Thrown when a Client has no result. The text names the server and the registers.
class Error : public std::runtime_error {
 public:
  enum class Cause : std::uint8_t {
    kNoConnection,  ///< over TCP: unknown name, refused, or no response to the attempt
    kNoDevice,      ///< over RTU: the device cannot be opened, or another program uses it
    kNoResponse,    ///< no Modbus response in time; the connection has ended
    kNoNetwork,     ///< exception 0Ah: there is no network with this unit ID
    kException,     ///< any other Modbus exception
    kNoResult,      ///< R3700 was CA0Eh for longer than Settings::timeout; the transaction is cancelled
    kUnknown,       ///< see Result::known
    kNoWindow,      ///< the registers are not a CBCAN window
    kInterrupted,   ///< by Settings::interrupted; the transaction is cancelled
    kNoDescriptor,  ///< when a Client is made: it needs one below 1024 (FD_SETSIZE), for libmodbus's select()
  };

  Error(Cause why, const std::string& text) : std::runtime_error(text), cause(why) {}

  Cause cause;
};

/// Where the module is, and how long to wait for it.
struct Settings {
  std::string host = "127.0.0.1";                    ///< IP address or name, of a Modbus TCP server
  int port = 502;                                    ///< 1..65535
  std::string rtu{};                                 ///< serial device; empty = TCP
  int baud = 19200;                                  ///< of the device; one of kBaudRates
  char parity = 'E';                                 ///< E, O, or N, which has two stop bits
  int unit = 1;                                      ///< 0..247; over RTU the station, 1..247
  std::chrono::milliseconds timeout{5000};           ///< for a transaction and another program's before it
  std::chrono::milliseconds response_timeout{1000};  ///< for a connection, and each Modbus response
  std::function<bool()> interrupted{};               ///< called while waiting; true = cancel
  std::function<void()> occupied{};  ///< called when waiting for another program's transaction
  /// Lets the plant's time pass, instead of waiting in real time; then the timeouts count what has passed.
  std::function<void(std::chrono::milliseconds)> pass{};
};

/// Settings::pass of a simulator, on a manual clock too, by the command `pass` (docs/reference/commands.md).
/// `control`: its CBCAN_CONTROL, HOST:PORT. None if that is null or no TCP address. Throws Error, as does the
/// function that it returns: no connection.
std::function<void(std::chrono::milliseconds)> plant_time(const char* control);

inline constexpr std::array kBaudRates{1200,  2400,   4800,   9600,   19200, 38400,
                                       57600, 115200, 230400, 460800, 921600};

class Connection;

/// R3700..R3769 and all other registers of one module. Connects at the first call, and again in the call
/// after one that has lost the connection. All calls block, at most for the timeouts, and throw Error. A
/// failed read over RTU is repeated once, as it changes nothing.
class Client {
 public:
  explicit Client(Settings settings);
  ~Client();
  Client(Client&& other) noexcept;

  /// One transaction through R3700, from CA0Eh to its result, in which `known` is always true.
  Result execute(const Transaction& transaction);
  std::vector<std::uint16_t> read(std::uint16_t address, std::size_t count);
  void write(std::uint16_t address, std::span<const std::uint16_t> words);
  /// Any request, to any unit ID; the response may be an exception. For use with Channel.
  Response exchange(int unit, const Request& request);
  Response exchange(const Request& request) { return exchange(settings_.unit, request); }

  /// Waits, as Settings::pass says.
  void pause(std::chrono::milliseconds duration);
  /// Time since any moment; never goes backwards.
  std::chrono::microseconds now() const;

  /// The server, as named in errors.
  std::string place() const;

 private:
  Response checked(const Request& request);
  std::optional<Response> attempt(int unit, const Request& request);
  void wait_for_result();
  void wait_for_connection(bool first);
  bool interrupted() const { return settings_.interrupted && settings_.interrupted(); }
  [[noreturn]] void give_up(Error::Cause why, const std::string& before, const std::string& after);

  Settings settings_;
  std::unique_ptr<Connection> connection_;
  Channel channel_{1, Channel::Found::kIsWaitedFor};
  std::chrono::microseconds passed_{};  ///< by Settings::pass
};

}  // namespace cbcan::window
