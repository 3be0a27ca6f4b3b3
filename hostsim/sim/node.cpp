// SPDX-License-Identifier: MIT
#include "sim/node.hpp"

#include <iterator>

#include "base/text.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "sim/number.hpp"

namespace cbcan::sim {

namespace {

/// The node ID that an image is made for; 0 = for none.
constexpr std::uint8_t image_id(std::uint8_t node_id) {
  return node_id == Node::kNoNodeId ? std::uint8_t{0} : node_id;
}

/// The values that are the same in both.
std::vector<NodeIdValue> unchanged(const std::vector<NodeIdValue>& list, std::span<const std::uint8_t> before,
                                   std::span<const std::uint8_t> now) {
  std::vector<NodeIdValue> same;
  std::ranges::copy_if(list, std::back_inserter(same), [&](const NodeIdValue& value) {
    return std::ranges::equal(before.subspan(value.offset, value.size),
                              now.subspan(value.offset, value.size));
  });
  return same;
}

/// A rate that is not in the table gets the index of the empty row, whose rate is 0: stored, it means none.
std::uint8_t lss_index_of(std::uint32_t bit_rate) {
  auto found = std::ranges::find(kLssBitRates, bit_rate);
  if (found == kLssBitRates.end()) found = std::ranges::find(kLssBitRates, 0u);
  return static_cast<std::uint8_t>(found - kLssBitRates.begin());
}

}  // namespace

Node::Node(Bus& bus, Schedule& schedule, NodeParts parts)
    : Timed(schedule),
      name_(std::move(parts.name)),
      device_name_(parts.device),
      description_(parts.description ? std::move(parts.description)
                                     : std::make_shared<const descriptions::DeviceDescription>()),
      image_(descriptions::prepared(std::move(parts.image))),
      values_(image_.values),
      saved_(image_.values),
      memory_(descriptions::memory_of(image_.entries)),
      parameters_(parts.parameters),
      listener_(parts.listener),
      port_(bus.attach(*this)),
      faulty_(port_, parts.node_id, parts.seed, parts.listener, [this](Time now) { finish_update(now); }),
      device_(parts.node_id, {image_.entries, values_, image_.limits},
              {memory_.buffer, {memory_.rpdos, memory_.tpdos, memory_.pieces}, memory_.watched}, *this,
              faulty_),
      more_servers_(device_.dictionary(), faulty_, memory_.buffer.size(), parts.block_timeout_ms),
      bus_rate_(bus.bit_rate()),
      start_node_id_(parts.node_id),
      values_node_id_(image_id(parts.node_id)),
      signals_(std::move(parts.signals)),
      samples_due_(signals_.size(), kNever),
      make_behaviour_(std::move(parts.behaviour)),
      seed_(parts.seed) {
  LssApplication& of_lss = *this;
  device_.slave().sdo_server().set_block_timeout(parts.block_timeout_ms);
  if (parts.takes_time) faulty_.set_timing(seed_);
  if (parts.lss) lss_.emplace(of_lss, faulty_);
  add_program();
  behaviour_ = make_behaviour_ ? make_behaviour_(*this, seed_) : std::make_unique<Behaviour>();
  image_.values = saved_ = values_;  // with the behaviour's values for objects that have none in the file
  if (!make_behaviour_) descriptions::mark_mapped(image_.entries, dictionary());
  for (ObjectEntry& entry : image_.entries) {
    if (behaviour_->is_set_point(entry.index)) entry.flags |= ObjectFlags::kSetPoint;
    if (behaviour_->is_kept(entry.index)) entry.flags |= ObjectFlags::kKept;
  }
  if (parameters_ != nullptr) load_parameters();
}

/// Does something with the node at this time, then everything that follows from it.
template <class Act>
void Node::at(Time now, Act act) {
  faulty_.set_now(now);
  act();
  finish_update(now);
}

void Node::start(Time now) {
  at(now, [&] {
    started_at_ = now;
    if (program_) program_->restart();
    if (lss_) start_lss(now);
    if (start_node_id_ != kNoNodeId || device_.state() != nmt::State::kInitialising) device_.start(now);
    update(now);
    if (!signals_.empty()) {
      samples_due_.assign(signals_.size(), now);
      follow_signals(now);
    }
    follow_ids();
  });
}

void Node::set_power(bool on, Time now) {
  if (on == has_power_) return;
  power_back_ = kNever;
  if (on) {
    port_.set_state(state_with_power_, now);
    has_power_ = true;
    if (stored_lss_.node_id != 0) start_node_id_ = stored_lss_.node_id;
    take_node_id(start_node_id_);
    return start(now);
  }
  has_power_ = false;
  tell_state(0xFF, now);
  state_with_power_ = port_.state();
  faulty_.drop();
  port_.set_state(BusState::kBusOff, now);
  behaviour_->reset(true, now);
  follow_ids();
  finish_update(now);
}

void Node::poll(Time now) {
  if (now >= power_back_) return set_power(true, now);
  if (!has_power_) return;
  faulty_.poll(now);
  if (lss_) lss_->poll(now);
  if (now >= sample_due_) follow_signals(now);
  if (now >= behaviour_due_) update(now);
  if (program_ && now >= program_->due && program_->poll(now))
    device_.slave().command(program_->runs() ? nmt::Command::kResetNode : nmt::Command::kResetCommunication,
                            now);
  more_servers_.poll(now);
  device_.poll(now);
  finish_update(now);
}

void Node::on_frame(const Frame& frame, Time now) {
  faulty_.set_now(now);
  if (faulty_.has_faults()) {
    if (!faulty_.hears(frame)) return finish_update(now);
    update_pending_ = true;
  }
  if (program_ && !program_->runs() && nmt::is_command(frame) &&
      frame.data[0] == static_cast<std::uint8_t>(nmt::Command::kStart))
    return;  // a boot loader has no PDOs
  if (lss_ && frame.id == LssSlave::kRequestId)
    lss_->on_frame(frame, now);
  else if (more_servers_.serves(frame.id))
    ask_more_servers(frame, now);
  else if (!device_.on_frame(frame, now) && !update_pending_)
    return;  // most RPDOs, which wait for a SYNC, most SYNCs, and SDO uploads of a node without a behaviour
  finish_update(now);
}

void Node::ask_more_servers(const Frame& frame, Time now) {
  if (!nmt::is_running(device_.state())) return;
  refresh(now);
  more_servers_.on_frame(frame, now);
  update(now);
}

void Node::on_bus_state(BusState state, Time now) {
  if (!has_power_) return;
  faulty_.set_now(now);
  if (state == BusState::kBusOff) faulty_.drop();
  if (!is_switching_) device_.on_bus_state(state, now);
  poll(now);
}

// ---- Node ID and bit rate

std::uint32_t Node::identity(std::uint8_t part) const {
  return static_cast<std::uint32_t>(
      device_.dictionary().get(object::kIdentity, static_cast<std::uint8_t>(part + 1)));
}

/// Without a stored bit rate the node has that of the bus.
void Node::start_lss(Time now) {
  own_rate_ = stored_lss_.bit_rate == 0 ? bus_rate_ : stored_lss_.bit_rate;
  set_on_bus(true, now);
  lss_->start(start_node_id_, lss_index_of(own_rate_), now);
}

bool Node::is_bit_rate_supported(std::uint8_t table_index) const {
  return table_index < kLssBitRates.size() && kLssBitRates[table_index] != 0;
}

void Node::set_on_bus(bool on, Time now) {
  const bool hears = on && (bus_rate_ == 0 || own_rate_ == bus_rate_);
  is_switching_ = true;
  port_.set_state(hears ? BusState::kActive : BusState::kBusOff, now);
  is_switching_ = false;
}

void Node::activate_bit_rate(std::uint8_t table_index, Time /*now*/) {
  own_rate_ = kLssBitRates[table_index];
}

LssApplication::StoreResult Node::store(std::uint8_t node_id, std::uint8_t bit_rate) {
  const StoredLss before = std::exchange(stored_lss_, {node_id, kLssBitRates[bit_rate]});
  if (keep_saved()) return StoreResult::kStored;
  stored_lss_ = before;
  return StoreResult::kAccessError;
}

/// Values with $NODEID change, in the power-on values and in stored ones that are the same.
void Node::take_node_id(std::uint8_t node_id) {
  const std::vector<NodeIdValue> following = unchanged(image_.node_id_values, image_.values, saved_);
  change_node_id(image_.values, image_.node_id_values, values_node_id_, image_id(node_id));
  change_node_id(saved_, following, values_node_id_, image_id(node_id));
  values_node_id_ = image_id(node_id);
  faulty_.set_node_id(node_id);
  device_.set_node_id(node_id);
}

void Node::on_node_id(std::uint8_t node_id, Time now) {
  take_node_id(node_id);
  device_.start(now);
}

/// Called after every event: ends a reset, and a transfer that a fault has aborted, updates the filter, and
/// sets the next deadline.
void Node::finish_update(Time now) {
  update_pending_ = false;
  while (device_.slave().resetting())
    device_.poll(now);
  while (faulty_.has_aborted())
    device_.on_frame(faulty_.take_abort(), now);
  if (ids_changed_) follow_ids();
  if (activity_flag_ != nullptr) *activity_flag_ = true;
  if (!faulty_.is_idle() || command_delay_ != 0) follow_faults(now);
  if (!has_power_) return wants(power_back_);
  const Time device = faulty_.boots() ? kNever : device_.deadline();  // it would try again and again
  const Time servers = earlier(device, more_servers_.deadline());
  const Time program = program_ ? program_->due : kNever;
  const Time own = earlier(earlier(servers, program), earlier(behaviour_due_, sample_due_));
  const Time lss = lss_ ? lss_->deadline() : kNever;
  wants(earlier(own, earlier(lss, faulty_.deadline())));
}

void Node::follow_faults(Time now) {
  if (const Time loss = faulty_.take_power_loss(); loss != 0 && has_power_) {
    set_power(false, now);
    power_back_ = loss == kNever ? kNever : now + loss;
  }
  if (has_power_ && faulty_.command_delay() != command_delay_)
    behaviour_->delay_commands(command_delay_ = faulty_.command_delay());
}

/// The port may be delivering through its filter right now: identifiers that stay are left alone.
void Node::follow_ids() {
  ids_changed_ = false;
  std::vector<std::uint32_t> wanted;
  if (lss_ && has_power_) wanted.push_back(LssSlave::kRequestId);
  const auto want = [&wanted](std::uint32_t id) { wanted.push_back(id); };
  if (has_power_ && device_.state() != nmt::State::kInitialising) {
    device_.visit_ids(want);
    more_servers_.visit_ids(want);
  }
  std::ranges::sort(wanted);
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  for (const std::uint32_t id : received_ids_)
    if (!std::ranges::binary_search(wanted, id)) port_.refuse(id, id);
  for (const std::uint32_t id : wanted)
    if (!std::ranges::binary_search(received_ids_, id)) port_.accept(id, id);
  received_ids_ = std::move(wanted);
}

// ---- Behaviour

void Node::update(Time now) {
  behaviour_due_ = behaviour_->update(now);
  updated_at_ = now;
  if (activity_flag_ != nullptr) *activity_flag_ = true;
}

/// Called before a response, which may also trigger injected faults.
void Node::refresh(Time now) {
  const bool stale = make_behaviour_ && updated_at_ != now;
  update_pending_ = update_pending_ || stale || !faulty_.is_idle();
  if (stale) update(now);
}

void Node::on_sync(Time now) {
  const Time due = behaviour_due_;
  behaviour_->on_sync(now);
  update(now);
  update_pending_ = update_pending_ || behaviour_due_ != due;  // no fault delays a PDO
}

void Node::on_state(nmt::State state, Time now) {
  if (program_ && state == nmt::State::kInitialising && device_.slave().resets_application())
    program_->restart();
  if (lss_ && state == nmt::State::kInitialising) take_node_id(lss_->reset_communication(now));
  more_servers_.configure();
  ids_changed_ = true;  // an Initialising node receives nothing
  if (!nmt::is_running(state)) more_servers_.reset();
  tell_state(static_cast<std::uint8_t>(state), now);
  behaviour_->on_state(state, now);
  update(now);
}

void Node::tell_state(std::uint8_t state, Time now) {
  if (listener_ != nullptr) listener_->on_node_state(device_.node_id(), state, now);
}

void Node::on_network_failure(NetworkFailure failure, Time now) {
  behaviour_->on_network_failure(failure, now);
  update(now);
}

bool Node::set_input(std::uint16_t index, std::uint8_t sub, double value, Time now, bool connected) {
  bool known = false;
  at(now, [&] {
    known = put_input(index, sub, value, now, connected);
    if (known) update(now);
  });
  return known;
}

bool Node::put_input(std::uint16_t index, std::uint8_t sub, double value, Time now, bool connected) {
  const std::pair place(index, sub);
  if (behaviour_->set_input(index, sub, value, now)) return inputs_[place] = {value}, true;
  if (index < object::kFirstManufacturer)
    return false;  // communication objects need the checks of an SDO write
  const auto entry = find_number(dictionary(), index, sub);
  if (!entry || entry->has(ObjectFlags::kComputed)) return false;
  const std::uint64_t before = dictionary().get(index, sub);
  dictionary().set(index, sub, to_raw(value, entry->type, entry->capacity));
  const std::uint64_t after = dictionary().get(index, sub);
  if (connected || !make_behaviour_ || inputs_.contains(place)) inputs_[place] = {value, after};
  if (after != before) device_.changed(index, sub, now);
  return true;
}

void Node::put_stored_inputs() {
  for (const auto& [place, input] : inputs_)
    if (input.stored) dictionary().set(place.first, place.second, *input.stored);
}

void Node::follow_signals(Time now) {
  sample_due_ = kNever;
  const Time since_start = now - started_at_;
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    const Signal& signal = signals_[i];
    if (now >= samples_due_[i]) {
      put_input(signal.index, signal.sub, signal.value_at(since_start), now, true);
      const Time next = signal.next_sample(since_start);
      samples_due_[i] = next == kNever ? kNever : started_at_ + next;
    }
    sample_due_ = earlier(sample_due_, samples_due_[i]);
  }
  update(now);
}

