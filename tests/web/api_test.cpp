// SPDX-License-Identifier: MIT
// What one answer costs: the plant stands still while a part of it is made. Parts are counted, as times
// differ.

#include "web/api.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "journal/journal.hpp"
#include "plant/demo.hpp"
#include "web/state.hpp"

namespace cbcan::web {
namespace {

const journal::FindName kNameless = [](std::uint8_t, std::uint8_t, std::uint16_t, std::uint8_t) {
  return nullptr;
};

struct Site {
  explicit Site(std::string_view more = "") : plant(plant::test::demo(more)) { journal(); }

  journal::Journal& journal() { return plant->control().journal(); }
  protocols::HttpResponse get(const std::string& path, const Query& query = {}) {
    return api({"GET", path, query});
  }
  /// The parts of an answer.
  std::vector<std::string> parts(const std::string& path, const Query& query = {}) {
    const protocols::HttpResponse response = get(path, query);
    REQUIRE(response.status == 200);
    REQUIRE(response.stream);
    REQUIRE(response.stream->is_answer());
    std::vector<std::string> made;
    for (bool more = true; more;)
      made.push_back(base::made([&](base::Buffer& to) { more = response.stream->fill(to); }));
    return made;
  }
  Json json(const std::string& path, const Query& query = {}) {
    std::string text;
    for (const std::string& part : parts(path, query))
      text += part;
    return Json::parse(text);
  }
  /// Frames push everything else out of the ring.
  void fill_ring(std::size_t events = journal::Journal::kEvents) {
    for (std::size_t number = 0; number < events; ++number)
      journal().add({.at = plant->now()});
  }

