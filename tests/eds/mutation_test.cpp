// SPDX-License-Identifier: MIT
// Whatever happens to a file, reading it ends, twice with the same result, and with a dictionary that holds
// together.
#include <rapidcheck.h>

#include "corpus.hpp"
#include "eds/dictionary_image.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {

namespace {

constexpr int kMutantsPerCase = 10;

std::vector<std::string> all_texts() {
  std::vector<std::string> texts;
  for (const std::filesystem::path& path : corpus_files())
    texts.push_back(read_file(path));
  for (const char* file : {"/io_module.eds", "/pressure_transducer.eds", "/generic.eds"})
    texts.push_back(read_file(DEMO_PLANT + std::string(file)));
  return texts;
}

/// What there is in EDS files, and what should not be.
constexpr auto kSnippets = std::to_array<std::string_view>({"\n",
                                                            "\r",
                                                            "=",
                                                            "[",
                                                            "]",
                                                            ";",
                                                            "+",
                                                            "-",
                                                            "0x",
                                                            "$NODEID",
                                                            "\xFF",
                                                            "[2000]\n",
                                                            "[2000sub1]\n",
                                                            "[2000Value]\n",
                                                            "[DeviceInfo]\n",
                                                            "CompactSubObj=254\n",
                                                            "SubNumber=1\n",
                                                            "DataType=0x000F\n",
                                                            "ObjectType=8\n",
                                                            "CBCAN_Size=1000\n",
                                                            "DefaultValue=",
                                                            "LowLimit=0x80\n",
                                                            "HighLimit=1\n",
                                                            "99999999999999999999",
                                                            "1=0x2000\n",
                                                            std::string_view("\0", 1)});

std::string mutated(std::string text) {
  const auto edits = *rc::gen::inRange(1, 8);
  for (int i = 0; i < edits; ++i) {
    const auto at = *rc::gen::inRange<std::size_t>(0, text.size() + 1);
    const auto length = *rc::gen::inRange<std::size_t>(0, std::min<std::size_t>(text.size() - at, 60) + 1);
    switch (*rc::gen::inRange(0, 4)) {
      case 0: text.erase(at, length); break;
      case 1: text.insert(at, *rc::gen::elementOf(kSnippets)); break;
      case 2: text.insert(*rc::gen::inRange<std::size_t>(0, text.size() + 1), text.substr(at, length)); break;
      default: text.replace(at, length, length, *rc::gen::arbitrary<char>()); break;
    }
  }
  return text;
}

void check_image(const eds::DictionaryImage& image) {
  std::uint32_t previous = 0;
  std::size_t end = 0;
  for (const ObjectEntry& entry : image.entries) {
    const std::uint32_t place = std::uint32_t{entry.index} << 8 | entry.first_sub;
    RC_ASSERT(place > previous);
    RC_ASSERT(entry.first_sub <= entry.last_sub);
    previous = std::uint32_t{entry.index} << 8 | entry.last_sub;
    RC_ASSERT(entry.offset >= end);
    end = entry.offset + std::size_t{entry.stride()} * (entry.last_sub - entry.first_sub) + entry.capacity;
  }
  RC_ASSERT(end == image.values.size());
  std::size_t previous_end = 0;
  for (const NodeIdValue& relative : image.node_id_values) {
    RC_ASSERT(relative.offset >= previous_end);
    previous_end = relative.offset + std::size_t{relative.size};
    RC_ASSERT(relative.size >= 1 && relative.size <= 8 && previous_end <= image.values.size());
  }
  RC_ASSERT(std::is_sorted(image.limits.begin(), image.limits.end(), [](const auto& a, const auto& b) {
    return a.index < b.index || (a.index == b.index && a.sub < b.sub);
  }));
}

void check_every_value(eds::DictionaryImage& image) {
  ObjectDictionary dictionary(image.entries, image.values, nullptr, image.limits);
  for (const ObjectEntry& entry : image.entries) {
    for (unsigned sub = entry.first_sub; sub <= entry.last_sub; ++sub) {
      const auto value = dictionary.value(entry, static_cast<std::uint8_t>(sub));
      RC_ASSERT(value.size() <= entry.capacity);
      RC_ASSERT(entry.has(ObjectFlags::kVariable) || value.size() == size_of(entry.type));
    }
  }
}

void check(const std::string& text) {
  const auto node_id = *rc::gen::maybe(rc::gen::inRange<std::uint8_t>(1, 128));
  const std::optional<std::uint8_t> given = node_id ? std::optional(*node_id) : std::nullopt;
  const eds::Result result = eds::read(text, "mutant.eds", given);
  RC_ASSERT(summary(result) == summary(eds::read(text, "mutant.eds", given)));
  for (const eds::Diagnostic& diagnostic : result.diagnostics)
    RC_ASSERT(diagnostic.line >= 1 && !diagnostic.message.empty());
  eds::DictionaryImage image = eds::dictionary_image(result.device);
  check_image(image);
  check_every_value(image);
}

}  // namespace

TEST_CASE("No change to a file upsets the reader") {
  const std::vector<std::string> texts = all_texts();
  CHECK(rc::check([&] {
    for (int i = 0; i < kMutantsPerCase; ++i)
      check(mutated(*rc::gen::elementOf(texts)));
  }));
}

TEST_CASE("No mixture of parts upsets the reader") {
  CHECK(rc::check([] {
    std::string text;
    for (const std::string_view part :
         *rc::gen::container<std::vector<std::string_view>>(rc::gen::elementOf(kSnippets)))
      text += part;
    check(text);
  }));
}

TEST_CASE("No string of bytes upsets the reader") {
  CHECK(rc::check([](const std::string& text) { check(text); }));
}

}  // namespace cbcan::tests
