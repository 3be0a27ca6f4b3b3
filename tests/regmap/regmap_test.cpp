// SPDX-License-Identifier: MIT
// The table compared with the document; the numbers are typed from it.

#include "cbcan/regmap.hpp"
#include "cbcan/sdo_abort_codes.hpp"

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

TEST_CASE("The diagnostics: 42 registers from R4100, without gap or overlap, read-only, outside the window") {
  std::uint32_t next = 4100;
  for (const RegisterRow& row : kDiagnostics) {
    CHECK(row.first == next);
    CHECK(row.last - row.first == (row.range == "32 bits" ? 1 : 0));
    CHECK(row.access == Access::kReadOnly);
    CHECK(row.writer == Writer::kCoprocessor);
    next = row.last + 1u;
  }
  CHECK(next == 4142);
  CHECK(kMistakesSeen == 4141);
  CHECK(kSecondWriters == 4140);
  CHECK(kDiagnosticsFirst == 4100);
  CHECK(kDiagnosticsWords == 40);
  for (std::size_t i = 0; i < kBoard.size(); ++i)
    CHECK(kBoard[i].first == 4150 + i);
  CHECK(next <= kRegisterFileWords);
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
