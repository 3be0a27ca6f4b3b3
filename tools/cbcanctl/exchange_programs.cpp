// SPDX-License-Identifier: MIT
// Programs of a PLC that exchange the registers, one request after the other.

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "cbcan/regmap.hpp"
#include "cbcanctl/tags.hpp"

namespace cbcan::tools {

namespace {

struct Program {
  Form form;
  bool has_host;                             ///< the module's address is in it
  std::string_view data;                     ///< where the words of a request are
  std::string_view head, read, write, foot;  ///< of fmt::format
};

// clang-format off
constexpr auto kPrograms = std::to_array<Program>({
    {Form::kTiaDbScl, true, "P#DB{at}.DBX{offset}.0 WORD {words}",
R"(FUNCTION_BLOCK "cbcan_exchange"
VERSION : 0.1
//Call it in each cycle. Outputs are sent after the first read of the inputs: fill them before that.
VAR_OUTPUT
  status : Word;  //of the last request that failed
END_VAR
VAR
  client : MB_CLIENT;
  module : TCON_IP_v4;
  request : Bool;
  job : Int;
END_VAR
BEGIN
  #module.InterfaceId := 64;
  #module.ID := 1;  //used nowhere else
  #module.ConnectionType := 16#0B;
  #module.ActiveEstablished := TRUE;
  #module.RemoteAddress.ADDR[1] := {ip1};
  #module.RemoteAddress.ADDR[2] := {ip2};
  #module.RemoteAddress.ADDR[3] := {ip3};
  #module.RemoteAddress.ADDR[4] := {ip4};
  #module.RemotePort := {port};
  CASE #job OF
)",
R"(    {step}:
      #client(REQ := #request, DISCONNECT := FALSE, MB_MODE := 0, MB_DATA_ADDR := {number}, MB_DATA_LEN := {words}, MB_DATA_PTR := {data}, CONNECT := #module);
)",
R"(    {step}:
      #client(REQ := #request, DISCONNECT := FALSE, MB_MODE := 1, MB_DATA_ADDR := {number}, MB_DATA_LEN := {words}, MB_DATA_PTR := {data}, CONNECT := #module);
)",
R"(  END_CASE;
  #request := NOT (#client.DONE OR #client.ERROR);
  IF #client.ERROR THEN
    #status := #client.STATUS;
  END_IF;
  IF #client.DONE OR #client.ERROR THEN
    #job := (#job + 1) MOD {steps};
  END_IF;
END_FUNCTION_BLOCK
)"},
    {Form::kXsySt, true, "%MW{word}:{words}",
R"((* A section of the MAST task, for the variables of --for xsy. READ_VAR and WRITE_VAR use port 502.
   Write the CPU's own rack, slot and channel instead of 0.0.3. *)
IF NOT cbcan_active.0 THEN
  IF cbcan_report <> 0 AND cbcan_failures < 32767 THEN
    cbcan_failures := cbcan_failures + 1;
  END_IF;
  cbcan_timeout := 10; (* 1 s *)
  CASE cbcan_step OF
)",
R"(    {step}:
      READ_VAR(ADDM('0.0.3{{{host}}}'), '%MW', {first}, {words}, %MW{program}:4, {data});
)",
R"(    {step}:
      cbcan_length := {bytes};
      WRITE_VAR(ADDM('0.0.3{{{host}}}'), '%MW', {first}, {words}, {data}, %MW{program}:4);
)",
R"(  END_CASE;
  cbcan_step := (cbcan_step + 1) MOD {steps};
END_IF;
)"},
    {Form::kCodesysSt, false, "",
R"((* The module is the Modbus server cbcan_module of the device tree. Its channels, in this order, have the trigger
   Application; each is mapped to the variable of --for codesys that is named in its line.
)",
R"(   {step}: Read Holding Registers, offset {first}, length {words}: {array}
)",
R"(   {step}: Write Multiple Registers, offset {first}, length {words}: {array}
)",
R"(*)
PROGRAM cbcan_exchange
VAR
  channel : IoDrvModbusTCP.ModbusChannel;
  running : BOOL;
  job : INT;
  failures : UINT;
END_VAR
  channel(slave := cbcan_module, xExecute := running, xAbort := FALSE, iChannelIndex := job);
  IF NOT running THEN
    running := TRUE;
  ELSIF channel.xDone OR channel.xError THEN
    IF channel.xError AND failures < 65535 THEN
      failures := failures + 1;
    END_IF;
    running := FALSE;
    job := (job + 1) MOD {steps};
  END_IF;
END_PROGRAM
)"},
});
// clang-format on

/// The four bytes of the module's address.
std::array<unsigned char, 4> bytes_of(const std::string& host, Form form) {
  constexpr unsigned char kLoopback = 127;
  std::array<unsigned char, 4> bytes{};
  if (inet_pton(AF_INET, host.c_str(), bytes.data()) != 1 || bytes[0] == kLoopback)
    throw base::UsageError(
        fmt::format("--modbus {}: --for {} needs the module's IPv4 address in the PLC's network, such as "
                    "--modbus 192.168.1.5",
                    host, kForms[static_cast<std::size_t>(form)]));
  return bytes;
}

}  // namespace

std::string program_of(Form form, const std::vector<Exchange>& exchanges, unsigned at, const Server& server) {
  using fmt::arg;
  constexpr std::size_t kFirstHolding = 40001;
  const Program& program = *std::ranges::find(kPrograms, form, &Program::form);
  const auto ip = program.has_host ? bytes_of(server.host, form) : std::array<unsigned char, 4>{};
  std::string text = fmt::format(fmt::runtime(program.head), arg("ip1", ip[0]), arg("ip2", ip[1]),
                                 arg("ip3", ip[2]), arg("ip4", ip[3]), arg("port", server.port));
  std::size_t step = 0;
  for (const Exchange& each : exchanges) {
    const std::size_t offset = each.first + static_cast<std::size_t>(each.shift) - regmap::kProcessFirst;
    const std::string data = fmt::format(fmt::runtime(program.data), arg("at", at), arg("offset", 2 * offset),
                                         arg("word", at + offset), arg("words", each.words));
    text += fmt::format(fmt::runtime(each.is_write ? program.write : program.read), arg("step", step++),
                        arg("number", kFirstHolding + each.first), arg("first", each.first),
                        arg("words", each.words), arg("bytes", 2 * each.words), arg("array", each.array),
                        arg("host", server.host), arg("program", at + kProgramWords), arg("data", data));
  }
  return text + fmt::format(fmt::runtime(program.foot), arg("steps", exchanges.size()));
}

}  // namespace cbcan::tools
