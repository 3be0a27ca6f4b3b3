// SPDX-License-Identifier: MIT
// Random networks that the module boots, with faults that pass: none stays dead. Either the PLC and another
// master meddle, and in the end the PLC resets all; or faults come and go without them.

#include "core/manager_rig.hpp"
#include "sim/faulty_plant.hpp"

using namespace cbcan;
using namespace cbcan::test;

namespace {

constexpr std::uint8_t kFirstNode = 2;
constexpr unsigned kNoCase = ~0u;
constexpr std::uint16_t kOwn = 127, kAll = 128, kReset = 6;

/// Each passes; "%" = until then, in ms.
const char* const kPassing[] = {
    "silent until_ms=%",
    "power for_ms=% count=1",
    "bus-off until_ms=%",
    "slow delay_ms=300 until_ms=%",
    "heartbeat-stops until_ms=%",
    "response-never until_ms=%",
    "response-late delay_ms=400 until_ms=%",
    "request-lost until_ms=%",
    "abort code=0x08000022 until_ms=%",
};

class RandomNetwork final : private sim::Receiver {
 public:
  explicit RandomNetwork(std::uint64_t seed) : random_(seed), meddles_(one_of(2)), plant_(bit_rate()) {
    std::vector<Item> own, of_nodes;
    const auto last = static_cast<std::uint8_t>(kFirstNode + random_.below(4));
    for (std::uint8_t node = kFirstNode; node <= last; ++node)
      add_node(node, own, of_nodes);
    // Bit 6 stops nodes, which then need a PLC.
    own.push_back({0x1F80, 0, u32(1 | bits({{1, 4}, {4, 5}, {6, meddles_ ? 5u : kNoCase}}))});
    if (one_of(4)) own.push_back({0x1F89, 0, u32(400)});
    own.insert(own.end(), of_nodes.begin(), of_nodes.end());
    plant_.module.manage(image_of(concise(own)));
    port_.accept(0, 0x7FF);
    plant_.world.start(0);
  }

  /// Everything that happens; then whether all nodes run, and for how long the test has waited for that.
  bool ends_well() {
    for (unsigned events = 3 + random_.below(8); events != 0; --events) {
      pass(random_.below(2'000'000));
      meddles_ && !one_of(3) ? meddle() : disturb();
    }
    pass(20 * kSecond);
    if (meddles_) reset_all();
    for (unsigned second = 0; second != 130 && !plant_.all_run(); ++second)
      pass(kSecond);
    return plant_.all_run();
  }
  std::uint64_t digest() const { return digest_; }
  std::string state() {
    std::string text;
    for (unsigned node = 0; node != nodes_.size() + kFirstNode; ++node)
      text += std::to_string(plant_.of(node) >> 8) + ":" + std::to_string(plant_.of(node) & 0xFF) + " ";
    return text + (meddles_ ? "meddles" : "faults alone");
  }

 private:
  void on_frame(const Frame& frame, Time now) override {
    for (const char letter : std::to_string(now) + text_of(frame))
      digest_ = (digest_ ^ static_cast<unsigned char>(letter)) * 0x100000001B3;
  }

