// SPDX-License-Identifier: MIT
#include "fuzz/device_plant.hpp"

#include "config/plant_file.hpp"
#include "fuzz/fuzz.hpp"

namespace cbcan::fuzz {

namespace {

constexpr std::size_t kMostStepsAtOnce = 100;
constexpr unsigned kMostFramesAtOnce = 20'000;  // many times the size of the queues

sim::NodeParts read_node(std::uint8_t id, const char* eds) {
  config::NodeConfig config;
  config.id = id;
  config.eds = std::string("demo:/") + eds;
  const auto no_disk = [](const std::string&) { return std::optional<std::string>(); };
  config::EdsFiles files(config::with_demo_plant(no_disk));
  config::NodeBuild build = config::build_node(config, 0, files);
  require(build.node.has_value(), "the demo's nodes can be built");
  return std::move(*build.node);
}

/// Each file is read once.
const sim::NodeParts& built_node(std::size_t place, std::uint8_t id, const char* eds) {
  static std::array<std::optional<sim::NodeParts>, DevicePlant::kNodes> built;
  if (!built[place]) built[place] = read_node(id, eds);
  return *built[place];
}

unsigned bit_of(nmt::State state) {
  switch (state) {
    case nmt::State::kInitialising: return 1;
    case nmt::State::kStopped: return 2;
    case nmt::State::kPreOperational: return 4;
    case nmt::State::kOperational: return 8;
  }
  std::abort();
}

constexpr unsigned kInitialising = 1;
constexpr unsigned kOperational = 8;
constexpr unsigned kRunning = 4 | kOperational;

/// CiA 402: the possible patterns of a statusword.
bool is_status(std::uint16_t word) {
  const unsigned without_quick_stop = word & 0x4Fu;
  const unsigned whole = word & 0x6Fu;
  return without_quick_stop == 0x00 || without_quick_stop == 0x40 || without_quick_stop == 0x0F ||
         without_quick_stop == 0x08 || whole == 0x21 || whole == 0x23 || whole == 0x27 || whole == 0x07;
}

}  // namespace

DevicePlant::DevicePlant(const PlantOptions& options) : bare(options.bit_rate), options_(options) {
  now = 1000;
  sim::NodeParts io_module;
  io_module.name = "I/O module";
  if (options.signals) {
    io_module.signals.push_back({0x6401, 1, 50 * kMillisecond, sim::Sine{0, 20'000, kSecond, 0}});
    io_module.signals.push_back({0x6000, 1, 70 * kMillisecond, sim::Noise{128, 90, 3}});
  }
  add(kIoModule, 2, "io_module.eds", io_module);
  sim::NodeParts with_lss;
  with_lss.lss = true;
  add(kDrive, 5, "drive.eds", with_lss);
  node(kDrive).device().time_stamp().produce_every(kSecond, now);
  add(kWithoutId, 0, "generic.eds", with_lss);
  world.bus().observe(*this);
  if (options.by_deadlines) world.bus().set_modifier(this);
  world.start(now);
  settle();
}

void DevicePlant::add(std::size_t place, std::uint8_t id, const char* eds, sim::NodeParts parts) {
  const sim::NodeParts& built = built_node(place, id, eds);
  Watched& watched = nodes_[place];
  watched.store.works = options_.stores;
  parts.node_id = built.node_id;
  parts.device = built.device;
  parts.image = built.image;
  parts.behaviour = built.behaviour;
  parts.parameters = &watched.store;
  parts.seed = place;
  watched.node = &world.add_node(std::move(parts));
}

void DevicePlant::add_fault(std::size_t place, const sim::Fault& fault) {
  nodes_[place].harmed = true;
  node(place).faults().add(fault, now);
}

void DevicePlant::add_bus_fault(const sim::Fault& fault) {
  world.faults().add(fault, now);
}

// ---- Time

Time DevicePlant::advance_to(Time end) {
  if (!options_.by_deadlines) {
    advance(end);
    return now;
  }
  for (std::size_t steps = 0; world.next_deadline() <= end; ++steps) {
    if (steps == kMostStepsAtOnce || steps_left_ == 0) return now;
    --steps_left_;
    advance(world.next_deadline());
  }
  advance(end);
  return now;
}

void DevicePlant::settle() {
  // Faults of the bus are between the wire and this receiver, and are removed afterwards.
  const auto faults = world.faults().list();
  const auto is_of_frames = [](const sim::SetFault& set) { return sim::is_of_frames(set.fault.kind); };
  if (options_.by_deadlines && std::ranges::none_of(faults, is_of_frames)) world.bus().set_modifier(this);
  advance(now);
}

void DevicePlant::advance(Time time) {
  now = std::max(now, time);
  frames_at_once_ = 0;
  forget_states();
  world.advance(now);
  if (options_.by_deadlines) check_states();
  forget_states();
}

void DevicePlant::check_states() {
  require(world.next_deadline() > now, "what is due has been done");
  require(is_status(static_cast<std::uint16_t>(node(kDrive).device().dictionary().get(0x6041, 0))),
          "the statusword is one of CiA 402");
}

/// A frame in a queue was sent in one of the states since the bus was last silent.
void DevicePlant::note_states() {
  for (Watched& watched : nodes_)
    watched.states |= bit_of(watched.node->device().state());
}

void DevicePlant::forget_states() {
  if (world.bus().next_deadline() == kNever)
    for (Watched& watched : nodes_)
      watched.states = 0;
  note_states();
}

// ---- Frames

void DevicePlant::on_bus_frame(const Frame& frame, Time at) {
  seen_.push_back({at, frame});
}

void DevicePlant::on_arrival(const Frame& frame, const sim::Port* sender, Time at) {
  require(++frames_at_once_ < kMostFramesAtOnce, "a moment has an end");
  note_states();
  for (Watched& watched : nodes_)
    if (sender == &watched.node->port()) check_frame(watched, frame);
  world.bus().deliver(frame, sender, at);
  note_states();
}

void DevicePlant::check_frame(Watched& sender, const Frame& frame) {
  const std::uint32_t id = sender.node->device().node_id();
  require(frame.flags == 0 && frame.id <= 0x7FF && frame.length <= 8, "nodes send data frames of 11 bits");
  if (frame.id == sdo::kResponseId + id) ++sender.responses;
  if (sender.harmed || options_.bit_rate != 0) return;
  if (frame.id == LssSlave::kResponseId) return require(frame.length == 8, "a response of LSS has 8 bytes");
  require(id != sim::Node::kNoNodeId, "without a node ID there is LSS and nothing else");
  if (frame.id == nmt::kErrorControlId + id) {
    require(frame.length == 1 && nmt::is_state(frame.data[0] & nmt::kStateMask),
            "error control is one byte with a state");
    const unsigned told = bit_of(static_cast<nmt::State>(frame.data[0] & nmt::kStateMask));
    return require(((sender.states | kInitialising) & told) != 0, "the state that is told is the node's");
  }
  require((sender.states & kRunning) != 0, "a node in Stopped has error control and nothing else");
  if (frame.id == sdo::kResponseId + id) return require(frame.length == 8, "an SDO response has 8 bytes");
  check_configured_frame(sender, frame);
}

void DevicePlant::check_configured_frame(Watched& sender, const Frame& frame) {
  ObjectDictionary& objects = sender.node->device().dictionary();
  const auto cob_id = [&](std::uint16_t index, std::uint8_t sub) {
    return static_cast<std::uint32_t>(objects.get(index, sub));
  };
  require(!cob::is_restricted(frame.id), "no CAN-ID that is restricted");
  const auto is = [&](std::uint32_t configured) { return cob::id_of(configured) == frame.id; };
  const std::uint32_t sync = cob_id(0x1005, 0);
  const std::uint32_t time = cob_id(0x1012, 0);
  const std::uint32_t emergency = cob_id(0x1014, 0);
  if (is(sync) && (sync & cob::kProduces) != 0 && cob_id(0x1006, 0) != 0 && frame.length <= 1) return;
  if (is(time) && (time & cob::kProduces) != 0 && frame.length == 6) return;
  if (is(emergency) && (emergency & cob::kInvalid) == 0 && frame.length == 8) return;
  for (std::uint16_t index = object::kTpdoParameter; index < object::kTpdoParameter + 4; ++index) {
    const std::uint32_t tpdo = cob_id(index, 1);
    if (!is(tpdo) || (tpdo & cob::kInvalid) != 0) continue;
    return require((sender.states & kOperational) != 0, "PDOs are for Operational");
  }
  require(false, "a node has the CAN-IDs that its dictionary names");
}

// ---- The master

bool DevicePlant::is_heard(Watched& node) {
  return options_.by_deadlines && options_.bit_rate == 0 && world.faults().list().empty() &&
         world.bus().link() && node.node->port().state() != BusState::kBusOff && !node.harmed &&
         (bit_of(node.node->device().state()) & kRunning) != 0;
}

/// In block transfers, requests may have several responses or none.
bool DevicePlant::is_answered_once(Watched& node, const Frame& request) {
  const bool is_request = request.flags == 0 && request.length == 8 && request.data[0] < 0x80;
  return is_request && !node.in_block && is_heard(node);
}

void DevicePlant::receive(const Frame& frame) {
  std::array<unsigned, kNodes> wanted{};
  std::array<bool, kNodes> counts{};
  for (std::size_t place = 0; place < kNodes; ++place) {
    Watched& watched = nodes_[place];
    if (frame.id != sdo::kRequestId + id(place) || (frame.flags & Frame::kExtended) != 0) continue;
    counts[place] = is_answered_once(watched, frame);
    wanted[place] = watched.responses + 1;
    if (frame.flags != 0 || frame.length != 8) continue;
    if (frame.data[0] >= 0xA0) watched.in_block = true;
    if (frame.data[0] == sdo::command(sdo::Request::kAbort) && is_heard(watched)) watched.in_block = false;
  }
  world.bus().receive(frame, now);
  settle();
  for (std::size_t place = 0; place < kNodes; ++place)
    require(!counts[place] || nodes_[place].responses == wanted[place], "one response to an SDO request");
}

}  // namespace cbcan::fuzz
