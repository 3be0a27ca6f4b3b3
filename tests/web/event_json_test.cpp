// SPDX-License-Identifier: MIT
// Events as JSON. The texts are written by hand from RFC 8259 and docs/reference/http.md.

#include "web/api.hpp"

#include "support/catch.hpp"

namespace cbcan::web {
namespace {

using journal::Event;
using journal::Kind;

const journal::FindName kNoName = [](std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t) {
  return nullptr;
};

std::string json_of(const journal::Journal& journal, std::uint64_t number) {
  return base::made([&](base::Buffer& to) { append_event(to, number, journal[number], journal, kNoName); });
}

/// Of a command with this text, at this time.
std::string command(std::string_view text, Time at = 0) {
  journal::Journal journal(4, 1000);
  journal.add({.kind = Kind::kCommand, .network = 0, .at = at}, text);
  return json_of(journal, 1);
}

std::string time_in(Time at) {
  const std::string json = command("", at);
  const std::size_t begin = json.find("\"time\":") + 7;
  return json.substr(begin, json.find(',', begin) - begin);
}

std::string words_in(std::string_view text) {
  const std::string json = command(text);
  const std::size_t begin = json.find("\"words\":") + 8;
  return json.substr(begin, json.size() - 1 - begin);
}

}  // namespace

TEST_CASE("an event is one object, with its keys in this order") {
  journal::Journal journal(4, 1000);
  journal.add({.kind = Kind::kFrame,
               .node = 5,
               .transaction = 3,
               .at = 1'500'000,
               .frame = {0x605, 8, 0, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}}});
  CHECK(json_of(journal, 1) ==
        R"({"number":1,"time":1.5,"network":1,"kind":"frame","transaction":3,)"
        R"("text":"#3 605#4000100000000000 SDO node 5: read 1000h:00","frame":"605#4000100000000000",)"
        R"("node":5,"words":"SDO node 5: read 1000h:00"})");
  CHECK(command("power 1 off") ==
        R"({"number":1,"time":0.0,"kind":"command","text":"command power 1 off","words":"power 1 off"})");
}

TEST_CASE("the value of a transaction is there also where its text has none") {
  journal::Journal journal(4, 1000);
  const std::uint8_t start[] = {1, 0};
  journal.add({.kind = Kind::kBegun, .node = 5, .service = journal::Service::kNmt, .transaction = 1}, {start});
  journal.add({.kind = Kind::kEnded,
               .node = 5,
               .sub = 1,
               .index = 0x2000,
               .service = journal::Service::kWrite,
               .result = 4,
               .transaction = 2,
               .code = 0x06090030,
               .took = 1'000},
              {start});
  CHECK(json_of(journal, 1).find(R"("bytes":"0100","value":"1"})") != std::string::npos);
  CHECK(json_of(journal, 2).find(R"("words":"write node 5 2000h:01","bytes":"0100","value":"1","ok":false,)"
                                 R"("result":4,"code":101253168,"outcome":"0609 0030h )") != std::string::npos);
}

TEST_CASE("times are the shortest numbers with a point or an exponent") {
  CHECK(time_in(0) == "0.0");
  CHECK(time_in(7) == "7e-06");
  CHECK(time_in(45) == "4.5e-05");
  CHECK(time_in(100) == "0.0001");
  CHECK(time_in(1'000'000) == "1.0");
  CHECK(time_in(86'400'000'010) == "86400.00001");
}

TEST_CASE("any text is valid JSON") {
  CHECK(words_in("a\"b\\c") == R"("a\"b\\c")");
  CHECK(words_in("\b\t\n\f\r") == R"("\b\t\n\f\r")");
  CHECK(words_in(std::string_view("\0\x1F\x7F", 3)) == "\"\\u0000\\u001f\x7F\"");
  CHECK(words_in("K\xC3\xBChlung \xE2\x82\xAC") == "\"K\xC3\xBChlung \xE2\x82\xAC\"");
  CHECK(words_in("K\xFChlung") == "\"K\xEF\xBF\xBDhlung\"");
}

TEST_CASE("a text of any length is whole, with a quote at its end too") {
  for (std::size_t length = 0; length < 1000; ++length) {
    const std::string text(length, 'x');
    CHECK(command(text).find("\"text\":\"command " + text + "\",") != std::string::npos);
    CHECK(words_in(text + '"') == '"' + text + "\\\"\"");
  }
}

TEST_CASE("streams get the same texts, wherever they are") {
  journal::Journal journal(2000, 1'000'000);
  EventTexts texts(journal, kNoName);
  for (std::uint64_t i = 1; i <= 2000; ++i)
    journal.add({.kind = Kind::kCommand, .network = 0}, std::string(i % 977, 'x'));
  const auto whole = [&](std::uint64_t number) {
    return "id: " + std::to_string(number) + "\ndata: " + json_of(journal, number) + "\n\n";
  };
  for (std::uint64_t number = journal.first(); number < journal.end(); ++number)
    for (const std::uint64_t back : {0U, 1U, 100U, 511U, 512U, 1500U})
      if (number >= journal.first() + back) REQUIRE(texts.of(number - back) == whole(number - back));
  const std::string_view one = texts.of(1999);
  CHECK(texts.of(1999).data() == one.data());
}

}  // namespace cbcan::web
