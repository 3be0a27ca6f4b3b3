// SPDX-License-Identifier: MIT
#pragma once

/// The register contract as data: the meaning of each register, who writes it, and all numbers in it.
///
/// Source: "CBCAN SDO and NMT Service PLC Interface" V1.2 (15 June 2012), tables 1 to 4 and section 3; in the
/// comments "CBCAN, table N". docs/reference/contract.md decides what that document leaves open.
///
/// Freestanding and header-only. Register R<n> is Modbus holding register address n (0-based on the wire),
/// shown as 4xxxx number 40001 + n. All numbers are as a PLC programmer writes them: 5055 and 5066 are
/// decimal.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace cbcan::regmap {

// ---- The window

/// Addresses of the window's registers (CBCAN, table 1).
inline constexpr std::uint16_t kExecuteFlag = 3700;
inline constexpr std::uint16_t kCommand = 3701;
inline constexpr std::uint16_t kNodeId = 3702;
inline constexpr std::uint16_t kObjectIndex = 3703;
inline constexpr std::uint16_t kObjectSubIndex = 3704;
inline constexpr std::uint16_t kDataSize = 3705;
inline constexpr std::uint16_t kData = 3706;
inline constexpr std::uint16_t kLastData = 3769;

inline constexpr std::uint16_t kWindowFirst = kExecuteFlag;
inline constexpr std::size_t kWindowWords = kLastData - kWindowFirst + 1;
inline constexpr std::size_t kDataWords = kLastData - kData + 1;
inline constexpr std::size_t kMaxDataBytes = 2 * kDataWords;

/// Process data (CiA 405's network variables): inputs from the network, followed by outputs to it. The first
/// register can be configured.
inline constexpr std::uint16_t kProcessFirst = 3800;
inline constexpr std::size_t kInputWords = 64;
inline constexpr std::size_t kOutputWords = 64;
inline constexpr std::size_t kProcessWords = kInputWords + kOutputWords;
/// Further inputs, where a network file wants them; then as many outputs.
inline constexpr std::size_t kFurtherWords = 192;

/// The scanner window, for PLCs that exchange whole blocks of registers cyclically: a block that the PLC
/// writes and one that it reads. The first registers can be configured. The blocks of channel n begin
/// kScannerStride * (n - 1) registers later, so by default all of them end below R3700.
inline constexpr std::uint16_t kScannerOutFirst = 500;
inline constexpr std::uint16_t kScannerInFirst = 600;
inline constexpr std::uint16_t kScannerStride = 200;
inline constexpr std::uint8_t kMostChannels = 16;
/// The first register of the block of channel 1..16; `first` is that of channel 1.
constexpr std::uint16_t of_channel(std::uint16_t first, unsigned channel) {
  return static_cast<std::uint16_t>(first + kScannerStride * (channel - 1));
}
/// The request number after this one; 0 is skipped.
constexpr std::uint16_t next_number(std::uint16_t number) {
  return number == 0xFFFF ? 1 : static_cast<std::uint16_t>(number + 1);
}

/// Words of the OUT block: the number of the request, then the same words as in R3701..R3769.
inline constexpr std::size_t kScannerNumber = 0;
inline constexpr std::size_t kScannerOutWords = kWindowWords;
/// Words of the IN block.
inline constexpr std::size_t kScannerAnswered = 0;  ///< number of the request whose result this is
inline constexpr std::size_t kScannerResult = 1;
inline constexpr std::size_t kScannerTaken = 2;  ///< number of the last request that was taken
inline constexpr std::size_t kScannerSize = 3;   ///< bytes of data
inline constexpr std::size_t kScannerData = 4;
inline constexpr std::size_t kScannerInWords = kScannerData + kDataWords;

/// R0..R4167 are holding registers 0..4167 of the FATEK FBs PLC (40001..44168).
inline constexpr std::uint16_t kRegisterFileWords = 4168;

/// 4xxxx number of a register, as HMI and SCADA programs show it.
constexpr std::uint32_t modicon_number(std::uint16_t address) {
  return 40001u + address;
}

enum class Access : std::uint8_t { kReadWrite, kReadOnly };
enum class Writer : std::uint8_t { kPlc, kBoth, kCoprocessor };

