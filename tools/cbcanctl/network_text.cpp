// SPDX-License-Identifier: MIT
#include "cbcanctl/network_text.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <tuple>

#include "base/setting.hpp"
#include "base/text.hpp"
#include "descriptions/lexer.hpp"
#include "descriptions/network_file.hpp"

namespace cbcan::tools {

namespace {

using namespace descriptions;
using Identity = decltype(FoundNode::identity);

enum Part : std::size_t { kOfType, kVendor, kProduct, kRevision };  // of an Identity

struct EdsFile {
  std::string path, text;
  Identity identity{};  ///< 0 = the file does not say it
};

DeviceDescription device_of(const EdsFile& file, std::uint8_t node) {
  std::vector<std::string> remarks;  // appear when the network file is read
  return parse_device(file.text, file.path, node, remarks);
}

/// From 1000h and 1018h, else from [DeviceInfo].
Identity identity_of(const EdsFile& file) {
  Identity identity{};
  for (const PlannedObject& object : expected_identity(device_of(file, 1)))
    if (object.sub < identity.size())  // 0 of 1000h, 1 to 4 of 1018h
      identity[object.sub] = static_cast<std::uint32_t>(load_little_endian(object.value));
  Findings findings(file.path);
  constexpr std::array<Key, 3> kKeys{"VendorNumber", "ProductNumber", "RevisionNumber"};
  for (const Section& section : split_sections(file.text, findings).list)
    for (std::size_t i = 0; base::same_text(section.name, "DeviceInfo") && i < kKeys.size(); ++i)
      if (const KeyValue* value = section.find(kKeys[i]); value != nullptr && identity[kVendor + i] == 0)
        identity[kVendor + i] = static_cast<std::uint32_t>(base::parse_integer(value->value).value_or(0));
  return identity;
}

/// Two RPDOs with the same object would overwrite each other's outputs. Throws UsageError.
void check_outputs(const PlannedPdo& pdo, const std::vector<PlannedPdo>& others) {
  for (const PlannedPdo& other : others)
    for (const MappedObject& mapped : other.objects)
      for (const MappedObject& own : pdo.objects)
        if (!pdo.input() && !other.input() && entry_of(own) == entry_of(mapped))
          throw UsageError(fmt::format("RPDO {}: RPDO {} has {:04X}h:{:02X} already", pdo.number(),
                                       other.number(), own.index, own.sub));
}

class Writer {
 public:
  Writer(const std::string& folder, const base::FileReader& read, std::vector<std::string>& remarks)
      : remarks_(remarks) {
    const std::string begin = folder.ends_with('/') ? folder : folder + "/";
    const auto names = read(begin);
    for (std::string_view rest = names ? *names : std::string_view(); !rest.empty();)
      if (const std::string_view name = base::take_line(rest); base::same_text(base::leaf_of(name), "eds"))
        add({begin + std::string(name), read(begin + std::string(name)).value_or("")});
    if (files_.empty()) throw UsageError(folder + ": no EDS file that can be used in this folder");
  }

  void add(const FoundNode& found) {
    const auto& [type, vendor, product, revision, serial] = found.identity;
    const std::string what = fmt::format("{}, serial number {:#x}", base::json_text(found.name), serial);
    const EdsFile* const file = file_of(found);
    if (file == nullptr)
      return say(
          fmt::format("node {} has no EDS file: device type {:#x}, vendor-ID {:#x}, product {:#x}, "
                      "revision {:#x}, name {}",
                      found.id, type, vendor, product, revision, what));
    text +=
        fmt::format("\n[[node]]  # {}\nid = {}\neds = {}\ndevice_type = {:#x}\nidentity = [{:#x}, {:#x}]\n",
                    what, found.id, base::json_text(file->path), type, vendor, product);
    PlannedNode node;
    node.id = found.id;
    node.device = std::make_shared<DeviceDescription>(device_of(*file, found.id));
    const Object* const heartbeat = node.device->find(object::kProducerHeartbeatTime, 0);
    if (heartbeat != nullptr && is_writable(*heartbeat))
      text += "heartbeat_ms = 1000\n";
    else
      say(fmt::format("node {} has no heartbeat_ms: 1017h is not in the EDS, or read-only", node.id));
    network_.all.push_back(std::move(node));
    add_pdos();
  }

