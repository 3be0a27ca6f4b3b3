// SPDX-License-Identifier: MIT
#pragma once

/// The PLC's side of the register window over Modbus TCP or RTU. Every call blocks for as long as its
/// time-out allows.

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "cbcan/regmap.hpp"

struct _modbus;

namespace cbcan::tools {

/// SDO abort codes (CiA 301, table 22) that mean something to a command.
namespace abort_code {
inline constexpr std::uint32_t kTimedOut = 0x0504'0000;
inline constexpr std::uint32_t kWriteOnly = 0x0601'0001;
inline constexpr std::uint32_t kReadOnly = 0x0601'0002;
inline constexpr std::uint32_t kNoObject = 0x0602'0000;
inline constexpr std::uint32_t kNoSubIndex = 0x0609'0011;
}  // namespace abort_code

/// No connection, or it was lost, or what came back was no Modbus. The text says what to do.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// R3700 stayed CA0Eh for longer than anybody wanted to wait.
class NoResult : public ConnectionError {
 public:
  using ConnectionError::ConnectionError;
};

/// The person pressed Ctrl-C; the transaction has been cancelled.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Where the Modbus server is: at the serial device where one is named, else at host and port.
struct Target {
  std::string host = "127.0.0.1";
  int port = 1502;
  std::string rtu;                          ///< serial device; empty = TCP
  int baud = 115200;                        ///< one of kBaudRates
  char parity = 'E';                        ///< E, O, or N, which takes two stop bits
  int unit = 1;                             ///< the station, over RTU
  std::chrono::milliseconds timeout{5000};  ///< for R3700 to change; at least 1 s for each Modbus response
};

inline constexpr std::array kBaudRates{1200,  2400,   4800,   9600,   19200, 38400,
                                       57600, 115200, 230400, 460800, 921600};

/// What a PLC program writes to R3701..R3705, and the data words behind it.
struct Transaction {
  std::uint16_t command = 0;
  std::uint16_t node = 0;
  std::uint16_t index = 0;
  std::uint16_t sub = 0;
  std::uint16_t size = 0;
  std::vector<std::uint8_t> data;  ///< to write, up to 128 bytes
};

struct Response {
  std::uint16_t result = 0;        ///< R3700
  std::uint32_t abort_code = 0;    ///< with result 4
  std::vector<std::uint8_t> data;  ///< after a good read: as many bytes as R3705 says
};

class WindowClient {
 public:
  /// `interrupted` is asked while waiting; `say` takes remarks for the person. Throws ConnectionError.
  WindowClient(Target target, std::function<bool()> interrupted, std::function<void(const std::string&)> say);

  /// One transaction, from CA0Eh to its result. Another program's, if one is under way, is waited for first.
  Response execute(const Transaction& transaction);

  /// R3700..R3769 as they are.
  std::vector<std::uint16_t> window();

  /// Any registers, in one request; none where the server has none there.
  std::optional<std::vector<std::uint16_t>> look(std::uint16_t address, std::size_t count);
  void write(std::uint16_t address, std::span<const std::uint16_t> words);

 private:
  using Deadline = std::chrono::steady_clock::time_point;

  void connect_tcp();
  void connect_rtu();
  std::vector<std::uint16_t> read(std::uint16_t address, std::size_t count);
  bool repeat_after_failure(int attempt);
  void drain();
  std::vector<std::uint16_t> wait_for_result(Deadline deadline);
  void check_own(std::span<const std::uint16_t> asked, std::span<const std::uint16_t> words) const;
  void wait_for_others(Deadline deadline);
  void cancel();
  std::string line() const;
  [[noreturn]] void lost(const std::string& doing) const;

  Target target_;
  std::function<bool()> interrupted_;
  std::function<void(const std::string&)> say_;
  std::unique_ptr<_modbus, void (*)(_modbus*)> modbus_;
};

}  // namespace cbcan::tools