constexpr std::string_view name_of(Writer writer) {
  if (writer == Writer::kBoth) return "PLC, coprocessor";
  return writer == Writer::kPlc ? "PLC" : "coprocessor";
}

struct RegisterRow {
  std::uint16_t first;  ///< address of the first register of this row
  std::uint16_t last;   ///< address of the last one; equal to first for a single register
  std::string_view name;
  Access access;
  Writer writer;  ///< who writes it: the PLC, the coprocessor, or the PLC and, as a response, the coprocessor
  std::string_view range;
  std::string_view meaning;
};

inline constexpr std::array<RegisterRow, 7> kWindow{{
    {kExecuteFlag, kExecuteFlag, "EXECUTE_FLAG", Access::kReadWrite, Writer::kBoth, "CA0Eh; 0, 1, 2, 4",
     "the PLC writes CA0Eh to execute; the coprocessor answers with a result code"},
    {kCommand, kCommand, "COMMAND", Access::kReadWrite, Writer::kPlc, "5055, 5066",
     "5055 = SDO read (upload), 5066 = SDO write (download)"},
    {kNodeId, kNodeId, "NODE_ID", Access::kReadWrite, Writer::kPlc, "0..127", "node ID; 0 = this node"},
    {kObjectIndex, kObjectIndex, "OBJECT_INDEX", Access::kReadWrite, Writer::kPlc, "0..65535",
     "object index"},
    {kObjectSubIndex, kObjectSubIndex, "OBJECT_SUB_INDEX", Access::kReadWrite, Writer::kPlc, "0..255",
     "object sub-index"},
    {kDataSize, kDataSize, "DATA_SIZE", Access::kReadWrite, Writer::kBoth, "1..128",
     "size in bytes: bytes to write, or the room for a read; after a successful read the bytes read"},
    {kData, kLastData, "DATA", Access::kReadWrite, Writer::kBoth, "0..65535",
     "data words #0..#63, low byte first; after a failure #0 and #1 hold the SDO abort code, low word first"},
}};

inline constexpr std::array<RegisterRow, 2> kProcessData{{
    {kProcessFirst, kProcessFirst + kInputWords - 1, "INPUTS", Access::kReadWrite, Writer::kCoprocessor,
     "0..65535", "network variables A000h..A47Fh, written by RPDOs; low byte first"},
    {kProcessFirst + kInputWords, kProcessFirst + kProcessWords - 1, "OUTPUTS", Access::kReadWrite,
     Writer::kPlc, "0..65535", "network variables A480h..A8FFh, sent by TPDOs; low byte first"},
}};

constexpr RegisterRow register_row(Access access, Writer writer, std::size_t first, std::size_t words,
                                   std::string_view name, std::string_view range, std::string_view meaning) {
  const auto address = static_cast<std::uint16_t>(first);
  const auto last = static_cast<std::uint16_t>(first + words - 1);
  return {address, last, name, access, writer, range, meaning};
}

constexpr RegisterRow scanner_out(std::size_t first, std::size_t words, std::string_view name,
                                  std::string_view range, std::string_view meaning) {
  return register_row(Access::kReadWrite, Writer::kPlc, kScannerOutFirst + first, words, name, range,
                      meaning);
}

constexpr RegisterRow scanner_in(std::size_t first, std::size_t words, std::string_view name,
                                 std::string_view range, std::string_view meaning) {
  return register_row(Access::kReadWrite, Writer::kCoprocessor, kScannerInFirst + first, words, name, range,
                      meaning);
}

