// SPDX-License-Identifier: MIT
// What an application does with an EdsDevice.

#include "capacity.hpp"
#include "descriptions/dictionary_image.hpp"
#include "descriptions/eds_reader.hpp"
#include "dictionary/stored_device.hpp"
#include "io_module.hpp"
#include "support/bench.hpp"

namespace cbcan::test {

namespace {

struct DeviceOnWire : Wire {
  RamFlash flash;
  StoredDevice stored{io_module::kDictionary, flash, port};
};

class Module final : public EdsDeviceOf<io_module::kDictionary> {
 public:
  using EdsDeviceOf::EdsDeviceOf;
};

struct ModuleOnWire : Wire {
  void hear(std::initializer_list<const char*> frames) {
    for (const char* const frame : frames)
      module.on_frame(frame_from(frame), 0);
    while (module.poll(0) <= 0) {
    }
  }
  Module module{port};
};

/// The dictionary of a text, as cbcan-eds makes it.
struct Made {
  explicit Made(const std::string& text)
      : parts(descriptions::firmware_dictionary(
            descriptions::dictionary_image(descriptions::read(text, "x.eds", 0).device))),
        dictionary{parts.entries,
                   parts.limits,
                   parts.power_on,
                   parts.node_id_values,
                   parts.communication_node_id_values,
                   parts.value_bytes,
                   parts.memory.largest_value,
                   0,
                   0,
                   0,
                   0} {}
  descriptions::FirmwareDictionary parts;
  EdsDictionary dictionary;
};

std::string variable(const std::string& section, const std::string& type, const std::string& access,
                     const std::string& value = "") {
  return "[" + section + "]\nParameterName=V\nDataType=" + type + "\nAccessType=" + access + "\n" +
         (value.empty() ? "" : "DefaultValue=" + value + "\n");
}

/// Gives each object that asks a value of its own: the index, or a text of 20 letters.
class Giving final : public EdsDevice {
 public:
  Giving(Made& made, CanPort& port)
      : EdsDevice(made.dictionary, values_, {std::span(buffer_).first(made.dictionary.largest_value), {}, {}},
                  port) {}

 private:
  AbortCode on_read(const ObjectEntry& entry, std::uint8_t /*sub*/, std::span<std::uint8_t> out,
                    std::size_t& size, Time /*now*/) override {
    size = entry.has(ObjectFlags::kVariable) ? 20 : entry.capacity;
    std::fill_n(out.begin(), size, std::uint8_t{'x'});
    if (size == 4) store_little_endian(out.first<4>(), entry.index);
    return AbortCode::kNone;
  }

  std::array<std::uint8_t, 256> values_{};
  std::array<std::uint8_t, 256> buffer_{};
};

}  // namespace

TEST_CASE("EdsDevice: without a node ID it waits for an LSS master, and boots with the ID that it sets") {
  ModuleOnWire rig;
  rig.module.start(EdsDevice::kNoNodeId, 0);
  rig.hear({"000#0100", "605#4000100000000000"});
  rig.expect_silence();
  rig.hear({"7E5#0401000000000000", "7E5#1105000000000000"});
  rig.expect("7E4#1100000000000000");
  rig.hear({"7E5#1700000000000000"});
  rig.expect("7E4#1701000000000000");  // there is no memory
  rig.hear({"7E5#0400000000000000"});
  rig.expect("705#00");
  rig.hear({"605#2310100173617665", "000#8105"});
  rig.expect("585#8010100120000008", "705#00");
  rig.module.on_bus_state(BusState::kErrorPassive, 0);
  rig.hear({});
  rig.expect("085#2081110000000000");
  const Module& module = rig.module;
  CHECK((module.device().node_id() == 5 && module.get({0x1017, 0}) == 0));
}

TEST_CASE("EdsDevice: what is stored are the values that differ from those of the file for this node ID") {
  DeviceOnWire rig;
  EdsDevice& device = rig.stored.device;
  rig.stored.start(0);
  device.start(5, 0);
  const auto write = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
    std::array<std::uint8_t, 4> bytes{};
    store_little_endian(std::span(bytes), value);
    return device.device().dictionary().write_whole(index, sub, bytes, 0);
  };
  CHECK(write(0x1014, 0, 0x80000085) == AbortCode::kNone);
  CHECK(write(0x1014, 0, 0x90) == AbortCode::kNone);
  CHECK(write(0x1010, 1, 0x65766173) == AbortCode::kNone);
  device.start(6, 0);
  CHECK(device.get({0x1014, 0}) == 0x90);
  CHECK(device.get({0x1400, 1}) == 0x206);
  rig.expect("705#00");
  rig.expect("705#00");
  rig.expect("706#00");
}