/// Reading a value is not an activity.
void Node::bring_up_to_date(Time now) {
  bool* const flag = std::exchange(activity_flag_, nullptr);
  at(now, [&] { refresh(now); });
  activity_flag_ = flag;
}

std::optional<double> Node::number(const Terminal& terminal) {
  std::optional<double> value;
  if (terminal.is_output)
    value = behaviour_->output(terminal.index, terminal.sub);
  else if (const auto entry = find_number(dictionary(), terminal.index, terminal.sub))
    value = from_raw(dictionary().number(*entry, terminal.sub), entry->type, entry->capacity);
  if (!value || !terminal.bit) return value;
  return static_cast<double>(to_raw(*value, DataType::kInteger64, 8) >> *terminal.bit & 1);
}

std::vector<Point> Node::points() {
  std::vector<Point> points = behaviour_->points();
  std::erase_if(points, [&](const Point& point) {
    return !number({point.index, point.sub, std::nullopt, false});
  });
  for (Point& point : points) {
    const descriptions::Object* const object = description_->find(point.index, point.sub);
    if (point.name.empty() && object != nullptr) point.name = object->name;
  }
  return points;
}

bool Node::set_incident(std::string_view incident, bool present, Time now) {
  const auto known = behaviour_->incidents();
  const auto found = std::ranges::find(known, incident);
  if (found == known.end()) return false;
  at(now, [&] {
    behaviour_->set_incident(static_cast<std::size_t>(found - known.begin()), present, now);
    update(now);
  });
  return true;
}

