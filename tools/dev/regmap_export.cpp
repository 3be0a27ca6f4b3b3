// SPDX-License-Identifier: MIT
// cbcan-regmap: prints the register contract for people and programs that do not read C++. All of it comes
// out of the one table in cbcan/regmap.hpp.

#include <functional>
#include <iomanip>
#include <iostream>
#include <map>
#include <span>
#include <sstream>
#include <string>

#include "cbcan/regmap.hpp"

namespace {

using namespace cbcan::regmap;

std::string hex(std::uint32_t value, int digits) {
  std::ostringstream out;
  out << std::hex << std::uppercase << std::setfill('0') << std::setw(digits) << value;
  return out.str();
}

std::string text(std::string_view view) {
  return std::string(view);
}
std::string hex32(std::uint32_t value) {
  return hex(value >> 16, 4) + " " + hex(value & 0xFFFF, 4) + "h";
}
std::string writer(Writer who) {
  return who == Writer::kPlc ? "PLC" : who == Writer::kBoth ? "PLC, coprocessor" : "coprocessor";
}
const char* access(Access access) {
  return access == Access::kReadWrite ? "rw" : "ro";
}
constexpr std::uint32_t kSixDigits = 360000;  // from 4xxxx to 4xxxxx

// ---- Markdown

void markdown_numbers(std::ostream& out, const char* title, std::span<const NamedNumber> rows) {
  out << "\n## " << title << "\n\n| Value | Name | Meaning |\n|---|---|---|\n";
  for (const NamedNumber& row : rows)
    out << "| " << row.value << " | " << row.name << " | " << row.meaning << " |\n";
}

/// `by`: who writes, where that differs.
void markdown_registers(std::ostream& out, std::span<const RegisterRow> rows, bool by = false) {
  out << "| Register | Name | " << (by ? "Written by | " : "") << "Values | Meaning |\n|---|---|"
      << (by ? "---|" : "") << "---|---|\n";
  for (const RegisterRow& row : rows) {
    std::string registers = "R" + std::to_string(row.first);
    if (row.last != row.first) registers += "..R" + std::to_string(row.last);
    out << "| " << registers << " | " << row.name << " | " << (by ? writer(row.writer) + " | " : "")
        << row.range << " | " << row.meaning << " |\n";
  }
}

std::string markdown() {
  std::ostringstream out;
  out << "# Registers and codes\n\n"
         "Their promises are in the [contract](contract.md). R3700 is address 3700, and 43701 or 403701 "
         "where\n"
         "registers are counted from 1. [registers.csv](registers.csv) has all these numbers.\n\n"
         "## The window\n\n";
  markdown_registers(out, kWindow, true);
  markdown_numbers(out, "Commands (R3701)", kCommands);
  markdown_numbers(out, "Result codes (R3700)", kResults);
  out << "\n## NMT services (R3706, written to 1F82h)\n\n"
         "| R3706 | or | Command specifier | Service |\n|---|---|---|---|\n";
  for (const NmtRow& row : kNmtCommands)
    out << "| " << row.state_code << " | " << row.command_code << " | " << hex(row.specifier, 2) + "h"
        << " | " << row.name << " |\n";
  markdown_numbers(out, "Node states (R3706, read from 300Ch)", kNodeStates);
  out << "\n## SDO abort codes (R3707 and R3706)\n\n"
         "\"Table 3\" is that of CBCAN's document; other codes are from CiA 301.\n\n"
         "| Code | Name | Meaning | Table 3 |\n|---|---|---|---|\n";
  for (const AbortRow& row : kAbortCodes)
    out << "| " << hex32(row.code) << " | " << row.name << " | " << row.meaning << " | "
        << (row.in_table_3 ? "yes" : "") << " |\n";
  out << "\n## Scanner window\n\n"
         "The first registers of both blocks are settings. Those of channel n are 200 x (n - 1) registers\n"
         "further. The PLC writes OUT, the coprocessor IN: [scanner window](../how-to/scanner.md).\n\n";
  markdown_registers(out, kScanner);
  markdown_numbers(out, "Further result codes of the scanner window (R601)", kScannerResults);
  out << "\n## Process data\n\nThe first register is a setting.\n\n";
  markdown_registers(out, kProcessData);
  out << "\n## Diagnostics\n\n"
         "Read-only; a 32-bit number is low word first. The simulator has 0 for stack, UART, clock and "
         "faults\n"
         "of a board, CRC and bus errors. Its CAN frames are those of the module's own controller.\n\n";
  markdown_registers(out, kDiagnostics);
  out << "\n## Settings of a board\n\n"
         "For images that store settings, such as the "
         "[STM32F446's](../../firmware/boards/stm32f4/README.md).\n"
         "They apply after a reset, as stored by 1010h (sub-index 1 or 4).\n\n";
  markdown_registers(out, kBoard);
  return out.str();
}

// ---- CSV

std::string quoted(std::string_view view) {
  return "\"" + text(view) + "\"";
}

void csv_registers(std::ostream& out, std::span<const RegisterRow> rows) {
  for (const RegisterRow& row : rows) {
    for (std::uint32_t address = row.first; address <= row.last; ++address) {
      const std::string number = row.first == row.last ? "" : "_" + std::to_string(address - row.first);
      out << "R" << address << "," << address << "," << address + modicon_number(0) << ","
          << address + modicon_number(0) + kSixDigits << "," << row.name << number << ","
          << access(row.access) << "," << quoted(writer(row.writer)) << "," << quoted(row.range) << ","
          << quoted(row.meaning) << "\n";
    }
  }
}

std::string csv() {
  std::ostringstream out;
  out << "register,address,modicon,modicon6,name,access,writer,values,meaning\n";
  csv_registers(out, kWindow);
  csv_registers(out, kScanner);
  csv_registers(out, kProcessData);
  csv_registers(out, kDiagnostics);
  csv_registers(out, kBoard);
  return out.str();
}

// ---- JSON

/// One object a line; `row` writes its members.
template <class Rows, class Write>
void json_list(std::ostream& out, const char* name, const Rows& rows, Write row) {
  out << "  " << quoted(name) << ": [";
  const char* separator = "\n";
  for (const auto& entry : rows) {
    out << separator << "    {";
    row(entry);
    out << "}";
    separator = ",\n";
  }
  out << "\n  ]";
}

std::string json() {
  std::ostringstream out;
  const auto number = [&](const NamedNumber& row) {
    out << "\"value\": " << row.value << ", \"name\": " << quoted(row.name)
        << ", \"meaning\": " << quoted(row.meaning);
  };
  const auto registers = [&](const RegisterRow& row) {
    out << "\"first\": " << row.first << ", \"last\": " << row.last
        << ", \"modicon\": " << modicon_number(row.first) << ", \"name\": " << quoted(row.name)
        << ", \"access\": " << quoted(access(row.access)) << ", \"writer\": " << quoted(writer(row.writer))
        << ", \"values\": " << quoted(row.range) << ", \"meaning\": " << quoted(row.meaning);
  };
  out << "{\n";
  json_list(out, "registers", kWindow, registers);
  out << ",\n";
  json_list(out, "scanner", kScanner, registers);
  out << ",\n";
  json_list(out, "process_data", kProcessData, registers);
  out << ",\n";
  json_list(out, "diagnostics", kDiagnostics, registers);
  out << ",\n";
  json_list(out, "board", kBoard, registers);
  out << ",\n  \"execute\": " << kExecute << ",\n";
  json_list(out, "commands", kCommands, number);
  out << ",\n";
  json_list(out, "results", kResults, number);
  out << ",\n";
  json_list(out, "scanner_results", kScannerResults, number);
  out << ",\n";
  json_list(out, "nmt_services", kNmtCommands, [&](const NmtRow& row) {
    out << "\"values\": [" << row.state_code << ", " << row.command_code
        << "], \"specifier\": " << +row.specifier << ", \"name\": " << quoted(row.name);
  });
  out << ",\n";
  json_list(out, "node_states", kNodeStates, number);
  out << ",\n";
  json_list(out, "abort_codes", kAbortCodes, [&](const AbortRow& row) {
    out << "\"code\": " << row.code << ", \"name\": " << quoted(row.name)
        << ", \"meaning\": " << quoted(row.meaning)
        << ", \"table_3\": " << (row.in_table_3 ? "true" : "false");
  });
  out << "\n}\n";
  return out.str();
}

// ---- C

std::string identifier(std::string_view name) {
  std::string result;
  for (const char c : name)
    result += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c == ' ' || c == '-' ? '_' : c;
  return result;
}

void define(std::ostream& out, const std::string& name, const std::string& value, std::string_view comment) {
  out << std::left << "#define CBCAN_" << std::setw(28) << name << " " << std::setw(12) << value << " /* "
      << comment << " */\n";
}

void c_registers(std::ostream& out, const std::string& prefix, std::span<const RegisterRow> rows) {
  for (const RegisterRow& row : rows) {
    define(out, prefix + text(row.name), std::to_string(row.first), row.meaning);
    if (row.last != row.first)
      define(out, prefix + text(row.name) + "_LAST", std::to_string(row.last), "the last of them");
  }
  out << "\n";
}

std::string c_header() {
  std::ostringstream out;
  out << "/* SPDX-License-Identifier: MIT */\n"
         "/* The CBCAN register contract for C. Generated by `cbcan-regmap c`; do not edit. */\n"
         "#ifndef CBCAN_REGMAP_H\n#define CBCAN_REGMAP_H\n\n";
  c_registers(out, "R_", kWindow);
  c_registers(out, "R_SCANNER_", kScanner);
  c_registers(out, "R_", kProcessData);
  c_registers(out, "R_DIAGNOSTIC_", kDiagnostics);
  c_registers(out, "R_BOARD_", kBoard);
  define(out, "EXECUTE", "0x" + hex(kExecute, 4), "written to CBCAN_R_EXECUTE_FLAG");
  for (const NamedNumber& row : kCommands)
    define(out, "COMMAND_" + text(row.name), std::to_string(row.value), row.meaning);
  out << "\n";
  for (const NamedNumber& row : kResults)
    define(out, "RESULT_" + text(row.name), std::to_string(row.value), row.meaning);
  for (const NamedNumber& row : kScannerResults)
    define(out, "RESULT_" + text(row.name), std::to_string(row.value), row.meaning);
  out << "\n";
  define(out, "OBJECT_NMT", "0x" + hex(kNmtService, 4), "written: NMT service");
  define(out, "OBJECT_NODE_STATE", "0x" + hex(kNodeStateService, 4), "read: NMT state of a node");
  define(out, "NMT_ALL_NODES", std::to_string(kNmtAllNodes), "sub-index that means all nodes");
  for (const NmtRow& row : kNmtCommands)
    define(out, "NMT_" + identifier(row.name), std::to_string(row.state_code), row.name);
  for (const NamedNumber& row : kNodeStates)
    define(out, "STATE_" + text(row.name), std::to_string(row.value), row.meaning);
  out << "\n";
  for (const AbortRow& row : kAbortCodes)
    define(out, text(row.name), "0x" + hex(row.code, 8) + "UL", row.meaning);
  out << "\n#endif /* CBCAN_REGMAP_H */\n";
  return out.str();
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, std::function<std::string()>> formats{
      {"markdown", markdown}, {"csv", csv}, {"json", json}, {"c", c_header}};
  const auto chosen = formats.find(argc == 2 ? argv[1] : "");
  if (chosen == formats.end()) {
    std::cerr << "usage: cbcan-regmap c|csv|json|markdown\n"
                 "Prints the register contract to standard output.\n";
    return 2;
  }
  std::cout << chosen->second();
  return std::cout.flush() ? 0 : 3;
}