TEST_CASE("EdsDevice: a text is that of the file only with its length") {
  DeviceOnWire rig;
  StoredDevice stored(capacity::kDictionary, rig.flash, rig.port);
  const ObjectDictionary& objects = stored.device.device().dictionary();
  ObjectEntry entry;
  REQUIRE(objects.find(0x2000, 0, entry) == AbortCode::kNone);
  constexpr std::array<std::uint8_t, 6> kText{'H', 'e', 'l', 'l', 'o', '!'};
  for (const std::size_t size : {0U, 4U, 5U, 6U})
    CHECK(stored.device.is_power_on(objects, entry, 0, std::span(kText).first(size)) == (size == 5));
}

TEST_CASE("EdsDevice: a serial number set before the start is that of 1018h and of LSS, after each reset") {
  ModuleOnWire rig;
  rig.module.set(io_module::od::kSerialNumber, 0x00C0FFEE);
  rig.module.start(5, 0);
  rig.expect("705#00");
  for (const char* const reset : {"000#8205", "000#8105"}) {
    rig.hear({reset});
    rig.expect("705#00");
    rig.hear({"605#4018100400000000"});
    rig.expect("585#43181004EEFFC000");
    rig.hear({"7E5#0401000000000000", "7E5#5D00000000000000"});
    rig.expect("7E4#5DEEFFC000000000");
  }
  rig.hear({"605#4018100200000000"});
  rig.expect("585#4318100291010000");  // of the file
}

TEST_CASE("EdsDevice: identity, texts 1008h to 100Ah and what the file has no value for ask on_read()") {
  Made made(variable("1008", "9", "const", "name") + variable("100A", "9", "const") +
            "[1018]\nParameterName=I\nObjectType=9\nSubNumber=2\n" + variable("1018sub0", "5", "ro", "4") +
            variable("1018sub4", "7", "ro", "1") + variable("2000", "7", "ro") + variable("2001", "7", "rw") +
            variable("2002", "7", "ro", "7") + variable("2003", "7", "wo"));
  struct : Wire {
    void ask(Giving& device, const char* request, const char* response) {
      device.on_frame(frame_from(request), 0);
      expect(response);
    }
  } rig;
  Giving device(made, rig.port);
  device.start(5, 0);
  rig.expect("705#00");
  rig.ask(device, "605#4008100000000000", "585#4108100014000000");  // 20 bytes: longer than that of the file
  rig.ask(device, "605#400A100000000000", "585#410A100014000000");
  rig.ask(device, "605#4018100400000000", "585#4318100418100000");
  rig.ask(device, "605#4000200000000000", "585#4300200000200000");
  rig.ask(device, "605#4001200000000000", "585#4301200001200000");
  rig.ask(device, "605#4002200000000000", "585#4302200007000000");
  rig.ask(device, "605#4003200000000000", "585#8003200001000106");
  device.on_frame(frame_from("7E5#0401000000000000"), 0);
  rig.ask(device, "7E5#5D00000000000000", "7E4#5D18100000000000");
}

