// SPDX-License-Identifier: MIT
// Objects of modular devices, counted by hand from the rules of CiA 306, 4.7.
#include "descriptions/modules.hpp"

#include "base/error.hpp"
#include "corpus.hpp"
#include "support/catch.hpp"

namespace cbcan::tests {
namespace {

using List = std::vector<std::string>;

std::string section(const std::string& name, const std::string& keys, const std::string& type = "5") {
  return "[" + name + "]\nParameterName=x\nDataType=" + type + "\nAccessType=ro\n" + keys + "\n";
}

/// Three types: DI8 of one byte of 6000h, DI2 of two bits, and a pair of words in 6401h with 6423h.
const std::string kCoupler =
    section("1000", "DefaultValue=0x10191", "7") +
    "[SupportedModules]\nNrOfEntries=3\n[M1ModuleInfo]\nProductName=DI8\n"
    "[M2ModuleInfo]\nProductName=DI2\n[M3ModuleInfo]\nProductName=AI2\n" +
    section("M1SubExt6000", "DefaultValue=0x80\nCount=1") + section("M2SubExt6000", "Count=0;2") +
    section("M3SubExt6401", "Count=2") + section("M3Fixed6423", "DefaultValue=1") +
    section("M3Fixed2000sub0", "DefaultValue=1") + "[M3Fixed2000]\nParameterName=x\nObjectType=9\n" +
    section("M3Fixed2000sub1", "");

descriptions::Result read(const std::string& text, const List& modules) {
  return descriptions::read(text, "a.eds", std::nullopt, nullptr, modules);
}

/// "6000:0=2 6000:1=0", of the objects from this index on.
std::string objects_of(const descriptions::Result& result, std::uint16_t first = 0x2000) {
  std::string text;
  for (const descriptions::Object& object : result.device.objects)
    if (object.index >= first)
      text += fmt::format("{}{:X}:{:X}={}", text.empty() ? "" : " ", object.index, object.first_sub,
                          value_text(object.value));
  return text;
}

List messages(const descriptions::Result& result) {
  List texts;
  for (const descriptions::Diagnostic& each : result.diagnostics)
    texts.push_back(to_string(each));
  return texts;
}

std::string refusal(const std::string& text, const List& modules) try {
  read(text, modules);
  return {};
} catch (const base::UsageError& error) {
  return error.what();
}

}  // namespace

TEST_CASE("modules append sub-indices in their order, with their values") {
  CHECK(objects_of(read(kCoupler, {"DI8", "AI2", "di8", "3"})) ==
        "2000:0=01 2000:1=00 6000:0=02 6000:1=80 6000:2=80 6401:0=04 6401:1=00 6401:2=00 6401:3=00 6401:4=00 "
        "6423:0=01");
  CHECK(objects_of(read(kCoupler, {"DI2", "DI8"})) == "6000:0=02 6000:1=00 6000:2=80");
  CHECK(messages(read(kCoupler, {"AI2", "DI8"})).empty());
}

TEST_CASE("without modules their objects are absent, and that is a warning") {
  const auto result = read(kCoupler, {});
  CHECK(objects_of(result).empty());
  CHECK(result.flat.empty());
  CHECK(messages(result) == List{"a.eds:7: the file describes modules, but none is connected"});
}

TEST_CASE("modules of a few bits share a sub-index, until it is full or a whole one follows") {
  const auto bytes = [](const List& modules) {
    return read(kCoupler, modules).device.find(0x6000, 0)->value[0];
  };
  CHECK(bytes({"DI2"}) == 1);
  CHECK(bytes({"DI2", "DI2", "DI2", "DI2"}) == 1);
  CHECK(bytes({"DI2", "DI2", "DI2", "DI2", "DI2"}) == 2);
  CHECK(bytes({"DI2", "DI8", "DI2"}) == 3);
  CHECK(bytes({"DI2", "AI2", "DI2"}) == 1);
  const std::string odd =
      kCoupler + "[M4ModuleInfo]\n[M4SubExt6000]\nDataType=5\nAccessType=ro\nCount=0;12\n";
  CHECK(read(odd, {"4"}).device.find(0x6000, 0)->value[0] == 2);         // 12 bits
  CHECK(read(odd, {"4", "DI2"}).device.find(0x6000, 0)->value[0] == 2);  // 14
  CHECK(read(odd, {"4", "4"}).device.find(0x6000, 0)->value[0] == 3);    // 24
}

TEST_CASE("modules come after the sub-indices of the file itself") {
  const std::string own = "[6000]\nParameterName=x\nObjectType=8\nSubNumber=2\n" +
                          section("6000sub0", "DefaultValue=1") + section("6000sub1", "DefaultValue=7");
  CHECK(objects_of(read(own + kCoupler, {"DI8"})) == "6000:0=02 6000:1=07 6000:2=80");
  const std::string compact = section("6000", "ObjectType=8\nCompactSubObj=3\nDefaultValue=7");
  CHECK(objects_of(read(compact + kCoupler, {"DI8"})) == "6000:0=04 6000:1=07 6000:4=80");
  CHECK(messages(read(own + kCoupler, {"DI8"})).empty());
}

TEST_CASE("after ObjExtend the next index follows, without it there is no room") {
  const auto with = [](const std::string& key) {
    return section("1000", "") + "[M1ModuleInfo]\nProductName=A\n" +
           section("M1SubExt2000", "Count=3\n" + key);
  };
  CHECK(objects_of(read(with("ObjExtend=2"), {"A"})) == "2000:0=02 2000:1=00 2000:2=00 2001:0=01 2001:1=00");
  CHECK(objects_of(read(with("ObjExtend=1"), {"A"})) ==
        "2000:0=01 2000:1=00 2001:0=01 2001:1=00 2002:0=01 2002:1=00");
  const auto full = read(with(""), List(85, "A"));  // 84 * 3 = 252
  CHECK(full.device.find(0x2000, 254) != nullptr);
  CHECK(messages(full) == List{"a.eds:8: 2000h has no room for sub-indices of more modules: left out"});
}

TEST_CASE("sub-sections of an extension are different sub-indices") {
  const std::string text =
      section("1000", "") + "[M1ModuleInfo]\nProductName=A\n[M1SubExt2000]\nObjectType=9\n" +
      section("M1SubExt2000sub1", "DefaultValue=1") + section("M1SubExt2000sub2", "DefaultValue=2");
  CHECK(objects_of(read(text, {"A", "A"})) == "2000:0=04 2000:1=01 2000:2=02 2000:3=01 2000:4=02");
}

TEST_CASE("a DCF names its modules by position") {
  const std::string dcf = kCoupler + "[ConnectedModules]\nNrOfEntries=65535\n2=0x2\n1=1\n3=3\n";
  CHECK(objects_of(read(dcf, {}), 0x6000) ==
        "6000:0=02 6000:1=80 6000:2=00 6401:0=02 6401:1=00 6401:2=00 6423:0=01");
  CHECK(objects_of(read(dcf, {"DI8"})) == "6000:0=01 6000:1=80");
  const auto wrong = read(kCoupler + "[ConnectedModules]\n1=4\n2=1\n255=1\n", {});
  CHECK(objects_of(wrong) == "6000:0=01 6000:1=80");
  CHECK(messages(wrong) ==
        List{"a.eds:49: there is no [M4ModuleInfo], or the position is above 254: left out",
             "a.eds:51: there is no [M1ModuleInfo], or the position is above 254: left out"});
}

TEST_CASE("a DCF that has the objects of its modules as its own has them once") {
  const std::string dcf =
      kCoupler + section("6000", "ObjectType=8\nSubNumber=2") + section("6000sub0", "DefaultValue=1") +
      section("6000sub1", "DefaultValue=0x80\nParameterValue=7") + "[ConnectedModules]\n1=1\n2=3\n";
  CHECK(objects_of(read(dcf, {}), 0x6000) == "6000:0=01 6000:1=07 6401:0=02 6401:1=00 6401:2=00 6423:0=01");
}

TEST_CASE("modules that the file does not have") {
  CHECK(refusal(kCoupler, {"DI8", "DI9"}) ==
        "modules: 'DI9' is not a module of a.eds; modules: DI8, DI2, AI2");
  CHECK(refusal(kCoupler, {"4"}) == "modules: '4' is not a module of a.eds; modules: DI8, DI2, AI2");
  CHECK(refusal(section("1000", ""), {"DI8"}) == "modules: a.eds has no [SupportedModules]");
}

TEST_CASE("an empty default mapping becomes that of CiA 401, another one ends where objects are missing") {
  const auto mapping = [](const std::string& index, const std::string& count, const std::string& first) {
    const std::string other = first == "0" ? "0" : "0x60000208";
    return "[" + index + "]\nParameterName=x\nObjectType=9\n" +
           section(index + "sub0", "DefaultValue=" + count) +
           section(index + "sub1", "DefaultValue=" + first, "7") +
           section(index + "sub2", "DefaultValue=" + other, "7");
  };
  const auto mapped = [&](const std::string& pdos, const List& modules, std::uint16_t index) {
    std::string text;
    for (const std::uint8_t sub : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{2}})
      text += value_text(read(pdos + kCoupler, modules).device.find(index, sub)->value) + " ";
    return text;
  };
  const std::string empty = mapping("1A00", "0", "0") + mapping("1A01", "2", "0") + mapping("1A02", "0", "0");
  CHECK(mapped(empty, {"DI8", "DI8", "DI8", "AI2"}, 0x1A00) == "02 08010060 08020060 ");
  CHECK(mapped(empty, {"DI8", "AI2"}, 0x1A00) == "01 08010060 00000000 ");
  CHECK(mapped(empty, {"DI8", "AI2", "AI2", "AI2"}, 0x1A01) == "02 10010164 10020164 ");
  CHECK(mapped(empty, {"DI8", "AI2", "AI2", "AI2"}, 0x1A02) == "02 10050164 10060164 ");
  const std::string own = mapping("1A00", "2", "0x64010110");
  CHECK(mapped(own, {"DI8", "DI8", "AI2"}, 0x1A00) == "02 10010164 08020060 ");
  CHECK(mapped(own, {"DI8", "AI2"}, 0x1A00) == "01 10010164 08020060 ");
}

