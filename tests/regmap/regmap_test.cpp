// SPDX-License-Identifier: MIT
// The table against the document, number by number, as typed from it.

#include "cbcan/regmap.hpp"

#include "support/catch.hpp"

using namespace cbcan::regmap;

TEST_CASE("CBCAN, table 1: 70 registers, R3700..R3769, without gap or overlap") {
  std::uint32_t next = 3700;
  for (const RegisterRow& row : kWindow) {
    CHECK(row.first == next);
    CHECK(row.last >= row.first);
    CHECK(!row.name.empty());
    CHECK(!row.meaning.empty());
    next = row.last + 1u;
  }
  CHECK(next == 3770);
  CHECK(kCommand == 3701);
  CHECK(kNodeId == 3702);
  CHECK(kObjectIndex == 3703);
  CHECK(kObjectSubIndex == 3704);
  CHECK(kDataSize == 3705);
  CHECK(kData == 3706);
  CHECK(kMaxDataBytes == 128);
  CHECK(modicon_number(3700) == 43701);
  CHECK(kExecute == 51726);  // CA0Eh
  CHECK(kSdoRead == 5055);
  CHECK(kSdoWrite == 5066);
}

TEST_CASE("Process data: R3800..R3927, 64 inputs and 64 outputs, outside window and diagnostics") {
  CHECK(kProcessFirst == 3800);
  CHECK(kProcessWords == 128);
  CHECK(kProcessData[0].first == 3800);
  CHECK(kProcessData[0].last == 3863);
  CHECK(kProcessData[0].writer == Writer::kCoprocessor);
  CHECK(kProcessData[1].first == 3864);
  CHECK(kProcessData[1].last == 3927);
  CHECK(kProcessData[1].writer == Writer::kPlc);
}

TEST_CASE("Scanner window: R500..R569 and R600..R667, without gaps; 16 channels end below R3700") {
  const std::uint32_t firsts[] = {500, 501, 502, 503, 504, 505, 506, 600, 601, 602, 603, 604};
  const std::uint32_t lasts[] = {500, 501, 502, 503, 504, 505, 569, 600, 601, 602, 603, 667};
  for (std::size_t i = 0; i < kScanner.size(); ++i) {
    CHECK(kScanner[i].first == firsts[i]);
    CHECK(kScanner[i].last == lasts[i]);
    CHECK(kScanner[i].writer == (i < 7 ? Writer::kPlc : Writer::kCoprocessor));
  }
  CHECK(kScanner[11].last + 15 * kScannerStride < 3700);
  CHECK(static_cast<int>(Result::kRestarted) == 5);
  CHECK(static_cast<int>(Result::kIncomplete) == 6);
  CHECK(kScannerResults[0].value == 5);
  CHECK(kScannerResults[1].value == 6);
}

TEST_CASE("The diagnostics: 41 registers from R4100, without gap or overlap, read-only, outside the window") {
  std::uint32_t next = 4100;
  for (const RegisterRow& row : kDiagnostics) {
    CHECK(row.first == next);
    CHECK(row.last - row.first == (row.range == "32 bits" ? 1 : 0));
    CHECK(row.access == Access::kReadOnly);
    CHECK(row.writer == Writer::kCoprocessor);
    next = row.last + 1u;
  }
  CHECK(next == 4141);
  CHECK(kSecondWriters == 4140);
  CHECK(kDiagnosticsFirst == 4100);
  CHECK(kDiagnosticsWords == 40);
  for (std::size_t i = 0; i < kBoard.size(); ++i)
    CHECK(kBoard[i].first == 4150 + i);
  CHECK(next <= kRegisterFileWords);
}

TEST_CASE("CBCAN, table 2: result codes") {
  CHECK(static_cast<int>(Result::kOk) == 0);
  CHECK(static_cast<int>(Result::kCommandCodeError) == 1);
  CHECK(static_cast<int>(Result::kNodeIdError) == 2);
  CHECK(static_cast<int>(Result::kSdoExecutionError) == 4);
  const std::string names[] = {"OK", "CMD_CODE_ERR", "NODE_ID_ERR", "SDO_EXEC_ERR"};
  for (std::size_t i = 0; i < kResults.size(); ++i)
    CHECK(kResults[i].name == names[i]);
}

TEST_CASE("CBCAN, table 3: SDO error codes") {
  struct Row {
    std::uint32_t code;
    std::string_view name;
  };
  const Row rows[] = {
      {0x05040000, "ABORT_TIME_OUT"},   {0x06020000, "ABORT_NO_OBJ"},     {0x06010002, "ABORT_RO"},
      {0x06040047, "ABORT_SYS_LENGTH"}, {0x06010000, "ABORT_NO_SEGMENT"}, {0x06070010, "ABORT_OBJ_LENGTH"},
      {0x05040001, "ABORT_SYNC"},       {0x05030000, "ABORT_TOGGLE_BIT"}, {0x06070012, "ABORT_PARM_LENGTH"},
      {0x06010001, "ABORT_WO"},         {0x05040005, "ABORT_READ_LENGTH"}};
  for (const Row& row : rows) {
    const AbortRow* found = find_abort(row.code);
    REQUIRE(found != nullptr);
    CHECK(found->name == row.name);
    CHECK(found->in_table_3);
  }
  std::size_t marked = 0;
  for (const AbortRow& row : kAbortCodes)
    marked += row.in_table_3 ? 1 : 0;
  CHECK(marked == std::size(rows));
}

TEST_CASE("Abort codes are in order, none twice") {
  for (std::size_t i = 1; i < kAbortCodes.size(); ++i)
    CHECK(kAbortCodes[i - 1].code < kAbortCodes[i].code);
  CHECK(find_abort(0x12345678) == nullptr);
  CHECK(find_abort(0) == nullptr);
}

TEST_CASE("CBCAN, section 3: NMT commands and node states") {
  struct Row {
    int first, second, specifier;
  };
  const Row rows[] = {{5, 1, 0x01}, {4, 2, 0x02}, {127, 128, 0x80}, {6, 129, 0x81}, {7, 130, 0x82}};
  for (std::size_t i = 0; i < kNmtCommands.size(); ++i) {
    CHECK(kNmtCommands[i].state_code == rows[i].first);
    CHECK(kNmtCommands[i].command_code == rows[i].second);
    CHECK(kNmtCommands[i].specifier == rows[i].specifier);
  }
  CHECK(kNmtService == 0x1F82);
  CHECK(kNodeStateService == 0x300C);
  CHECK(kNmtAllNodes == 128);
  const std::uint32_t states[] = {4, 5, 6, 127};
  for (std::size_t i = 0; i < kNodeStates.size(); ++i)
    CHECK(kNodeStates[i].value == states[i]);
}