inline constexpr std::array<RegisterRow, 12> kScanner{{
    scanner_out(0, 1, "OUT_NUMBER", "0..65535", "number of the request; 0 = none, and cancels"),
    scanner_out(1, 1, "OUT_COMMAND", "5055, 5066", "as R3701"),
    scanner_out(2, 1, "OUT_NODE_ID", "0..127", "as R3702"),
    scanner_out(3, 1, "OUT_OBJECT_INDEX", "0..65535", "as R3703"),
    scanner_out(4, 1, "OUT_OBJECT_SUB_INDEX", "0..255", "as R3704"),
    scanner_out(5, 1, "OUT_DATA_SIZE", "1..128", "as R3705, bytes to write, or the room for a read"),
    scanner_out(6, kDataWords, "OUT_DATA", "0..65535", "data words #0..#63, as R3706..R3769"),
    scanner_in(0, 1, "IN_NUMBER", "0..65535", "number of the request whose result this is"),
    scanner_in(1, 1, "IN_RESULT", "0, 1, 2, 4, 5, 6", "its result code"),
    scanner_in(2, 1, "IN_TAKEN", "0..65535", "number taken last"),
    scanner_in(3, 1, "IN_DATA_SIZE", "0..128", "bytes that were read"),
    scanner_in(
        4, kDataWords, "IN_DATA", "0..65535",
        "data words #0..#63, low byte first; with result 4 #0 and #1 hold the SDO abort code, low word "
        "first"),
}};

// ---- Network status

/// States of all nodes, after the process data. Words from the first register; the first can be configured in
/// a PLC that owns the registers.
inline constexpr std::uint16_t kStatusFirst = 3928;
inline constexpr std::size_t kStatusSummary = 0;
inline constexpr std::size_t kStatusChanges = 1;
inline constexpr std::size_t kStatusCounts = 2;
inline constexpr std::size_t kStatusFirstUnwell = 3;
inline constexpr std::size_t kStatusMaps = 4;    ///< by StatusMap, a bit for each node ID
inline constexpr std::size_t kStatusNodes = 44;  ///< + node ID, 0 = the module
inline constexpr std::size_t kStatusWords = kStatusNodes + 128;
inline constexpr std::size_t kStatusMapWords = 8;
inline constexpr std::size_t kStatusPlcLost = 8;  ///< bit of the summary

enum class StatusMap : std::uint8_t { kHeard, kConfigured, kRunning, kEmergency, kLost };
inline constexpr std::size_t kStatusMapCount = 5;
/// Its first word.
constexpr std::size_t status_map(StatusMap map) {
  return kStatusMaps + kStatusMapWords * static_cast<std::size_t>(map);
}
static_assert(kStatusMaps + kStatusMapWords * kStatusMapCount == kStatusNodes);

constexpr RegisterRow status(std::size_t first, std::size_t words, Access access, std::string_view name,
                             std::string_view range, std::string_view meaning) {
  return register_row(access, Writer::kCoprocessor, kStatusFirst + first, words, name, range, meaning);
}

/// R4142, in the simulator and in images with network status: a request to a node, executed when it is
/// written. Its number is in the high byte, the node ID in the low byte, which for those up to
/// kForgetEmergency may be kNmtAllNodes. Then it is 0 and R4143 is the answer; or it is kNodeRefused. In
/// words: kNodeRequests.
enum class NodeRequest : std::uint8_t {
  kBoot = 1,
  kStart,  // five in the order of kNmtCommands
  kStop,
  kEnterPreOperational,
  kResetNode,
  kResetCommunication,
  kForgetEmergency,
  kEmergencyCode = 16,  ///< of the last EMCY message
  // The boot's last failure; node 0 = the module's own configuration.
  kFailureIndex,
  kFailureSubIndex,  ///< and in the high byte the letter of CiA 302-2
  kAbortCodeLow,
  kAbortCodeHigh,
};
inline constexpr std::uint16_t kNodeRequest = 4142;
inline constexpr std::uint16_t kNodeAnswer = 4143;
inline constexpr std::uint16_t kNodeRefused = 0xFFFF;

