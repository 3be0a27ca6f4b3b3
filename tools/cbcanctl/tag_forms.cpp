// SPDX-License-Identifier: MIT
#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/regmap.hpp"
#include "cbcanctl/tags.hpp"

namespace cbcan::tools {

namespace {

// ---- Programs of a PLC that exchange the registers, one request after the other

/// Words of the program for Control Expert, and where they begin, in words after the inputs.
constexpr std::size_t kProgramWords = 300;
constexpr std::array<std::string_view, 6> kProgramVariables{"cbcan_active", "cbcan_report", "cbcan_timeout",
                                                            "cbcan_length", "cbcan_step",   "cbcan_failures"};

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

/// The program of text_of(), which exchanges the registers, one request after the other. `at`: where the
/// inputs are, or the number of the data block.
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

// ---- Types

struct TypeName {
  unsigned bits;
  std::optional<DataType> type;  ///< nullopt = a string of bits, for values of any other type
  std::string_view iec, tia;
};
constexpr auto kTypes = std::to_array<TypeName>({
    {1, {}, "BOOL", "Bool"},
    {8, {}, "BYTE", "Byte"},
    {16, {}, "WORD", "Word"},
    {32, {}, "DWORD", "DWord"},
    {64, {}, "LWORD", "LWord"},
    {8, DataType::kInteger8, "SINT", "SInt"},
    {16, DataType::kInteger16, "INT", "Int"},
    {32, DataType::kInteger32, "DINT", "DInt"},
    {64, DataType::kInteger64, "LINT", "LInt"},
    {8, DataType::kUnsigned8, "USINT", "USInt"},
    {16, DataType::kUnsigned16, "UINT", "UInt"},
    {32, DataType::kUnsigned32, "UDINT", "UDInt"},
    {64, DataType::kUnsigned64, "ULINT", "ULInt"},
    {32, DataType::kReal32, "REAL", "Real"},
    {64, DataType::kReal64, "LREAL", "LReal"},
});

/// Empty = no type has this size.
std::string_view type_of(const Tag& tag, std::string_view TypeName::*column) {
  if (column == nullptr) return "INT";
  std::string_view name;
  for (const TypeName& row : kTypes)
    if (row.bits == tag.bits && (!row.type || row.type == tag.type)) name = row.*column;
  return name;
}

// ---- Addresses

std::size_t word_of(const Tag& tag) {
  return static_cast<std::size_t>(tag.first + tag.shift - regmap::kProcessFirst);
}
std::string no_address(const Tag&, unsigned, const std::vector<Exchange>&) {
  return {};
}
/// Each size has its own numbers; the first byte is the low one.
std::string codesys_address(const Tag& tag, unsigned at, const std::vector<Exchange>&) {
  const std::size_t word = at + word_of(tag);
  const std::size_t byte = 2 * word + tag.bit / 8;
  if (tag.bits == 1) return fmt::format("%MX{}.{}", byte, tag.bit % 8);
  if (tag.bits == 8) return fmt::format("%MB{}", byte);
  return tag.bits == 32 ? fmt::format("%MD{}", word / 2) : fmt::format("%MW{}", word);
}
std::string xsy_address(const Tag& tag, unsigned at, const std::vector<Exchange>&) {
  return fmt::format("%MW{}", at + word_of(tag));
}
std::string logix_address(const Tag& tag, unsigned, const std::vector<Exchange>& arrays) {
  const auto array = std::ranges::find_if(arrays, [&](const Exchange& each) {
    return tag.first >= each.first && tag.first < each.first + each.words;
  });
  const std::string word = fmt::format("{}[{}]", array->array, tag.first - array->first);
  return tag.bits == 1 ? fmt::format("{}.{}", word, tag.bit) : word;
}

// ---- Comments

std::string in_quotes(std::string_view text) {
  std::string quoted;
  for (const char c : text)
    quoted.append(c == '"' ? 2u : 1u, c);
  return quoted;
}
/// Replaces what forms without a documented encoding or escape cannot have: a comma becomes ; and others _.
std::string in_ascii(std::string_view text) {
  std::string plain;
  for (std::string_view rest = text; !rest.empty();) {
    const auto code = base::take_code_point(rest);
    const bool is_plain =
        code && *code >= ' ' && *code < 0x7F &&
        std::string_view("\"$',*\\").find(static_cast<char>(*code)) == std::string_view::npos;
    plain += is_plain ? static_cast<char>(*code) : code == ',' ? ';' : '_';
  }
  return plain;
}

// ---- The rows

/// What of a register has an address of its own.
enum class Smallest : std::uint8_t { kWord, kBit, kByteAndBit };
enum class Doubles : std::uint8_t { kNone, kLowFirst, kHighFirst };

struct FormRow {
  std::optional<unsigned> at;  ///< first address by default
  Smallest smallest;
  Doubles doubles;  ///< a variable with 32 bits has its words in this order; with kLowFirst it begins at an
                    ///< even one
  bool whole;       ///< takes all values as they are
  std::string (*comment)(std::string_view text);
  std::string (*address)(const Tag& tag, unsigned at, const std::vector<Exchange>& arrays);
  std::string_view TypeName::*type;          ///< null: all variables are INT
  std::string_view head, array, line, foot;  ///< of fmt::format
};

// clang-format off
constexpr std::array<FormRow, static_cast<std::size_t>(Form::kTiaDbScl)> kRows{{
    {{}, Smallest::kByteAndBit, Doubles::kNone, true, in_quotes, no_address, &TypeName::iec,
     "Name,Register,Bit,Bits,Type,Direction,Words,Node,Object,Low,High,Comment\r\n", "",
     "{name},{register},{bit},{bits},{type},{direction},{order},{node},{object},{low},{high},\"{comment}\"\r\n", ""},
    {10, Smallest::kByteAndBit, Doubles::kHighFirst, false, in_ascii, no_address, &TypeName::tia,
     "DATA_BLOCK \"cbcan\"\n{{ S7_Optimized_Access := 'FALSE' }}\nVERSION : 0.1\n"
     "//This block has number {at} in the program of --for tia-db-scl\nSTRUCT\n", "",
     "  {name} : {type};  //{comment}\n", "END_STRUCT;\nBEGIN\nEND_DATA_BLOCK\n"},
    {100, Smallest::kWord, Doubles::kNone, false, base::to_xml, xsy_address, nullptr,
     "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n<VariablesExchangeFile>\n"
     "<fileHeader company=\"cbcan\" product=\"cbcanctl\" dateTime=\"date_and_time#2000-1-1-0:0:0\" content=\"Variable source file\" DTDVersion=\"41\"/>\n"
     "<contentHeader name=\"cbcan\" version=\"0.0.000\"/>\n<dataBlock>\n", "",
     "<variables name=\"{name}\" typeName=\"{type}\" topologicalAddress=\"{address}\"><comment>{comment}</comment></variables>\n",
     "</dataBlock>\n</VariablesExchangeFile>\n"},
    {{}, Smallest::kBit, Doubles::kNone, false, in_ascii, logix_address, nullptr,
     "remark,\"CSV-Import-Export\"\r\n0.3\r\nTYPE,SCOPE,NAME,DESCRIPTION,DATATYPE,SPECIFIER,ATTRIBUTES\r\n",
     "TAG,,{array},\"R{register}\",\"INT[{words}]\",\"\",\"(RADIX := Decimal)\"\r\n",
     "ALIAS,,{name},\"{comment}\",\"\",\"{address}\",\"\"\r\n", ""},
    {0, Smallest::kByteAndBit, Doubles::kLowFirst, false, base::to_xml, codesys_address, &TypeName::iec,
     "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">\n"
     "<fileHeader companyName=\"cbcan\" productName=\"cbcan\" productVersion=\"1\" creationDateTime=\"2000-01-01T00:00:00\"/>\n"
     "<contentHeader name=\"cbcan\"><coordinateInfo><fbd><scaling x=\"8\" y=\"8\"/></fbd><ld><scaling x=\"8\" y=\"8\"/></ld>"
     "<sfc><scaling x=\"8\" y=\"8\"/></sfc></coordinateInfo></contentHeader>\n"
     "<types><dataTypes/><pous/></types>\n<instances><configurations/></instances>\n"
     "<addData><data name=\"http://www.3s-software.com/plcopenxml/globalvars\" handleUnknown=\"implementation\">\n"
     "<globalVars name=\"cbcan_network\">\n",
     "<variable name=\"{array}\" address=\"{address}\"><type><array><dimension lower=\"0\" upper=\"{last}\"/><baseType><WORD/></baseType>"
     "</array></type></variable>\n",
     "<variable name=\"{name}\" address=\"{address}\"><type><{type}/></type><documentation>"
     "<xhtml xmlns=\"http://www.w3.org/1999/xhtml\">{comment}</xhtml></documentation></variable>\n",
     "</globalVars>\n</data></addData>\n</project>\n"},
}};
// clang-format on

/// The variables that hold the value: one, or its registers if the tool has no such variable at this place.
std::vector<Tag> variables_of(const Tag& tag, const FormRow& row, unsigned at) {
  const bool is_aligned = row.doubles != Doubles::kLowFirst || (at + word_of(tag)) % 2 == 0;
  const bool is_double = tag.bits == 32 && tag.bit == 0 && is_aligned &&
                         row.doubles == (tag.high_first ? Doubles::kHighFirst : Doubles::kLowFirst);
  const bool is_word = tag.bits == 16 && tag.bit == 0;
  const bool is_byte = tag.bits == 8 && tag.bit % 8 == 0 && row.smallest == Smallest::kByteAndBit;
  const bool is_bit = tag.bits == 1 && row.smallest != Smallest::kWord;
  if (row.whole || is_double || is_word || is_byte || is_bit) return {tag};
  return parts_of(tag);
}

std::string line_of(const Tag& tag, const FormRow& row, unsigned at, const std::vector<Exchange>& arrays) {
  using fmt::arg;
  constexpr std::array<std::string_view, 3> kDirections{"input", "output", "status"};
  return fmt::format(fmt::runtime(row.line), arg("name", tag.name), arg("comment", row.comment(tag.comment)),
                     arg("type", type_of(tag, row.type)), arg("address", row.address(tag, at, arrays)),
                     arg("register", tag.first), arg("bit", tag.bit), arg("bits", tag.bits),
                     arg("direction", kDirections[static_cast<std::size_t>(tag.direction)]),
                     arg("node", tag.node), arg("object", tag.object),
                     arg("order", tag.bits <= 16   ? ""
                                  : tag.high_first ? "high-first"
                                                   : "low-first"),
                     arg("low", tag.low), arg("high", tag.high));
}

std::string array_of(const Exchange& array, const FormRow& row, unsigned at) {
  using fmt::arg;
  const Tag first{.first = static_cast<std::uint16_t>(array.first), .shift = array.shift};
  return fmt::format(fmt::runtime(row.array), arg("array", array.array), arg("words", array.words),
                     arg("last", array.words - 1), arg("register", array.first),
                     arg("address", row.address(first, at, {array})));
}

/// Its place in a structure of Siemens: the high byte of a register is first.
std::size_t place_of(const Tag& tag) {
  return 16 * word_of(tag) + (tag.bits < 16 ? tag.bit ^ 8u : 0u);
}

/// Members that fill a structure of Siemens up to this place.
std::string spare(std::size_t& place, std::size_t end) {
  std::string lines;
  while (place < end) {
    const std::size_t words = place % 16 == 0 ? (end - place) / 16 : 0;
    const bool is_byte = place % 8 == 0 && end - place >= 8;
    const std::string type = words > 0 ? fmt::format("Array[0..{}] of Word", words - 1)
                             : is_byte ? "Byte"
                                       : "Bool";
    lines += fmt::format("  spare_{} : {};\n", place, type);
    place += words > 0 ? 16 * words : is_byte ? 8 : 1;
  }
  return lines;
}

/// Each member is where its register is; one that shares its bits with the last is only a comment.
std::string structure(std::vector<Tag> variables, const FormRow& row) {
  std::ranges::stable_sort(variables, [](const Tag& a, const Tag& b) {
    return std::pair(place_of(a), -int{a.bits}) < std::pair(place_of(b), -int{b.bits});
  });
  std::string lines;
  std::size_t place = 0;
  for (const Tag& variable : variables) {
    const bool is_free = place_of(variable) >= place;
    lines += spare(place, place_of(variable)) + (is_free ? "" : "//") + line_of(variable, row, 0, {});
    if (is_free) place += variable.bits;
  }
  return lines + spare(place, (place + 15) / 16 * 16);
}

/// The variables of the program --for xsy-st are after the status words.
std::vector<Tag> variables_of_program() {
  std::vector<Tag> variables;
  for (const std::string_view name : kProgramVariables)
    variables.push_back(
        {.name = std::string(name),
         .comment = "of the program",
         .first = static_cast<std::uint16_t>(regmap::kProcessFirst + kProgramWords + variables.size())});
  return variables;
}

}  // namespace

std::string text_of(Form form, const std::vector<Tag>& tags, std::optional<unsigned> at,
                    const Server& server) {
  constexpr auto kStandard = std::to_array<Form>({Form::kTiaDb, Form::kXsy, Form::kCodesys});
  const bool is_program = form >= Form::kTiaDbScl;
  const Form variables_form =
      is_program ? kStandard[static_cast<std::size_t>(form) - static_cast<std::size_t>(Form::kTiaDbScl)]
                 : form;
  const FormRow& row = kRows[static_cast<std::size_t>(variables_form)];
  const std::string_view name = kForms[static_cast<std::size_t>(form)];
  if (at && (!row.at || form == Form::kCodesysSt))
    throw base::UsageError(fmt::format("--at {}: --for {} has no addresses; leave it out", *at, name));
  const unsigned first = at.value_or(row.at.value_or(0));
  const std::vector<Exchange> arrays = exchanges_of(tags);
  if (is_program) return program_of(form, arrays, first, server);

  std::vector<Tag> variables = form == Form::kXsy ? variables_of_program() : std::vector<Tag>();
  for (const Tag& tag : tags)
    std::ranges::move(variables_of(tag, row, first), std::back_inserter(variables));
  std::string text = fmt::format(fmt::runtime(row.head), fmt::arg("at", first));
  for (const Exchange& array : arrays)
    text += array_of(array, row, first);
  if (form == Form::kTiaDb) return text + structure(std::move(variables), row) + std::string(row.foot);
  for (const Tag& variable : variables)
    text += line_of(variable, row, first, arrays);
  return text + std::string(row.foot);
}

}  // namespace cbcan::tools
