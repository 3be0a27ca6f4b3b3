// SPDX-License-Identifier: MIT
#include "sim/process_data.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "cbcan/coprocessor/local_objects.hpp"

namespace cbcan::sim {

/// All PDOs have the power-on values of the first. They are after all others: their old places are not used.
ProcessData::ProcessData(std::span<std::uint16_t> block, std::size_t process, std::size_t further)
    : entries_(local::entries().begin(), local::entries().end()), block_(block) {
  using namespace local;
  LocalValues values;
  local::restore(values, 0, object::kLast);
  power_on_.assign(values.begin(), values.end());
  for (ObjectEntry& entry : entries_) {
    if (entry.index == object::kRpdoSource) entry.last_sub = kPdos;
    if (entry.has(ObjectFlags::kProcess))
      entry.offset += static_cast<ObjectSize>((entry.has(ObjectFlags::kPacked) ? 16 : 2) * process);
    if (entry.index < object::kRpdoParameter || entry.index > object::kLastPdo) continue;
    entry.more_indices = kPdos - 1;
    const std::size_t first = std::exchange(entry.offset, static_cast<ObjectSize>(power_on_.size()));
    for (std::size_t k = 0; k < std::size_t{entry.count()} * entry.capacity; ++k)
      power_on_.push_back(power_on_[first + k % entry.capacity]);
  }
  const std::uint32_t bytes = further == 0 ? 0 : 2 * regmap::kFurtherWords;
  const auto at = static_cast<std::uint32_t>(2 * further);
  std::array<table::Row, 4 * table::kTypes.size()> rows{};
  auto* end = table::put_variables(rows.data(), kInputs + table::kFurther, at, bytes, ObjectFlags::kMapRpdo);
  end = table::put_variables(end, kOutputs + table::kFurther, at + bytes, bytes, ObjectFlags::kMapTpdo);
  std::transform(rows.data(), end, std::back_inserter(entries_),
                 [](const table::Row& row) { return row.entry; });
  std::ranges::sort(entries_, {},
                    [](const ObjectEntry& entry) { return std::pair(entry.index, entry.first_sub); });
}

const OwnNodeMemory& ProcessData::fresh() {
  values_.assign(power_on_.size(), 0);
  rpdos_.assign(kPdos, {});
  tpdos_.assign(kPdos, {});
  pieces_.assign(2 * kPdos * kServices.objects_of_pdo, {});
  memory_ = {entries_, power_on_, values_, block_, {rpdos_, tpdos_, pieces_}};
  return memory_;
}

}  // namespace cbcan::sim
