// SPDX-License-Identifier: MIT
// Any text as a network file, or as a device's file for cbcan-eds: objects or a header for firmware, or a mistake
// with the file's name. The first byte selects which.

#include "base/error.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"
#include "descriptions/dictionary_image.hpp"
#include "descriptions/network_file.hpp"
#include "fuzz/fuzz.hpp"
#include "support/eds_text.hpp"

namespace cbcan::fuzz {

namespace {

/// A device with an identity, a heartbeat, and one input in a TPDO.
const std::string kEds = [] {
  using test::head_of, test::text_of;
  std::string text = "[DeviceInfo]\nVendorNumber=0x191\n" + head_of("1018", '9', '2') +
                     head_of("1800", '9', '3') + head_of("1A00", '9', '2') + head_of("6000", '8', '2');
  for (const auto& [index, type, access, value] :
       std::initializer_list<std::array<const char*, 4>>{{"1000", "7", "ro", "0x30191"},
                                                         {"1017", "6", "rw", ""},
                                                         {"1018sub0", "5", "ro", "1"},
                                                         {"1018sub1", "7", "ro", "0x191"},
                                                         {"1800sub0", "5", "ro", "2"},
                                                         {"1800sub1", "7", "rw", "$NODEID+0x180"},
                                                         {"1800sub2", "5", "rw", "255"},
                                                         {"1A00sub0", "5", "rw", "1"},
                                                         {"1A00sub1", "7", "rw", "0x60000108"},
                                                         {"6000sub0", "5", "ro", "1"}})
    text += text_of({index, type, access, value, false});
  return text + text_of({"6000sub1", "5", "ro", ""});
}();

/// What `make` returns; empty: it is a mistake of this file.
template <class Make>
auto made_or_refused(const std::string& file, Make make) {
  try {
    return make();
  } catch (const base::UsageError& error) {
    require(std::string_view(error.what()).find(file) != std::string_view::npos, "a mistake names the file");
    return decltype(make()){};
  }
}

void check_network(std::string_view text) {
  const std::string name = "network.toml";
  const base::FileReader read = [text, &name](const std::string& path) -> std::optional<std::string> {
    if (path == name) return std::string(text);
    if (path == "a.eds") return kEds;
    return std::nullopt;
  };
  const descriptions::Bytes image = made_or_refused(name, [&] {
    std::vector<std::string> remarks;
    return descriptions::image_of(descriptions::read_network(name, read, remarks), 127, name);
  });
  if (image.empty()) return;
  NetworkObjects objects;
  require(objects.use(NetworkObjects::Bytes(image)), "a network that is accepted can be used");
  require(descriptions::header_of(image, name).find("kNetwork") != std::string::npos, "and compiled in");
}

void check_dictionary(std::string_view text) {
  const std::string name = "io.eds";
  const std::string header = made_or_refused(name, [&] {
    std::vector<std::string> remarks;
    return descriptions::dictionary_header(text, name, "io", remarks);
  });
  require(header.empty() || header.find("kDictionary") != std::string::npos, "a header has the dictionary");
}

}  // namespace

void run(Input input) {
  if (input.empty()) return;
  const std::uint8_t kind = input.byte();
  const std::string_view text = text_of(input.rest());
  kind % 2 == 0 ? check_network(text) : check_dictionary(text);
}

}  // namespace cbcan::fuzz