inline constexpr std::array<RegisterRow, 12> kStatus{{
    status(kStatusSummary, 1, Access::kReadWrite, "STATUS", "10 bits",
           "bits of the whole network; 1 clears bit 8"),
    status(kStatusChanges, 1, Access::kReadOnly, "STATUS_CHANGES", "0..65535",
           "counts changes of these registers, so that none is missed"),
    status(kStatusCounts, 1, Access::kReadOnly, "NODE_COUNTS", "2 bytes",
           "listed nodes in the high byte, running ones in the low byte"),
    status(kStatusFirstUnwell, 1, Access::kReadOnly, "FIRST_NOT_RUNNING", "0..127",
           "lowest ID of a listed node that is not running; 0 = none"),
    status(status_map(StatusMap::kHeard), kStatusMapWords, Access::kReadOnly, "HEARD", "128 bits",
           "bit n mod 16 of register n div 16: node n has reported its state and is not lost"),
    status(status_map(StatusMap::kConfigured), kStatusMapWords, Access::kReadOnly, "CONFIGURED", "128 bits",
           "its configuration has been written since its last boot-up message"),
    status(status_map(StatusMap::kRunning), kStatusMapWords, Access::kReadOnly, "RUNNING", "128 bits",
           "it is listed and Operational"),
    status(status_map(StatusMap::kEmergency), kStatusMapWords, Access::kReadWrite, "EMCY", "128 bits",
           "its last EMCY message since its boot-up message is an error; 1 clears a bit"),
    status(status_map(StatusMap::kLost), kStatusMapWords, Access::kReadWrite, "LOST", "128 bits",
           "it has been lost since the bit was cleared; 1 clears a bit"),
    status(
        kStatusNodes, 128, Access::kReadOnly, "NODE_STATUS", "2 bytes",
        "node n at n, 0 = the module: NMT state in the low byte, 0 = not known; step of its boot in the high "
        "byte"),
    register_row(Access::kReadWrite, Writer::kBoth, kNodeRequest, 1, "NODE_REQUEST", "2 bytes",
                 "request to a node; 0 = done, FFFFh = refused"),
    register_row(Access::kReadOnly, Writer::kCoprocessor, kNodeAnswer, 1, "NODE_ANSWER", "0..65535",
                 "answer to it"),
}};

// ---- Diagnostics of the firmware images

/// A block of read-only registers outside the window. Values that only a board has are 0 in the simulator.
/// 32-bit numbers are in two registers, low word first.
inline constexpr std::uint16_t kVersion = 4100;
inline constexpr std::uint16_t kPatchLevel = 4101;
inline constexpr std::uint16_t kUptime = 4102;
inline constexpr std::uint16_t kResetCause = 4104;
inline constexpr std::uint16_t kStackSize = 4105;
inline constexpr std::uint16_t kStackUsed = 4106;
inline constexpr std::uint16_t kCanState = 4107;
inline constexpr std::uint16_t kModbusRequests = 4108;
inline constexpr std::uint16_t kModbusCrcErrors = 4110;
inline constexpr std::uint16_t kModbusExceptions = 4112;
inline constexpr std::uint16_t kModbusLost = 4114;
inline constexpr std::uint16_t kCanReceived = 4116;
inline constexpr std::uint16_t kCanSent = 4118;
inline constexpr std::uint16_t kCanRefused = 4120;
inline constexpr std::uint16_t kCanLost = 4122;
inline constexpr std::uint16_t kCanErrors = 4124;
inline constexpr std::uint16_t kTransactions = 4126;
inline constexpr std::uint16_t kTransactionsFailed = 4128;
inline constexpr std::uint16_t kTransactionsCancelled = 4130;
inline constexpr std::uint16_t kClockSource = 4132;
inline constexpr std::uint16_t kFaults = 4133;
inline constexpr std::uint16_t kFaultPc = 4134;
inline constexpr std::uint16_t kFaultLr = 4136;
inline constexpr std::uint16_t kFaultStatus = 4138;

inline constexpr std::uint16_t kDiagnosticsFirst = kVersion;
inline constexpr std::size_t kDiagnosticsWords = 40;
inline constexpr std::uint16_t kSecondWriters = 4140;  ///< after them, in the simulator only
inline constexpr std::uint16_t kMistakesSeen = 4141;   ///< the same

constexpr RegisterRow diagnostic(std::uint16_t first, std::uint16_t words, std::string_view name,
                                 std::string_view range, std::string_view meaning) {
  return register_row(Access::kReadOnly, Writer::kCoprocessor, first, words, name, range, meaning);
}

