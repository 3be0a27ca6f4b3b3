// SPDX-License-Identifier: MIT
#include "cbcanctl/tags.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::tools {

namespace {

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