void Node::reload(Time now) {
  std::unique_ptr<Behaviour> fresh = make_behaviour_(*this, seed_);
  at(now, [&] {
    behaviour_ = std::move(fresh);
    behaviour_->reset(true, now);
    for (const auto& [place, input] : inputs_)
      if (!input.stored) behaviour_->set_input(place.first, place.second, input.value, now);
    update(now);
  });
}

std::string Node::inject(std::string_view fault, Time now) {
  constexpr std::size_t kMostFaults = 100;
  const FaultOrProblem made = parse_fault(fault, FaultPlace::kNode);
  if (!made.problem.empty()) return made.problem;
  if (faults().list().size() >= kMostFaults) faults().remove_ended(now);
  if (faults().list().size() >= kMostFaults)
    return "the node has 100 faults already; give them an end, or a count";
  faults().add(made.fault, now);
  return {};
}

void Node::terminals(std::uint16_t index, std::uint8_t sub, std::int32_t before, std::int32_t after,
                     Time now) {
  if (listener_ != nullptr) listener_->on_terminals(device_.node_id(), index, sub, before, after, now);
}

/// One line of UTF-8, whatever a script has put into it.
void Node::tell(std::string_view text, Time now) {
  faults().say(base::to_utf8(text), now);
}

// ---- The dictionary

