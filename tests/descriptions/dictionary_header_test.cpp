// SPDX-License-Identifier: MIT
// What cbcan-eds refuses, and how it names objects.

#include "descriptions/dictionary_image.hpp"

#include "base/error.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

std::string object(const std::string& section, const std::string& type, const std::string& value,
                   const std::string& more = "") {
  return "[" + section + "]\nParameterName=An object\nDataType=" + type +
         "\nAccessType=rw\nDefaultValue=" + value + "\n" + more;
}
/// RPDO 1 with one mapped object, and U32 2000h.
std::string pdo(const std::string& cob_id, const std::string& count, const std::string& mapped) {
  return "[1400]\nParameterName=R\nObjectType=9\nSubNumber=1\n" + object("1400sub1", "7", cob_id) +
         "[1600]\nParameterName=M\nObjectType=9\nSubNumber=3\n" + object("1600sub0", "5", count) +
         object("1600sub1", "7", mapped) + object("1600sub2", "7", mapped) + object("1600sub3", "7", mapped) +
         object("2000", "7", "0", "PDOMapping=1\n") + object("2001", "7", "0");
}
std::string made(const std::string& text, const std::string& file = "x.eds", const std::string& space = "x") {
  std::vector<std::string> remarks;
  try {
    return descriptions::dictionary_header(text, file, space, remarks);
  } catch (const base::UsageError& error) {
    return error.what();
  }
}

}  // namespace

TEST_CASE("cbcan-eds: what the stack does not have is refused with file, line and object") {
  CHECK(made(pdo("$NODEID+0x200", "1", "0x20000020")).starts_with("// Made by cbcan-eds from x.eds"));
  CHECK(made(pdo("0x80000000", "0", "0")).starts_with("// Made by"));
  CHECK(made(pdo("$NODEID+0x600", "1", "0x20000020")) ==
        "x.eds:5: 1400h:01: CiA 301 restricts CAN-ID 601h (of node 1)");
  CHECK(made(pdo("0x20000201", "1", "0x20000020")) ==
        "x.eds:5: 1400h:01: the stack has no 29-bit identifiers");
  CHECK(made(pdo("0x205", "1", "0x20020020")) == "x.eds:19: 1600h:01: 20020020h maps no object");
  CHECK(made(pdo("0x205", "1", "0x20010020")).starts_with("// Made by"));  // its file maps it by default
  CHECK(made(pdo("0x205", "1", "0x20000010")) ==
        "x.eds:19: 1600h:01: 20000010h cannot be mapped, or has another length");
  CHECK(made(pdo("0x205", "3", "0x20000020")) == "x.eds:14: 1600h:00: maps more than 64 objects or 64 bits");
  CHECK(made("[1201]\nParameterName=S\nObjectType=9\nSubNumber=1\n" + object("1201sub1", "7", "0x640")) ==
        "x.eds:5: 1201h:01: the stack has one SDO server, 1200h");
  CHECK(made(object("2000", "5", "1", "HighLimit=$NODEID\n")) ==
        "x.eds:1: 2000h:00: $NODEID is used for something other than its value");
  for (const char* value : {"$NODEID+0x81", "$NODEID+0xFF"})
    CHECK(made(object("2000", "5", value)) ==
          "x.eds:1: 2000h:00: its value with $NODEID does not fit each node ID 1..127");
  CHECK(made(pdo("0x205", "1", "$NODEID+0x20000020")) ==
        "x.eds:19: 1600h:01: $NODEID cannot be in a mapping");
}

TEST_CASE("cbcan-eds: what is off, and limits of what no client writes, are accepted") {
  CHECK(made(pdo("0x80000001", "1", "0x20000020")).starts_with("// Made by"));
  CHECK(made(pdo("0", "0", "0x20000020")).starts_with("// Made by"));
  CHECK(made(pdo("0", "1", "0x20000020")) == "x.eds:5: 1400h:01: CiA 301 restricts CAN-ID 000h (of node 1)");
  CHECK(made(object("1005", "7", "0")).starts_with("// Made by"));
  CHECK(made(object("1005", "7", "1")).starts_with("x.eds:1: 1005h:00: CiA 301 restricts"));
  CHECK(made("[OptionalObjects]\nSupportedObjects=1\n1=0x2222\n" + object("2000", "7", "1"))
            .starts_with("// Made by"));
  const std::string server =
      made("[1201]\nParameterName=S\nObjectType=9\nSubNumber=1\n" + object("1201sub1", "7", "0x80000000"));
  CHECK_THAT(server, Catch::Contains("{0x1201, 1, 1, cbcan::DataType{0x07}, 0, 0x1011, 0, 4}"));  // read-only
  std::string limited = object("2000", "7", "1", "LowLimit=0\nHighLimit=9\n");
  CHECK_THAT(made(limited), Catch::Contains("1 entries, 1 limits"));
  limited.replace(limited.find("=rw"), 3, "=ro");
  CHECK_THAT(made(limited), Catch::Contains("1 entries, 0 limits"));
}