  bool one_of(unsigned cases) { return random_.below(cases) == 0; }
  struct Chance {
    unsigned bit;
    unsigned cases;  ///< it is set in one of so many
  };
  std::uint32_t bits(std::initializer_list<Chance> chances) {
    std::uint32_t value = 0;
    for (const Chance& each : chances)
      value |= std::uint32_t{one_of(each.cases)} << each.bit;
    return value;
  }
  std::uint32_t bit_rate() { return one_of(2) ? 0 : one_of(2) ? 125'000 : 1'000'000; }

  void add_node(std::uint8_t node, std::vector<Item>& own, std::vector<Item>& of_nodes) {
    sim::NodeParts parts = faulty_node(nullptr, node);
    parts.seed = node;
    const auto offset = static_cast<std::uint32_t>(parts.image.values.size());
    for (const std::uint16_t index : {std::uint16_t{0x1010}, std::uint16_t{0x1011}})
      parts.image.entries.insert(parts.image.entries.begin() + index - 0x100F,
                                 {index, 1, 1, DataType::kUnsigned32, 0, ObjectFlags::kReadWrite,
                                  offset + 4u * (index - 0x1010u), 4});
    parts.image.values.resize(offset + 8);
    nodes_.push_back(&plant_.world.add_node(std::move(parts)));
    std::vector<Item> writes{{0x2001, 0, {7, 0}}};
    if (!one_of(3)) {
      own.push_back(
          {0x1016, static_cast<std::uint8_t>(node - kFirstNode + 1), u32(std::uint32_t{node} << 16 | 250u)});
      writes.push_back({0x1017, 0, {100, 0}});
    }
    if (one_of(4)) writes.push_back({0x1010, 1, {'s', 'a', 'v', 'e'}});
    of_nodes.push_back({0x1F81, node, u32(5 | bits({{3, 3}, {4, 4}}))});
    of_nodes.push_back({0x1F22, node, concise(writes)});
    if (one_of(4)) of_nodes.push_back({0x1F8A, node, u8(1)});
  }

  void disturb() {
    std::string fault = kPassing[random_.below(std::size(kPassing))];
    if (const std::size_t at = fault.find('%'); at != std::string::npos)
      fault.replace(at, 1, std::to_string(1 + random_.below(5000)));
    if (one_of(8)) {
      plant_.module.port().set_state(BusState::kBusOff, plant_.now);
      pass(random_.below(3'000'000));
      return plant_.module.port().set_state(BusState::kActive, plant_.now);
    }
    nodes_[random_.below(static_cast<std::uint32_t>(nodes_.size()))]->faults().add(
        fault_from(fault, sim::FaultPlace::kNode), plant_.now);
  }

  void meddle() {
    constexpr std::uint16_t kServices[] = {5, 4, 127, 6, 7};
    constexpr std::uint8_t kSpecifiers[] = {1, 2, 0x80, 0x81, 0x82};
    const auto node =
        static_cast<std::uint16_t>(kFirstNode + random_.below(static_cast<std::uint32_t>(nodes_.size())));
    const std::uint16_t addressed = one_of(3) ? kAll : one_of(2) ? kOwn : node;
    const std::uint32_t service = random_.below(5);
    switch (random_.below(5)) {
      case 0: return request({5066, 0, 0x1F25, one_of(2) ? kAll : node, 4, 0x6F63, 0x666E});
      case 1: return request({5055, node, 0x2001, 0, 2});
      case 2: {
        const auto id = static_cast<std::uint8_t>(addressed == kAll ? 0 : addressed);
        port_.try_send(Frame{0, 2, 0, {kSpecifiers[service], id}});
        return pass(0);
      }
      default: request({5066, 0, 0x1F82, addressed, 1, kServices[service]});
    }
  }

  void reset_all() {
    const bool own_first = one_of(2);
    request({5066, 0, 0x1F82, own_first ? kOwn : kAll, 1, kReset});
    pass(random_.below(2'000'000));
    request({5066, 0, 0x1F82, own_first ? kAll : kOwn, 1, kReset});
  }

  void request(std::initializer_list<std::uint16_t> words) {
    plant_.request(words);
    pass(5 * kSecond);
    CHECK(plant_.reg(3700) != 0xCA0E);
  }
  void pass(Time duration) { plant_.pass(duration); }

  sim::Random random_;
  bool meddles_;
  ModulePlant plant_;
  sim::Port& port_ = plant_.world.bus().attach(*this);
  std::vector<sim::Node*> nodes_;
  std::uint64_t digest_ = 0xCBF29CE484222325;
};

/// Returns the digest of all frames with their times.
std::uint64_t boot(std::uint64_t first, std::uint64_t count) {
  std::uint64_t digest = 0;
  unsigned dead = 0;
  for (std::uint64_t seed = first; seed != first + count; ++seed) {
    INFO("seed " << seed);
    RandomNetwork network(seed);
    const bool well = network.ends_well();
    if (!well) UNSCOPED_INFO(network.state());
    CHECK(well);
    dead += !well;
    digest = digest * 31 + network.digest();
  }
  INFO(dead << " of " << count << " are dead");
  CHECK(dead == 0);
  return digest;
}

}  // namespace

TEST_CASE("1000 random networks: none stays dead") {
  boot(1, 1000);
}

TEST_CASE("3000 random networks: none stays dead, and the digest is that of every compiler", "[.long]") {
  const std::uint64_t digest = boot(1001, 3000);
  std::cout << "digest " << std::hex << digest << '\n';
}