TEST_CASE("the flat text is a file with the same objects, all of them listed") {
  const auto result = read(kCoupler + "[OptionalObjects]\nSupportedObjects=0\n", {"DI8", "AI2"});
  const auto again = read(result.flat, {});
  CHECK(objects_of(again, 0x1000) == objects_of(result, 0x1000));
  CHECK(messages(again).empty());
  CHECK(result.flat.find("[OptionalObjects]\nSupportedObjects=3\n1=0x6000\n2=0x6401\n3=0x6423\n") !=
        std::string::npos);
  CHECK(result.flat.find("[M1") == std::string::npos);
  for (const char* key :
       {"Count=", "ObjExtend=", "[6000]\nParameterName=x\nDataType"})  // a strict checker refuses them
    CHECK(result.flat.find(key) == std::string::npos);
}

TEST_CASE("hostile counts add no more than the most") {
  const auto many = [](const std::string& keys) {
    return section("1000", "") + "[M1ModuleInfo]\n" + section("M1SubExt2000", keys);
  };
  CHECK(objects_of(read(many("Count=0"), {"1"})).empty());
  CHECK(objects_of(read(many("Count=-1"), {"1"})) == "2000:0=01 2000:1=00");
  CHECK(objects_of(read(many("Count=x;y"), {"1"})) == "2000:0=01 2000:1=00");
  const auto most = read(many("Count=255\nObjExtend=1"), List(254, "1"));
  CHECK(most.device.objects.size() < 40'000);
  CHECK(messages(most).front() == "a.eds:7: the modules have too many objects: left out");
}

}  // namespace cbcan::tests
