// SPDX-License-Identifier: MIT
// What cbcan-eds refuses, and how it names objects.

#include "network/dictionary_header.hpp"

#include "support/catch.hpp"
#include "text/error.hpp"

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
std::string made(const std::string& text) {
  std::vector<std::string> remarks;
  try {
    return network::dictionary_header(text, "x.eds", "x", remarks);
  } catch (const text::UsageError& error) {
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
        "x.eds:1: 1201h:00: the stack has one SDO server, 1200h");
  CHECK(made(object("2000", "5", "1", "HighLimit=$NODEID\n")) ==
        "x.eds:1: $NODEID is used for something other than a value");
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
