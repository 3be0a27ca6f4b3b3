// SPDX-License-Identifier: MIT
#include "sim/coprocessor_module.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "cbcan/coprocessor/local_objects.hpp"

namespace cbcan::sim {

namespace {

/// What SDO clients may add to the objects of the network, in bytes.
constexpr std::size_t kRoomForObjects = 8192;

/// Uses the node ID that LSS has stored, if any.
Coprocessor::Settings with_address(Coprocessor::Settings settings, const StoredLss& lss) {
  if (lss.node_id - 1u < nmt::kMaxNode) settings.node_id = lss.node_id;
  return settings;
}

}  // namespace

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
    const std::size_t begin = power_on_.size();
    power_on_.resize(begin + std::size_t{entry.count()} * entry.capacity);
    for (std::size_t k = begin; k < power_on_.size(); ++k)
      power_on_[k] = power_on_[k < begin + entry.capacity ? first + k - begin : k - entry.capacity];
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

CoprocessorModule::CoprocessorModule(Bus& bus, Schedule& schedule, RegisterWindow window,
                                     ProcessRegisters process, const Coprocessor::Settings& settings,
                                     std::span<const ScannerWindow> scanners, ParameterStore* parameters)
    : Timed(schedule),
      parameters_(parameters),
      is_kept_(parameters != nullptr),
      port_(bus.attach(*this)),
      window_(window),
      process_(process),
      process_data_(process, 0, 0),
      settings_(settings),
      scanners_(scanners.begin(), scanners.end()) {
  make();
  const std::uint32_t bit_rate = parameters_.lss().bit_rate;
  hears_ = bit_rate == 0 || bus.bit_rate() == 0 || bit_rate == bus.bit_rate();
  port_.accept(nmt::kCommandId, nmt::kErrorControlId + nmt::kMaxNode);
  port_.accept(LssSlave::kResponseId, LssSlave::kRequestId);
}

void CoprocessorModule::make() {
  settings_.more = &process_data_.fresh();
  coprocessor_.emplace(window_, process_, port_, with_address(settings_, parameters_.lss()), scanners_[0]);
  channels_ = std::vector<FurtherChannels::Memory>(scanners_.size() - 1);
  further_.emplace(*coprocessor_, std::span(scanners_).subspan(1), channels_);
  if (is_kept_) coprocessor_->keep_in(parameters_);
  if (status_) coprocessor_->show_status_in(status_->first, status_->second);
  network_.assign(std::min(image_.size() + kRoomForObjects, NetworkObjects::kMostBytes), 0);
  std::ranges::copy(image_, network_.begin());
  coprocessor_->use_network(network_, image_.size());
}

void CoprocessorModule::show_status_in(StatusRegisters words, NodeRequestRegisters requests) {
  status_.emplace(words, requests);
  coprocessor_->show_status_in(words, requests);
}

void CoprocessorModule::manage(std::vector<std::uint8_t> image, std::span<std::uint16_t> all,
                               std::size_t further_first) {
  image_ = std::move(image);
  if (further_first != 0) {
    further_inputs_ = {further_first, regmap::kFurtherWords};
    further_outputs_ = {further_first + regmap::kFurtherWords, regmap::kFurtherWords};
    process_data_ = ProcessData(all, settings_.process_first, further_first);
  }
  make();
}

void CoprocessorModule::restart(Time now) {
  make();
  start(now);
}

void CoprocessorModule::start(Time now) {
  if (!hears_) port_.set_state(BusState::kBusOff, now);
  if (port_.state() != BusState::kActive) coprocessor_->on_bus_state(port_.state(), now);
  coprocessor_->start(now);
  poll(now);
}

void CoprocessorModule::on_frame(const Frame& frame, Time now) {
  ++received_;
  coprocessor_->on_frame(frame, now);
  if (watch_ != nullptr) watch_->after(now);
  poll(now);
}

void CoprocessorModule::keep_off(bool off, BusState otherwise, Time now) {
  if (std::exchange(is_kept_off_, off) != off) port_.set_state(off ? BusState::kBusOff : otherwise, now);
}

void CoprocessorModule::on_bus_state(BusState state, Time now) {
  if ((is_kept_off_ || !hears_) && state != BusState::kBusOff) return port_.set_state(BusState::kBusOff, now);
  coprocessor_->on_bus_state(state, now);
  poll(now);
}

void CoprocessorModule::on_registers_written(std::size_t first, std::size_t count, Time now) {
  if (watch_ != nullptr) watch_->before(now);
  coprocessor_->on_registers_written(first, count, now);
  const bool outputs = further_outputs_.overlaps({first, count});
  if (outputs || further_inputs_.overlaps({first, count})) coprocessor_->on_further_written(outputs, now);
  if (watch_ != nullptr) watch_->after(now);
  poll(now);
}

}  // namespace cbcan::sim
