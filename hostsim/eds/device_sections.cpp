// SPDX-License-Identifier: MIT
#include "eds/device_sections.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "eds/diagnostics.hpp"
#include "text/words.hpp"

namespace cbcan::eds {

namespace {

constexpr std::string_view kBaudRate = "BaudRate_";
constexpr std::string_view kCompactPdo = "CompactPDO";

template <typename Unsigned>
Unsigned number(ValueReader& values, const Section& section, std::string_view key) {
  constexpr std::uint64_t kHighest = std::numeric_limits<Unsigned>::max();
  return static_cast<Unsigned>(values.number(section, key, kHighest).value_or(0));
}

bool flag(ValueReader& values, const Section& section, std::string_view key) {
  return values.number(section, key, 1).value_or(0) != 0;
}

std::vector<std::uint32_t> bit_rates(ValueReader& values, const Section& info) {
  std::vector<std::uint32_t> rates;
  for (const KeyValue& entry : info.entries) {
    if (!text::same_text(entry.key.substr(0, kBaudRate.size()), kBaudRate)) continue;
    const auto rate = parse_count(entry.key.substr(kBaudRate.size()));
    const bool supported = !entry.value.empty() && values.number(entry, 1).value_or(0) != 0;
    if (rate && *rate <= 0xFFFF && supported) rates.push_back(static_cast<std::uint32_t>(*rate));
  }
  std::sort(rates.begin(), rates.end());
  return rates;
}

std::optional<std::uint8_t> commissioned_node_id(const Section& section, ValueReader& values,
                                                 std::optional<std::uint8_t> given, Findings& findings) {
  const auto in_file = values.number(section, "NodeID", 127, 1);
  if (!in_file) return std::nullopt;
  if (given && *given != *in_file)
    findings.note(section.find("NodeID")->line, "the file is made for node " + std::to_string(*in_file) +
                                                    " and used for node " + std::to_string(*given));
  return static_cast<std::uint8_t>(*in_file);
}

}  // namespace

const Section* find_section(const std::vector<Section>& sections, std::string_view name, Findings& findings) {
  const Section* first = nullptr;
  for (const Section& section : sections) {
    if (!text::same_text(section.name, name)) continue;
    if (first == nullptr) {
      first = &section;
    } else {
      findings.warning(section.line, bracketed(section.name) + " is here again: the one in line " +
                                         std::to_string(first->line) + " is used");
    }
  }
  return first;
}

DeviceInfo read_device_info(const std::vector<Section>& sections, ValueReader& values, Findings& findings) {
  DeviceInfo info;
  const Section* const section = find_section(sections, "DeviceInfo", findings);
  if (section == nullptr) return info;
  info.vendor_name = ValueReader::text(*section, "VendorName");
  info.vendor_number = number<std::uint32_t>(values, *section, "VendorNumber");
  info.product_name = ValueReader::text(*section, "ProductName");
  info.product_number = number<std::uint32_t>(values, *section, "ProductNumber");
  info.revision_number = number<std::uint32_t>(values, *section, "RevisionNumber");
  info.order_code = ValueReader::text(*section, "OrderCode");
  info.kilobits_per_second = bit_rates(values, *section);
  info.simple_boot_up_master = flag(values, *section, "SimpleBootUpMaster");
  info.simple_boot_up_slave = flag(values, *section, "SimpleBootUpSlave");
  info.granularity = number<std::uint8_t>(values, *section, "Granularity");
  info.dynamic_channels = number<std::uint8_t>(values, *section, "DynamicChannelsSupported") != 0;
  info.group_messaging = flag(values, *section, "GroupMessaging");
  info.receive_pdos = number<std::uint16_t>(values, *section, "NrOfRXPDO");
  info.transmit_pdos = number<std::uint16_t>(values, *section, "NrOfTXPDO");
  info.lss = flag(values, *section, "LSS_Supported");
  if (values.number(*section, kCompactPdo, 0xFF).value_or(0) > 0)
    findings.note(section->find(kCompactPdo)->line,
                  "CompactPDO: PDOs without sections of their own are not made");
  return info;
}

std::optional<Commissioning> read_commissioning(const std::vector<Section>& sections,
                                                std::optional<std::uint8_t> node_id, Findings& findings) {
  const Section* section = find_section(sections, "DeviceComissioning", findings);
  if (section == nullptr) section = find_section(sections, "DeviceCommissioning", findings);
  if (section == nullptr) return std::nullopt;
  ValueReader values(findings, node_id);
  Commissioning commissioning;
  commissioning.node_id = commissioned_node_id(*section, values, node_id, findings);
  commissioning.node_name = ValueReader::text(*section, "NodeName");
  commissioning.kilobits_per_second = number<std::uint32_t>(values, *section, "Baudrate");
  commissioning.net_number = number<std::uint32_t>(values, *section, "NetNumber");
  commissioning.network_name = ValueReader::text(*section, "NetworkName");
  commissioning.canopen_manager = flag(values, *section, "CANopenManager");
  commissioning.lss_serial_number = number<std::uint32_t>(values, *section, "LSS_SerialNumber");
  return commissioning;
}

void report_modules(const std::vector<Section>& sections, ValueReader& values, Findings& findings) {
  const Section* const section = find_section(sections, "SupportedModules", findings);
  if (section != nullptr && values.number(*section, "NrOfEntries", 0xFFFF).value_or(0) > 0)
    findings.note(section->line, "the file describes modules: what they would add is not used");
}

}  // namespace cbcan::eds
