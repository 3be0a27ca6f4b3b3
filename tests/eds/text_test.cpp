// SPDX-License-Identifier: MIT
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