  std::unique_ptr<plant::VirtualPlant> plant;
  protocols::HttpSite::Handler api =
      api_of({plant->control(), kNameless, [](std::string_view, const auto&) { return "ok\n"; }, [] {},
              [] {
                return Json{{"program", "test"}, {"plant", "demo"}};
              },
              "{}"});
};

/// The messages of kind "now" in some server-sent events.
std::vector<Json> messages(std::string_view text) {
  std::vector<Json> found;
  for (std::size_t at = 0; (at = text.find("data: {\"kind\":\"now\"", at)) != text.npos; ++at)
    found.push_back(Json::parse(text.substr(at + 6, text.find('\n', at) - at - 6)));
  return found;
}

}  // namespace

TEST_CASE("no part of an answer is long, with a full journal and 100 nodes") {
  std::string more;
  for (unsigned id = 3; id < 100; ++id)
    if (id != 0x10 && id != 0x20 && id != 0x42)
      more += fmt::format("[[node]]\nid = {}\neds = \"demo:/generic.eds\"\n", id);
  Site site(more);
  site.fill_ring();
  for (int number = 0; number < 1000; ++number)
    site.journal().add({.kind = journal::Kind::kCommand, .at = site.plant->now()}, "nmt start all");
  for (const char* path : {"/api/journal", "/api/frames", "/api/registers", "/api/nodes",
                           "/api/nodes/16/objects", "/api/scenario"}) {
    INFO(path);
    const auto parts = site.parts(path);
    CHECK(parts.size() > 2);
    for (const std::string& part : parts)
      CHECK(part.size() < protocols::HttpStream::kMostUnsent);
  }
  CHECK(site.json("/api/journal")["events"].size() == 1000);
  CHECK(site.json("/api/registers")["registers"].size() == 70 + 70 + 68 + 128 + 172 + 2);
  CHECK(site.json("/api/nodes")["nodes"].size() == site.plant->control().world(1).nodes().size());
}

TEST_CASE("a search looks at some thousand events in a part, and from the end") {
  Site site;
  site.plant->execute("trigger read 0x42 0x1000 0 4");
  site.plant->execute("pass 1s");
  site.plant->execute("trigger read 0x42 0x1000 0 4");
  site.plant->execute("pass 1ms");
  CHECK(site.json("/api/journal", {{"transaction", "2"}})["events"].front()["kind"] == "begun");
  site.fill_ring(90'000);
  CHECK(site.parts("/api/transactions", {{"failed", "1"}}).size() <=
        2);  // none since the last one that ended
  CHECK(site.parts("/api/journal", {{"node", "5"}}).size() >= 20);
  site.plant->execute("trigger read 0x42 0x1000 0 4");
  site.plant->execute("pass 1ms");
  CHECK(site.parts("/api/journal", {{"kinds", "ended"}, {"limit", "1"}}).size() <= 2);
  site.plant->execute("trigger read 0x42 0x1000 0 4");
  site.plant->execute("pass 1ms");
  CHECK(site.parts("/api/journal", {{"transaction", "4"}}).size() <= 2);  // the third began before
  CHECK(site.json("/api/journal", {{"transaction", "4"}})["events"].size() == 4);
}

TEST_CASE("a list whose events are overwritten meanwhile has the others") {
  Site site;
  site.fill_ring();
  const protocols::HttpResponse response = site.get("/api/journal");
  std::string text = base::made([&](base::Buffer& to) { response.stream->fill(to); });
  site.fill_ring(journal::Journal::kEvents - 10);
  for (bool more = true; more;)
    text += base::made([&](base::Buffer& to) { more = response.stream->fill(to); });
  const Json events = Json::parse(text)["events"];
  CHECK(events.back()["number"] == site.journal().end() - (journal::Journal::kEvents - 10) - 1);
}

TEST_CASE("a stream sends the state once, and then what has changed") {
  Site site;
  const protocols::HttpResponse response = site.get("/api/events", {{"state", "1"}, {"kinds", "client"}});
  std::size_t longest = 0;
  const auto hear = [&] {
    std::string text;
    for (int look = 0; look < 100; ++look) {
      text += base::made([&](base::Buffer& to) {
        response.stream->fill(to);
        longest = std::max(longest, to.size());
      });
    }
    return messages(text);
  };
  std::size_t nodes = 0;
  std::size_t registers = 0;
  for (const Json& message : hear()) {
    nodes += message["nodes"].size();
    registers += message["registers"].size();
  }
  CHECK(nodes == 5);
  CHECK(registers == 70 + 70 + 68 + 128 + 172 + 2);
  CHECK(longest < 2 * protocols::HttpStream::kMostUnsent);
  for (const Json& message : hear()) {  // one each second
    CHECK(message["nodes"].empty());
    CHECK(message["registers"].empty());
  }
  site.plant->execute("power 16 off");
  site.plant->execute("write 3703 4104");
  Json changed;
  for (const Json& message : hear())
    if (!message["nodes"].empty() || !message["registers"].empty()) {
      CHECK(changed.is_null());
      changed = message;
    }
  REQUIRE(changed["nodes"].size() == 1);
  CHECK(changed["nodes"][0]["node"] == 16);
  CHECK(changed["nodes"][0]["state"] == "off");
  REQUIRE(changed["registers"].size() == 1);
  CHECK(changed["registers"][0] == Json{{"register", 3703}, {"name", "OBJECT_INDEX"}, {"value", 4104}});
  CHECK(changed["network"] == 1);

  site.plant->execute("power 16 on");
  std::vector<Json> found;
  for (int look = 0; look < 3; ++look) {  // however many events there are
    site.plant->execute("pass 50ms");
    site.fill_ring(100);
    found = messages(base::made([&](base::Buffer& to) { response.stream->fill(to); }));
    if (!found.empty()) break;
  }
  REQUIRE(found.size() == 1);
  CHECK(found[0]["nodes"][0]["state"] != "off");
  site.plant->execute("power 16 off");
  site.plant->execute("pass 1ms");  // a manual clock
  CHECK(hear().front()["nodes"].size() == 1);
}

}  // namespace cbcan::web