inline constexpr std::array<RegisterRow, 26> kDiagnostics{{
    diagnostic(kVersion, 1, "VERSION", "0..65535",
               "version of the image: major in the high byte, minor in the low byte"),
    diagnostic(kPatchLevel, 1, "PATCH_LEVEL", "0..65535", "the version's third number"),
    diagnostic(kUptime, 2, "UPTIME", "32 bits", "milliseconds since the start, modulo 2^32"),
    diagnostic(kResetCause, 1, "RESET_CAUSE", "0..5",
               "0 = unknown, 1 = power on, 2 = reset pin, 3 = software, 4 = watchdog, 5 = brown-out"),
    diagnostic(kStackSize, 1, "STACK_SIZE", "0..65535", "bytes"),
    diagnostic(kStackUsed, 1, "STACK_USED", "0..65535", "bytes of the stack that were ever in use"),
    diagnostic(kCanState, 1, "CAN_STATE", "0, 2, 16, 17", "kernel state as in object 3002h"),
    diagnostic(kModbusRequests, 2, "MODBUS_REQUESTS", "32 bits", "requests for this station"),
    diagnostic(kModbusCrcErrors, 2, "MODBUS_CRC_ERRORS", "32 bits", "frames with a wrong CRC, or cut short"),
    diagnostic(kModbusExceptions, 2, "MODBUS_EXCEPTIONS", "32 bits", "requests answered by an exception"),
    diagnostic(kModbusLost, 2, "MODBUS_LOST", "32 bits", "bytes that came too soon, or that the UART lost"),
    diagnostic(kCanReceived, 2, "CAN_RECEIVED", "32 bits", "frames received"),
    diagnostic(kCanSent, 2, "CAN_SENT", "32 bits", "frames handed to the CAN controller"),
    diagnostic(kCanRefused, 2, "CAN_REFUSED", "32 bits",
               "times that the CAN controller had no room; the frame is tried again"),
    diagnostic(kCanLost, 2, "CAN_LOST", "32 bits",
               "frames, or bytes of a serial adapter, lost because a buffer was full"),
    diagnostic(kCanErrors, 2, "CAN_ERRORS", "32 bits",
               "bus errors, failed starts of the CAN controller, or invalid lines of a serial adapter"),
    diagnostic(kTransactions, 2, "TRANSACTIONS", "32 bits", "requests of the PLC begun, of both windows"),
    diagnostic(kTransactionsFailed, 2, "TRANSACTIONS_FAILED", "32 bits", "ended with a result other than 0"),
    diagnostic(kTransactionsCancelled, 2, "TRANSACTIONS_CANCELLED", "32 bits", "cancelled by the PLC"),
    diagnostic(
        kClockSource, 1, "CLOCK_SOURCE", "0..2",
        "0 = the board has one clock only, 1 = crystal or clock signal, 2 = the chip's RC oscillator, too "
        "inaccurate for CAN"),
    diagnostic(kFaults, 1, "FAULTS", "0..65535",
               "faults and resets by the watchdog since power on; 0 on boards that do not count them"),
    diagnostic(kFaultPc, 2, "FAULT_PC", "32 bits", "where the last one was; 0 = the watchdog, or not known"),
    diagnostic(kFaultLr, 2, "FAULT_LR", "32 bits", "its link register: the caller"),
    diagnostic(kFaultStatus, 2, "FAULT_STATUS", "32 bits",
               "its fault status, of a Cortex-M the CFSR; 0 = an unexpected interrupt"),
    diagnostic(kSecondWriters, 1, "SECOND_WRITERS", "0..65535",
               "writes to a scanner window by a client after a newer client's; simulator only"),
    diagnostic(kMistakesSeen, 1, "MISTAKES", "16 bits",
               "mistakes of the PLC's program since the start; simulator only"),
}};

// ---- Settings of a board

/// Registers of boards that store their settings. The values take effect after a reset, if 1010h has stored
/// them.
inline constexpr std::uint16_t kBoardStation = 4150;
inline constexpr std::uint16_t kBoardBaudRate = 4151;
inline constexpr std::uint16_t kBoardFormat = 4152;
inline constexpr std::uint16_t kBoardResponseDelay = 4153;
inline constexpr std::uint16_t kBoardBitRate = 4154;
inline constexpr std::uint16_t kBoardNodeId = 4155;

inline constexpr std::uint16_t kBoardFirst = kBoardStation;
inline constexpr std::size_t kBoardWords = 6;

