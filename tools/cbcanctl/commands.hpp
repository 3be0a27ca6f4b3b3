// SPDX-License-Identifier: MIT
#pragma once

/// The command line of cbcanctl, its commands, each of which prints its result on standard output or throws,
/// and what they have in common: options, messages, and access to the window.

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "base/error.hpp"
#include "cbcanctl/channels.hpp"
#include "cbcanctl/tags.hpp"
#include "descriptions/values.hpp"

namespace cbcan::ctl {

using base::ExitCode;

inline constexpr unsigned kMaxNode = 127;
inline constexpr std::uint16_t kNotDetected = 6;  ///< of kNodeStates

enum class NmtService : std::uint8_t {};    ///< index in regmap::kNmtCommands
enum class TransferMode : std::uint8_t {};  ///< as in 3004h

struct Options {
  window::Settings target{.port = 1502, .baud = 115200};
  const char* control = nullptr;  ///< CBCAN_CONTROL of a server that CBCAN_MODBUS names
  std::string parity = "E";
  bool json = false;
  int timeout_ms = 0;  ///< 0 = not given
  std::string node, index, sub, value, type;
  NmtService service{};
  std::optional<TransferMode> mode;
  int size = static_cast<int>(regmap::kMaxDataBytes);
  bool all = false;
  // Arguments of configure.
  std::vector<std::string> plans;
  bool no_verify = false;
  std::string eds;          ///< file of dump, folder of scan; empty = not given
  bool as_network = false;  ///< scan prints a network file
  int wait_ms = 0;          ///< of status; 0 = does not wait
  std::string program;      ///< file of program
  // Arguments of lss.
  std::vector<std::string> lss;
  // Arguments of map.
  std::string network;
  std::optional<tools::Form> form;
  std::optional<int> at;
};

/// A transaction ended with a result other than 0.
class Refused : public std::runtime_error {
 public:
  /// `what`, if not empty, precedes the reason.
  explicit Refused(const window::Result& response, const std::string& what = {});

  std::uint16_t result;                     ///< R3700
  std::optional<std::uint32_t> abort_code;  ///< with result 4
};

/// Thrown by a command that has already printed why it ends with this exit code.
struct Ended {
  ExitCode code;
};

/// One line on standard error.
void say(const std::string& line);

/// Throws UsageError if it cannot be read.
std::string read_file(const std::string& path);

/// A network file with its EDS files; says what is wrong in these. Throws UsageError.
descriptions::PlannedNetwork read_network(const std::string& path);

/// True after Ctrl-C, which cancels what is in progress once connect() was called.
bool interrupted();

window::Client connect(const Options& options);

/// Carries out all jobs: on all channels at once, or one after the other if the module has only one. Shows
/// the progress on a terminal, "node 5 of 127". `sdo_timeout_ms`: 3003h meanwhile; 0 = unchanged. Ctrl-C
/// cancels what is in progress and throws window::Error.
void run(window::Client& client, std::span<tools::Job* const> jobs, std::string_view what,
         int sdo_timeout_ms = 0);

/// Reads the same objects of all 127 nodes by run().
std::deque<tools::ReadJob> read_of_all(window::Client& client, const std::vector<tools::ObjectPlace>& places,
                                       int sdo_timeout_ms = 0);

/// The data of a successful response; throws Refused with `what`.
tools::Bytes execute(window::Client& client, const tools::Transaction& transaction,
                     const std::string& what = {});

/// Objects of the coprocessor itself (docs/reference/contract.md, "Local objects").
namespace own {
using namespace regmap::object;

/// Throws window::Error if the object has another size.
tools::Bytes read(window::Client& client, std::uint16_t index, std::uint8_t sub, std::size_t size);
}  // namespace own

/// Changes an object of the coprocessor during its lifetime. A second Ctrl-C prevents the restoring, with a
/// message.
class Borrowed {
 public:
  /// `value`: empty = the object stays as it is.
  Borrowed(window::Client& client, std::uint16_t index, const tools::Bytes& value);
  ~Borrowed() { put_back(); }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;

 private:
  void put_back() noexcept;

  window::Client& client_;
  std::uint16_t index_;
  tools::Bytes before_;
  bool changed_ = false;
};

/// The value of 3003h for --timeout; empty = it is not given.
tools::Bytes sdo_timeout_of(int timeout_ms);

void read(const Options& options);
void write(const Options& options);
void nmt(const Options& options);
void state(const Options& options);
void emcy(const Options& options);
void kernel(const Options& options);
void configure(const Options& options);
void dump(const Options& options);
void scan(const Options& options);
void status(const Options& options);
void map(const Options& options);
void lss(const Options& options);
void program(const Options& options);

/// Print `out`, or run the command.
struct Start {
  std::string out{};  ///< help or version
  void (*run)(const Options&) = nullptr;
  Options options{};
};

/// `words`: the arguments after the program's name. `modbus`, `control`: the values of CBCAN_MODBUS and
/// CBCAN_CONTROL, null if there is none. Throws UsageError.
Start parse_command_line(std::span<const char* const> words, const char* modbus, const char* control);

}  // namespace cbcan::ctl