std::vector<std::uint8_t> Node::value(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  bring_up_to_date(now);
  const auto stored = dictionary().value(entry, sub);
  std::vector<std::uint8_t> bytes(stored.begin(), stored.end());
  if (!entry.has(ObjectFlags::kComputed)) return bytes;
  std::size_t size = entry.capacity;
  bytes.resize(size);
  on_read(entry, sub, bytes, size, now);
  return bytes;
}

/// 1010h and 1011h: what the device supports, as its EDS file says.
AbortCode Node::on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                        std::size_t& size, Time /*now*/) {
  const std::size_t offset = entry.offset + std::size_t{entry.stride()} * (sub - entry.first_sub);
  size = entry.capacity;
  if (program_ && sub != 0 && is_program_number(entry.index))
    return program_->download.on_read(entry.index, out.first(size));
  std::ranges::copy(std::span(image_.values).subspan(offset, size), out.begin());
  return AbortCode::kNone;
}

AbortCode Node::on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                         Time now) {
  const AbortCode refused = writes_itself_ ? AbortCode::kNone : faulty_.refusal(entry.index, sub);
  if (refused == AbortCode::kNone && program_ && entry.index == object::kProgramControl) {
    program_->due = now;
    return program_->download.on_write(value[0], now);
  }
  const AbortCode answer = refused != AbortCode::kNone ? refused : behaviour_->check(entry, sub, value, now);
  return answer == AbortCode::kLater ? AbortCode::kGeneral
                                     : answer;  // a file or a script may give any number
}

void Node::write_own(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value, Time now) {
  writes_itself_ = true;
  DeviceNode::write_own(index, sub, value, now);
  writes_itself_ = false;
}

void Node::on_stored(const ObjectEntry& entry, std::uint8_t sub, Time now) {
  if (MoreSdoServers::owns(entry.index)) more_servers_.configure();
  device_.changed(entry.index, sub, now);
}

void Node::restore(std::uint16_t first_index, std::uint16_t last_index, Time now) {
  restore_values(image_.entries, saved_, values_, first_index, last_index);
  const bool application = last_index >= object::kFirstManufacturer;
  if (application) put_stored_inputs();
  behaviour_->reset(application, now);
  if (application) put_stored_inputs();  // whatever the device has set there
}

}  // namespace cbcan::sim