  std::string text;

 private:
  void say(const std::string& remark) {
    text += fmt::format("# {}\n", remark);
    remarks_.push_back(remark);
  }

  void add(EdsFile file) try {
    file.identity = identity_of(file);
    files_.push_back(std::move(file));
  } catch (const UsageError& error) {
    say(error.what());
  }

  /// The one with the newest revision that is not above the node's; null if there is none.
  const EdsFile* file_of(const FoundNode& found) {
    std::vector<const EdsFile*> matching;
    for (const EdsFile& file : files_) {
      const auto agrees = [&](Part part) {
        return file.identity[part] == 0 || file.identity[part] == found.identity[part];
      };
      if (agrees(kOfType) && agrees(kVendor) && agrees(kProduct) &&
          (file.identity[kOfType] | file.identity[kProduct]) != 0)
        matching.push_back(&file);
    }
    if (matching.empty()) return nullptr;
    const auto rank = [&](const EdsFile* file) {
      const std::uint32_t revision = file->identity[kRevision];
      const bool is_newer = revision > found.identity[kRevision];
      return std::tuple(file->identity[kProduct] != 0, !is_newer, is_newer ? ~revision : revision);
    };
    std::ranges::stable_sort(matching, std::ranges::greater(), rank);
    const EdsFile& chosen = *matching.front();
    std::string others;
    for (const EdsFile* other : std::span(matching).subspan(1))
      others += (others.empty() ? "; also for it: " : ", ") + other->path;
    if (!others.empty() || chosen.identity[kRevision] > found.identity[kRevision])
      say(fmt::format("node {} has revision {:#x}, {} is for {:#x}{}", found.id, found.identity[kRevision],
                      chosen.path, chosen.identity[kRevision], others));
    return &chosen;
  }

  /// Those of the last node; one that the module would refuse is a comment with the reason.
  void add_pdos() {
    const std::size_t last = network_.all.size() - 1;
    text += "pdos = [\n";
    for (PlannedPdo& pdo : valid_pdos(*network_.all[last].device)) {
      std::string line = fmt::format("{{ {} = {} }},", pdo.input() ? "tpdo" : "rpdo", pdo.number()), why;
      for (const MappedObject& mapped : pdo.objects)
        why += fmt::format("{} {:04X}h:{:02X}", why.empty() ? "" : ",", mapped.index, mapped.sub);
      PlannedNetwork tried = network_;
      tried.all[last].pdos.push_back(pdo);
      try {
        check_outputs(pdo, network_.all[last].pdos);
        complete_pdos(
            tried, [](const PlannedNode&, std::size_t, const std::string& what) { throw UsageError(what); });
        network_.all[last].pdos.push_back(std::move(pdo));
      } catch (const UsageError& error) {
        line = "# " + line;
        why = std::string(" ") + error.what();
        remarks_.push_back(fmt::format("node {}:{}", network_.all[last].id, why));
      }
      text += fmt::format("  {}  #{}\n", line, why);
    }
    text += "]\n";
  }

  std::vector<std::string>& remarks_;
  std::vector<EdsFile> files_;
  PlannedNetwork network_;  ///< what is written so far
};

}  // namespace

std::string network_text(std::span<const FoundNode> nodes, const std::string& folder,
                         const base::FileReader& read, std::vector<std::string>& remarks) {
  Writer writer(folder, read, remarks);
  for (const FoundNode& node : nodes)
    writer.add(node);
  return std::move(writer.text);
}

}  // namespace cbcan::tools
