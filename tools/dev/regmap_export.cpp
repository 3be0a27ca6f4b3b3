// SPDX-License-Identifier: MIT
// cbcan-regmap: prints the register contract for programs that do not read C++. All of it is from the one
// table in cbcan/regmap.hpp.

#include <fmt/core.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "cbcan/regmap.hpp"

namespace {

using namespace cbcan::regmap;

struct Table {
  std::string_view name;    ///< in JSON
  std::string_view prefix;  ///< of its names in C
  std::span<const RegisterRow> rows;
};
constexpr std::array kTables{
    Table{"registers", "R_", kWindow},
    Table{"scanner", "R_SCANNER_", kScanner},
    Table{"process_data", "R_", kProcessData},
    Table{"status", "R_", kStatus},
    Table{"diagnostics", "R_DIAGNOSTIC_", kDiagnostics},
    Table{"board", "R_BOARD_", kBoard},
};

const char* access(Access access) {
  return access == Access::kReadWrite ? "rw" : "ro";
}

// ---- CSV

std::string csv() {
  constexpr std::uint32_t kSixDigits = 360000;  // from 4xxxx to 4xxxxx
  std::string text = "register,address,modicon,modicon6,name,access,writer,values,meaning\n";
  for (const Table& table : kTables)
    for (const RegisterRow& row : table.rows)
      for (std::uint32_t address = row.first; address <= row.last; ++address) {
        const std::uint32_t modicon = address + modicon_number(0);
        const std::string number = row.first == row.last ? "" : fmt::format("_{}", address - row.first);
        text += fmt::format("R{},{},{},{},{}{},{},\"{}\",\"{}\",\"{}\"\n", address, address, modicon,
                            modicon + kSixDigits, row.name, number, access(row.access), name_of(row.writer),
                            row.range, row.meaning);
      }
  return text;
}

// ---- JSON

using Json = nlohmann::ordered_json;

template <class Rows, class Members>
Json list_of(const Rows& rows, Members members) {
  Json list = Json::array();
  for (const auto& row : rows)
    list.push_back(members(row));
  return list;
}

Json named_numbers(std::span<const NamedNumber> rows) {
  return list_of(rows, [](const NamedNumber& row) {
    return Json{{"value", row.value}, {"name", row.name}, {"meaning", row.meaning}};
  });
}

Json members_of(const RegisterRow& row) {
  return {{"first", row.first},
          {"last", row.last},
          {"modicon", modicon_number(row.first)},
          {"name", row.name},
          {"access", access(row.access)},
          {"writer", name_of(row.writer)},
          {"values", row.range},
          {"meaning", row.meaning}};
}

std::string json() {
  Json all;
  for (const Table& table : kTables)
    all[std::string(table.name)] = list_of(table.rows, members_of);
  all["execute"] = kExecute;
  all["commands"] = named_numbers(kCommands);
  all["results"] = named_numbers(kResults);
  all["scanner_results"] = named_numbers(kScannerResults);
  all["status_bits"] = named_numbers(kStatusBits);
  all["boot_steps"] = named_numbers(kBootSteps);
  all["nmt_services"] = list_of(kNmtCommands, [](const NmtRow& row) {
    return Json{
        {"values", {row.state_code, row.command_code}}, {"specifier", row.specifier}, {"name", row.name}};
  });
  all["node_states"] = named_numbers(kNodeStates);
  all["abort_codes"] = list_of(kAbortCodes, [](const AbortRow& row) {
    return Json{
        {"code", row.code}, {"name", row.name}, {"meaning", row.meaning}, {"table_3", row.in_table_3}};
  });
  return all.dump(1) + "\n";
}

// ---- C

std::string identifier(std::string_view name) {
  std::string result;
  for (const char c : name)
    result += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c == ' ' || c == '-' ? '_' : c;
  return result;
}

class Header {
 public:
  std::string text() {
    for (const Table& table : kTables)
      registers(table);
    define("", "EXECUTE", fmt::format("0x{:04X}", kExecute), "written to CBCAN_R_EXECUTE_FLAG");
    named("COMMAND_", kCommands);
    text_ += "\n";
    named("RESULT_", kResults);
    named("RESULT_", kScannerResults);
    text_ += "\n";
    named("STATUS_BIT_", kStatusBits);
    named("BOOT_", kBootSteps);
    text_ += "\n";
    define("", "OBJECT_NMT", fmt::format("0x{:04X}", kNmtService), "written: NMT service");
    define("", "OBJECT_NODE_STATE", fmt::format("0x{:04X}", kNodeStateService), "read: NMT state of a node");
    define("", "NMT_ALL_NODES", std::to_string(kNmtAllNodes), "sub-index that means all nodes");
    for (const NmtRow& row : kNmtCommands)
      define("NMT_", identifier(row.name), std::to_string(row.state_code), row.name);
    named("STATE_", kNodeStates);
    text_ += "\n";
    for (const AbortRow& row : kAbortCodes)
      define("", row.name, fmt::format("0x{:08X}UL", row.code), row.meaning);
    return text_ + "\n#endif /* CBCAN_REGMAP_H */\n";
  }

 private:
  void define(std::string_view prefix, std::string_view name, const std::string& value,
              std::string_view comment) {
    text_ += fmt::format("#define CBCAN_{:<28} {:<12} /* {} */\n", fmt::format("{}{}", prefix, name), value,
                         comment);
  }
  void named(std::string_view prefix, std::span<const NamedNumber> rows) {
    for (const NamedNumber& row : rows)
      define(prefix, row.name, std::to_string(row.value), row.meaning);
  }
  void registers(const Table& table) {
    for (const RegisterRow& row : table.rows) {
      define(table.prefix, row.name, std::to_string(row.first), row.meaning);
      if (row.last != row.first)
        define(table.prefix, fmt::format("{}_LAST", row.name), std::to_string(row.last), "the last of them");
    }
    text_ += "\n";
  }

  std::string text_ =
      "/* SPDX-License-Identifier: MIT */\n"
      "/* The CBCAN register contract for C. Generated by `cbcan-regmap c`; do not edit. */\n"
      "#ifndef CBCAN_REGMAP_H\n#define CBCAN_REGMAP_H\n\n";
};

}  // namespace

int main(int argc, char** argv) {
  const std::string_view format = argc == 2 ? argv[1] : "";
  if (format != "c" && format != "csv" && format != "json") {
    fmt::print(stderr, "usage: cbcan-regmap c|csv|json\nPrints the register contract to standard output.\n");
    return 2;
  }
  fmt::print("{}", format == "c" ? Header().text() : format == "csv" ? csv() : json());
  return std::fflush(stdout) == 0 ? 0 : 3;
}