constexpr RegisterRow board_setting(std::uint16_t address, std::string_view name, std::string_view range,
                                    std::string_view meaning) {
  return register_row(Access::kReadWrite, Writer::kPlc, address, 1, name, range, meaning);
}

inline constexpr std::array<RegisterRow, kBoardWords> kBoard{{
    board_setting(kBoardStation, "STATION", "1..247", "Modbus station address"),
    board_setting(kBoardBaudRate, "BAUD_RATE", "13..5000", "of the Modbus line, in 100 bit/s: 96 = 9600"),
    board_setting(kBoardFormat, "SERIAL_FORMAT", "0..3", "0 = 8E1, 1 = 8O1, 2 = 8N1, 3 = 8N2"),
    board_setting(kBoardResponseDelay, "RESPONSE_DELAY", "0..50000",
                  "microseconds from a request to its response; 0 = as short as Modbus lets it be"),
    board_setting(kBoardBitRate, "CAN_BIT_RATE", "10, 20, 50, 100, 125, 250, 500, 800, 1000", "kbit/s"),
    board_setting(kBoardNodeId, "OWN_NODE_ID", "1..127", "own CANopen node ID"),
}};

/// Values of kClockSource.
enum class ClockSource : std::uint16_t { kOnly, kExternal, kInternal };

/// Values of kResetCause.
enum class ResetCause : std::uint16_t { kUnknown, kPowerOn, kPin, kSoftware, kWatchdog, kBrownOut };

// ---- Commands and results

struct NamedNumber {
  std::uint32_t value;
  std::string_view name;
  std::string_view meaning;
};

/// The meaning of the row with this value; `otherwise` if there is none.
constexpr std::string_view meaning_of(std::span<const NamedNumber> rows, std::uint32_t value,
                                      std::string_view otherwise = {}) {
  for (const NamedNumber& row : rows)
    if (row.value == value) return row.meaning;
  return otherwise;
}

inline constexpr std::uint16_t kExecute = 0xCA0E;

inline constexpr std::uint16_t kSdoRead = 5055;
inline constexpr std::uint16_t kSdoWrite = 5066;

inline constexpr std::array<NamedNumber, 2> kCommands{{
    {kSdoRead, "SDO_READ", "SDO read (upload)"},
    {kSdoWrite, "SDO_WRITE", "SDO write (download)"},
}};

/// Result codes in R3700 (CBCAN, table 2) and of the scanner window. There is no code 3.
enum class Result : std::uint16_t {
  kOk = 0,
  kCommandCodeError = 1,
  kNodeIdError = 2,
  kSdoExecutionError = 4,
  kRestarted = 5,   ///< scanner window; in R3700 only with a setting
  kIncomplete = 6,  ///< scanner window only
};

inline constexpr std::array<NamedNumber, 4> kResults{{
    {0, "OK", "done"},
    {1, "CMD_CODE_ERR", "R3701 is neither 5055 nor 5066"},
    {2, "NODE_ID_ERR", "R3702 is above 127"},
    {4, "SDO_EXEC_ERR", "the service failed; R3706 (low word) and R3707 (high word) hold the SDO abort code"},
}};

/// Bits of STATUS.
inline constexpr std::array<NamedNumber, 10> kStatusBits{{
    {0, "ALL_RUNNING", "all listed nodes are running"},
    {1, "BOOTING", "a node is booting"},
    {2, "MISSING", "a mandatory node is missing"},
    {3, "ERROR", "the last EMCY message of a node is an error"},
    {4, "OPERATIONAL", "the own node is Operational"},
    {5, "BUS_OFF", "the module is bus-off"},
    {6, "UNLISTED", "a node reports that is not listed"},
    {7, "SAME_ID", "two nodes have the same ID"},
    {kStatusPlcLost, "PLC_SILENT", "the PLC was silent"},
    {9, "NOT_WATCHED", "a running node has neither heartbeat nor node guarding"},
}};