TEST_CASE("cbcan-eds: $NODEID in values, and a dollar sign elsewhere") {
  const auto relative = [](const std::string& text) {
    const std::string header = made(text);
    const std::size_t at = header.find(" values with $NODEID");
    return at == std::string::npos
               ? header
               : header.substr(header.rfind(' ', at - 1) + 1, at - header.rfind(' ', at - 1) - 1);
  };
  CHECK(relative("; $Revision: 1.4 $\n" + object("2000", "7", "$NODEID+0x80")) == "1");
  CHECK(relative(object("2000", "9", "US$") + object("2001", "5", "1", "Denotation=Price in $\n")) == "0");
  const std::string both = object("2000", "7", "$NODEID+0x80");
  CHECK(relative(both + "ParameterValue=0x85\n") == "0");
  CHECK(relative(both + "ParameterValue=$NODEID+0x90\n") == "1");
  CHECK(relative("[2000]\nParameterName=A\nObjectType=8\nDataType=6\nAccessType=rw\nCompactSubObj=3\n"
                 "[2000Value]\nNrOfEntries=1\n2=$NODEID+0x100\n") == "1");
  CHECK(relative(object("2000", "5", "$NODEID")) == "1");
  CHECK(made(object("2000", "6", "$NODEID+0x180", "LowLimit=0x181\nHighLimit=0x1FF\n"))
            .find("kNodeIdValues{{\n    {0, 1, 2},") != std::string::npos);
  // A sub-index 0 that is the highest sub-index for one node ID only is no constant.
  CHECK(relative("[2000]\nParameterName=A\nObjectType=8\nSubNumber=3\n"
                 "[2000sub0]\nParameterName=N\nDataType=5\nAccessType=ro\nDefaultValue=$NODEID+2\n" +
                 object("2000sub1", "5", "1") + object("2000sub2", "5", "1")) == "1");
}

TEST_CASE("cbcan-eds: values that the stack refuses when they are written") {
  const auto record = [](const std::string& index, const std::string& subs) {
    return "[" + index + "]\nParameterName=R\nObjectType=9\nSubNumber=3\n" + subs;
  };
  const auto pdo_type = [&](const std::string& index, const std::string& cob_id, const std::string& type) {
    return record(index, object(index + "sub1", "7", cob_id) + object(index + "sub2", "5", type));
  };
  const auto [text, problem] = GENERATE_REF(table<std::string, std::string>(
      {{object("1012", "7", "0x80000100"), ""},
       {object("1012", "7", "0"), ""},  // neither consumes nor produces
       {object("1012", "7", "0xA0000100"), "x.eds:1: 1012h:00: the stack has no 29-bit identifiers"},
       {object("1012", "7", "0x80000000"), "x.eds:1: 1012h:00: CiA 301 restricts CAN-ID 000h (of node 1)"},
       {record("1200", object("1200sub1", "7", "$NODEID+0x600") + object("1200sub2", "7", "$NODEID+0x580")),
        ""},
       {record("1200", object("1200sub1", "7", "0x600")),
        "x.eds:5: 1200h:01: the stack's SDO server has $NODEID+0x600"},
       {record("1200", object("1200sub2", "7", "$NODEID+0x5C0")),
        "x.eds:5: 1200h:02: the stack's SDO server has $NODEID+0x580"},
       {pdo_type("1400", "$NODEID+0x200", "240"), ""},
       {pdo_type("1400", "$NODEID+0x200", "253"), "x.eds:10: 1400h:02: transmission type 253 is reserved"},
       {pdo_type("1400", "$NODEID+0x80000200", "253"), ""},  // it does not exist
       {pdo_type("1800", "$NODEID+0x180", "252"), ""},
       {pdo_type("1800", "$NODEID+0x180", "251"), "x.eds:10: 1800h:02: transmission type 251 is reserved"},
       {object("1019", "5", "0"), ""},
       {object("1019", "5", "240"), ""},
       {object("1019", "5", "1"), "x.eds:1: 1019h:00: the counter of SYNC is 0 or 2..240"},
       {object("1019", "5", "241"), "x.eds:1: 1019h:00: the counter of SYNC is 0 or 2..240"},
       {record("1016", object("1016sub1", "7", "0x7F0064")), ""},
       {record("1016", object("1016sub1", "7", "0x800000")), ""},  // 0 ms: unused
       {record("1016", object("1016sub1", "7", "0x800064")), "x.eds:5: 1016h:01: node IDs are 1..127"}}));
  INFO(text);
  if (problem.empty())
    CHECK(made(text).starts_with("// Made by"));
  else
    CHECK(made(text) == problem);
}

TEST_CASE("cbcan-eds: names that a header cannot have") {
  const std::string text = object("2000", "5", "1");
  for (const char* name : {"class", "int",     "co_await", "xor_eq", "NULL", "EOF",     "errno",
                           "stdin", "assert",  "linux",    "unix",   "i386", "__arm__", "_AAPCS",
                           "a__b",  "uint8_t", "",         "3rd",    "a-b",  "a.b",     "\xC3\x9C"})
    CHECK(made(text, "x.eds", name) == std::string(name) + ": no name of a C++ namespace; write --name NAME");
  for (const char* name : {"io_module", "DRIVE", "classes", "a1", "_"})
    CHECK(made(text, "x.eds", name).starts_with("// Made by"));
  CHECK(made(text, "a\nb.eds").starts_with("// Made by cbcan-eds from a b.eds: do not edit.\n// Flash"));
}

TEST_CASE("cbcan-eds: a name that two objects have is followed by index and sub-index") {
  const std::string header = made(object("2000", "5", "1") + object("2001", "5", "1") +
                                  "[2002]\nParameterName=3rd \xC3\x9C"
                                  "bertemp. (limit)\nDataType=5\nAccessType=rw\n"
                                  "[2003]\nParameterName=\xC3\x9C\nDataType=5\nAccessType=rw\n");
  for (const char* line : {"kAnObject_2000_00{0x2000, 0x00};", "kAnObject_2001_00{0x2001, 0x00};",
                           "k3rdBertempLimit{0x2002, 0x00};", "kObject_2003_00{0x2003, 0x00};"})
    CHECK(header.find(line) != std::string::npos);
}

}  // namespace cbcan::tests
