// SPDX-License-Identifier: MIT
#include "eds/text.hpp"

#include "eds/diagnostics.hpp"
#include "eds/lexer.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

std::vector<eds::Section> split(std::string_view text) {
  eds::Findings findings("test.eds");
  return eds::split_sections(text, findings);
}

}  // namespace

TEST_CASE("Blanks and control characters at both ends do not count") {
  CHECK(eds::trim(" \t\x01 a b \x1A\r") == "a b");
  CHECK(eds::trim(" \t ").empty());
  CHECK(eds::trim("\xA0") == "\xA0");
}

TEST_CASE("The case of ASCII letters does not count") {
  CHECK(eds::same_text("DefaultValue", "DEFAULTvalue"));
  CHECK_FALSE(eds::same_text("a", "ab"));
  CHECK_FALSE(eds::same_text("[", "{"));
  CHECK(eds::less_text("A", "b"));
  CHECK_FALSE(eds::less_text("B", "a"));
}

TEST_CASE("UTF-8 is told from other text") {
  CHECK(eds::is_utf8("a\xC3\xBC\xE2\x82\xAC\xF0\x9F\x98\x80"));
  CHECK_FALSE(eds::is_utf8("\xFC"));              // Latin-1
  CHECK_FALSE(eds::is_utf8("\xC3"));              // cut short
  CHECK_FALSE(eds::is_utf8("\xC0\x80"));          // overlong
  CHECK_FALSE(eds::is_utf8("\xE0\x80\x80"));      // overlong
  CHECK_FALSE(eds::is_utf8("\xED\xA0\x80"));      // surrogate
  CHECK_FALSE(eds::is_utf8("\xF4\x90\x80\x80"));  // beyond Unicode
}

TEST_CASE("Text for people is UTF-8 without control characters") {
  CHECK(eds::to_utf8("\xC3\xBC") == "\xC3\xBC");
  CHECK(eds::to_utf8("\xFC") == "\xC3\xBC");
  CHECK(eds::to_utf8(std::string_view("a\0b\x7F", 4)) == "a b ");
}

TEST_CASE("Text in messages is short and whole") {
  CHECK(eds::quoted("abc") == "\"abc\"");
  CHECK(eds::quoted(std::string(41, 'x')) == '"' + std::string(40, 'x') + "...\"");
  // The 40th byte is in the middle of a character.
  CHECK(eds::quoted(std::string(39, 'x') + "\xC3\xBC") == '"' + std::string(39, 'x') + "...\"");
  CHECK(eds::bracketed("1018sub1") == "[1018sub1]");
}

TEST_CASE("A section knows its name, its line and its keys") {
  const auto sections = split("[A]\nx=1\n\n[B]\ny=\nz=a=b;c");
  REQUIRE(sections.size() == 2);
  CHECK(sections[0].name == "A");
  CHECK(sections[0].line == 1);
  CHECK(sections[1].line == 4);
  REQUIRE(sections[0].find("X") != nullptr);
  CHECK(sections[0].find("X")->value == "1");
  CHECK(sections[0].find("X")->line == 2);
  CHECK(sections[1].find("y") == nullptr);
  CHECK(sections[1].find("z")->value == "a=b;c");
}

TEST_CASE("A diagnostic says file, line and message") {
  eds::Findings findings("pump.eds");
  findings.warning(12, "second");
  findings.error(3, "first");
  const auto diagnostics = findings.take();
  REQUIRE(diagnostics.size() == 2);
  CHECK(to_string(diagnostics[0]) == "pump.eds:3: first");
  CHECK(diagnostics[0].severity == eds::Severity::kError);
  CHECK(to_string(diagnostics[1]) == "pump.eds:12: second");
}

TEST_CASE("Garbage does not make endless diagnostics") {
  eds::Findings findings("noise.eds");
  for (std::size_t line = 1; line <= 1000; ++line)
    findings.note(line, "noise");
  const auto diagnostics = findings.take();
  REQUIRE(diagnostics.size() == 501);
  CHECK(diagnostics.back().message == "and 500 more");
}

}  // namespace cbcan::tests