/// High byte of NODE_STATUS. A node that has failed has its letter there, 41h..4Fh of CiA 302-2, or 55h.
inline constexpr std::array<NamedNumber, 9> kBootSteps{{
    {0, "NOT_LISTED", "not listed"},
    {1, "RUNNING", "running"},
    {2, "WAITING", "waiting for the node"},
    {3, "CHECK", "its identity is being checked"},
    {4, "CONFIGURATION", "it is being configured"},
    {5, "AWAITS_HEARTBEAT", "waiting for its heartbeat"},
    {6, "AWAITS_START", "waiting for its start"},
    {7, "AWAITS_DATA", "running, without process data so far"},
    {0x58, "LOST", "lost"},
}};

/// NodeRequest, by value.
inline constexpr std::array<NamedNumber, 12> kNodeRequests{{
    {1, "BOOT", "boot it again, as by 1F25h"},
    {2, "START", "Start Remote Node"},
    {3, "STOP", "Stop Remote Node"},
    {4, "ENTER_PRE_OPERATIONAL", "Enter Pre-Operational"},
    {5, "RESET_NODE", "Reset Node"},
    {6, "RESET_COMMUNICATION", "Reset Communication"},
    {7, "CLEAR_EMCY", "clear its bit in EMCY"},
    {16, "EMCY_CODE", "error code of its last EMCY message, as in 3005h"},
    {17, "FAILURE_INDEX", "index of the object at which its boot has failed, as in 3009h"},
    {18, "FAILURE_SUB_INDEX", "sub-index of that object; the failure's letter in the high byte"},
    {19, "ABORT_LOW", "abort code of the failure, low word"},
    {20, "ABORT_HIGH", "high word"},
}};

/// Additional results of the scanner window.
inline constexpr std::array<NamedNumber, 2> kScannerResults{{
    {5, "RESTARTED",
     "handshake after a start of the coprocessor: the number is not executed, as it may have been before"},
    {6, "INCOMPLETE", "the number came without all words of its request; nothing is executed"},
}};

// ---- Services addressed through objects (CBCAN, section 3)

/// Written: NMT command; sub-index 1..127, or 128 = all.
inline constexpr std::uint16_t kNmtService = 0x1F82;
/// Read, sub-index 0: NMT state of the node in R3702.
inline constexpr std::uint16_t kNodeStateService = 0x300C;
inline constexpr std::uint16_t kNmtAllNodes = 128;

/// Objects of the own node, read and written with R3702 = 0 (docs/reference/contract.md, "Local objects").
namespace object {
inline constexpr std::uint16_t kOwnNodeId = 0x3001;
inline constexpr std::uint16_t kKernelState = 0x3002;
inline constexpr std::uint16_t kSdoTimeout = 0x3003;
inline constexpr std::uint16_t kTransferMode = 0x3004;
inline constexpr std::uint16_t kLastEmergency = 0x3005;  ///< sub-index = node
inline constexpr std::uint16_t kEmergencyScan = 0x3006;
inline constexpr std::uint16_t kDeviceState = 0x3007;  ///< sub-index = node
inline constexpr std::uint16_t kClock = 0x3008;
inline constexpr std::uint16_t kBootFailure = 0x3009;  ///< sub-index = node
inline constexpr std::uint16_t kLssRequest = 0x300E, kLssAnswer = 0x300F;
}  // namespace object

/// One NMT service: the numbers that R3706 may hold for it, and its command specifier on the bus (CiA
/// 301, 7.2.8.3.1).
struct NmtRow {
  std::uint16_t state_code;
  std::uint16_t command_code;
  std::uint8_t specifier;
  std::string_view name;
};

inline constexpr std::array<NmtRow, 5> kNmtCommands{{
    {5, 1, 0x01, "Start Remote Node"},
    {4, 2, 0x02, "Stop Remote Node"},
    {127, 128, 0x80, "Enter Pre-Operational"},
    {6, 129, 0x81, "Reset Node"},
    {7, 130, 0x82, "Reset Communication"},
}};

inline constexpr std::array<NamedNumber, 4> kNodeStates{{
    {4, "STOPPED", "Stopped"},
    {5, "OPERATIONAL", "Operational"},
    {6, "NOT_DETECTED", "Not detected"},
    {127, "PRE_OPERATIONAL", "Pre-operational"},
}};

}  // namespace cbcan::regmap