TEST_CASE("EdsDevice: what no client can write and the file has no value for is unchanged by a reset") {
  Made made(variable("1018", "7", "ro", "$NODEID+16") + variable("2000", "7", "ro") +
            variable("2001", "7", "rw") + variable("2002", "7", "ro", "7"));
  DeviceOnWire rig;
  StoredDevice stored(made.dictionary, rig.flash, rig.port);
  for (const ObjectAddress object : {ObjectAddress{0x2000, 0}, {0x2001, 0}, {0x2002, 0}})
    stored.device.set(object, 9);
  for (int start = 0; start != 2; ++start) {
    stored.device.start(5, 0);
    rig.expect("705#00");
    CHECK(stored.device.get({0x1018, 0}) == 21);
    CHECK(stored.device.get({0x2000, 0}) == 9);
    CHECK(stored.device.get({0x2001, 0}) == 0);
    CHECK(stored.device.get({0x2002, 0}) == 7);
  }
}

TEST_CASE("EdsDevice: 2FFFh is an object like others, next to the stored bit rate and node ID") {
  const auto record = [](const std::string& index) {
    return "[" + index + "]\nParameterName=R\nObjectType=9\nSubNumber=3\n" +
           variable(index + "sub0", "5", "ro", "2");
  };
  Made made(record("1010") + variable("1010sub1", "7", "rw", "1") + record("2FFF") +
            variable("2FFFsub1", "6", "rw", "1") + variable("2FFFsub2", "6", "rw", "1"));
  DeviceOnWire rig;
  for (const unsigned value : {1u, 99u, 99u}) {
    StoredDevice stored(made.dictionary, rig.flash, rig.port);
    stored.start(0);
    rig.expect("705#00");
    CHECK(stored.device.get({0x2FFF, 1}) == value);
    CHECK(stored.device.get({0x2FFF, 2}) == value);
    ObjectDictionary& objects = stored.device.device().dictionary();
    for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}})
      CHECK(objects.write(0x2FFF, sub, std::array<std::uint8_t, 2>{99, 0}, 0) == AbortCode::kNone);
    CHECK(objects.write_whole(0x1010, 1, std::array<std::uint8_t, 4>{'s', 'a', 'v', 'e'}, 0) ==
          AbortCode::kNone);
  }
}

TEST_CASE("EdsDevice: saving and loading take several calls, and nothing interrupts a save") {
  struct Row {
    const char* frame;  ///< while it saves
    std::vector<const char*> sent;
  };
  for (const Row& row :
       {Row{"", {"585#6010100100000000"}}, Row{"605#4017100000000000", {"585#4B171000F4010000"}},
        Row{"605#8010100100000405", {}}, Row{"000#8105", {"705#00"}}}) {
    INFO(row.frame);
    DeviceOnWire rig;
    EdsDevice& device = rig.stored.device;
    rig.stored.start(0);
    rig.expect("705#00");
    Time now = 0;
    const auto poll = [&] {
      for (Time due = device.poll(now); due <= now + kMillisecond; due = device.poll(now))
        now = std::max(now, due);
    };
    device.on_frame(frame_from("605#2B171000F4010000"), now);
    rig.expect("585#6017100000000000");
    device.on_frame(frame_from("605#2310100173617665"), now);
    for (int part = 0; part != 3; ++part)
      now = device.poll(now);
    rig.expect_silence();
    if (*row.frame != 0) device.on_frame(frame_from(row.frame), now);
    poll();
    for (const char* const frame : row.sent)
      rig.expect(frame);
    rig.expect_silence();
    StoredDevice again(io_module::kDictionary, rig.flash, rig.port);
    again.start(0);
    rig.expect("705#00");
    CHECK(again.device.get({0x1017, 0}) == 500);
  }
}

TEST_CASE("EdsDevice: a stored value outside the limits of a later image is not loaded") {
  const auto made = [](const char* high) {
    return Made("[1010]\nParameterName=R\nObjectType=9\nSubNumber=2\n" +
                variable("1010sub0", "5", "ro", "1") + variable("1010sub1", "7", "rw", "1") +
                variable("2000", "6", "rw", "3") + "HighLimit=" + high + "\n" +
                variable("2001", "6", "rw", "3"));
  };
  const Made before = made("100"), after = made("99");
  DeviceOnWire rig;
  StoredDevice stored(before.dictionary, rig.flash, rig.port), later(after.dictionary, rig.flash, rig.port);
  stored.start(0);
  for (const ObjectAddress object : {ObjectAddress{0x2000, 0}, {0x2001, 0}})
    stored.device.set(object, 100);
  stored.device.device().dictionary().write_whole(0x1010, 1, std::array<std::uint8_t, 4>{'s', 'a', 'v', 'e'},
                                                  0);
  later.start(0);
  CHECK(later.device.get({0x2000, 0}) == 3);
  CHECK(later.device.get({0x2001, 0}) == 100);
  rig.expect("705#00", "705#00");
}

TEST_CASE("EdsDevice: LSS may store a node ID while a reset loads the values") {
  std::string text = "[1010]\nParameterName=R\nObjectType=9\nSubNumber=2\n" +
                     variable("1010sub0", "5", "ro", "1") + variable("1010sub1", "7", "rw", "1");
  for (unsigned index = 0x2010; index != 0x2030; ++index)
    text += variable(hex_of(index >> 8, 1) + hex_of(index, 1), "6", "rw");
  const Made made(text);
  DeviceOnWire rig;
  StoredDevice stored(made.dictionary, rig.flash, rig.port);
  EdsDevice& device = stored.device;
  stored.start(0);
  for (std::uint16_t index = 0x2010; index != 0x2030; ++index)
    device.set({index, 0}, index);
  device.device().dictionary().write_whole(0x1010, 1, std::array<std::uint8_t, 4>{'s', 'a', 'v', 'e'}, 0);
  device.on_frame(frame_from("000#8105"), 0);
  for (int part = 0; part != 3; ++part)
    device.poll(0);
  for (const char* const frame : {"7E5#0401000000000000", "7E5#1106000000000000", "7E5#1700000000000000"})
    device.on_frame(frame_from(frame), 0);
  while (device.poll(0) <= 0) {
  }
  for (std::uint16_t index = 0x2010; index != 0x2030; ++index)
    CHECK(device.get({index, 0}) == index);
  rig.expect("705#00", "7E4#1100000000000000", "7E4#1700000000000000", "705#00");
}

TEST_CASE("EdsDevice: LSS stores that it has no node ID; at the next start fastscan finds it") {
  Made made(variable("2000", "7", "rw"));
  DeviceOnWire rig;
  for (const bool has_node_id : {true, false}) {
    StoredDevice stored(made.dictionary, rig.flash, rig.port);
    const auto ask = [&](const char* request, const char* response) {
      stored.device.on_frame(frame_from(request), 0);
      rig.expect(response);
    };
    stored.start(0);
    if (has_node_id) rig.expect("705#00");
    if (!has_node_id) ask("7E5#5100000000800000", "7E4#4F00000000000000");
    stored.device.on_frame(frame_from("7E5#0401000000000000"), 0);
    ask("7E5#11FF000000000000", "7E4#1100000000000000");
    ask("7E5#1700000000000000", "7E4#1700000000000000");
  }
}

TEST_CASE("EdsDevice: set() is an event only if the stored value changes, also with a negative number") {
  DeviceOnWire rig;
  EdsDevice& device = rig.stored.device;
  device.start(5, 0);
  CHECK(device.device().dictionary().write(0x6423, 0, std::array<std::uint8_t, 1>{1}, 0) == AbortCode::kNone);
  device.on_frame(frame_from("000#0105"), 0);
  device.poll(0);
  rig.port.sent.clear();
  constexpr ObjectAddress kChannel1{0x6401, 1};
  for (int i = 0; i != 3; ++i)
    device.set(kChannel1, static_cast<std::uint64_t>(std::int16_t{-2}));
  CHECK(device.get(kChannel1) == 0xFFFE);
  device.set({0x6401, 2}, 7);
  device.poll(0);
  rig.expect("285#FEFF0700");  // two objects of one TPDO: one frame
  rig.expect_silence();
}

}  // namespace cbcan::test
