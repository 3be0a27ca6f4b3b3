// SPDX-License-Identifier: MIT
#include <map>
#include <utility>

#include "devices/lua/lua_device.hpp"
#include "sim/number.hpp"

namespace cbcan::devices {

namespace {

/// Changes of both are reported to the node after both, as a TPDO needs the values that are left.
class Beside final : public sim::Behaviour, private sim::DeviceNode {
 public:
  Beside(sim::DeviceNode& node, std::uint64_t seed, const std::string& name, const std::string& script,
         const sim::BehaviourMaker& below)
      : node_(node),
        below_(below ? below(*this, seed) : std::make_unique<sim::Behaviour>()),
        script_(make_lua_device(*this, seed, name, script)) {}

  void reset(bool application, Time now) override {
    below_->reset(application, now);
    script_->reset(application, now);
    changed_.clear();
  }

  Time update(Time now) override {
    if (reporting_) return report(now), due_;
    script_->before_update(now);
    const Time due = below_->update(now);
    in_script_ = true;
    due_ = earlier(due, script_->update(now));
    in_script_ = false;
    reporting_ = true;
    report(now);
    reporting_ = false;
    return due_;
  }

  AbortCode check(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                  Time now) override {
    const AbortCode code = script_->check(entry, sub, value, now);
    return code != AbortCode::kNone ? code : below_->check(entry, sub, value, now);
  }
  void on_sync(Time now) override {
    below_->on_sync(now);
    script_->on_sync(now);
  }
  void on_state(nmt::State state, Time now) override {
    below_->on_state(state, now);
    script_->on_state(state, now);
  }
  void on_network_failure(sim::NetworkFailure failure, Time now) override {
    below_->on_network_failure(failure, now);
    script_->on_network_failure(failure, now);
  }
  void delay_commands(Time delay) override { below_->delay_commands(delay); }
  bool is_set_point(std::uint16_t index) const override { return below_->is_set_point(index); }
  bool is_kept(std::uint16_t index) override { return script_->is_kept(index) || below_->is_kept(index); }

  bool set_input(std::uint16_t index, std::uint8_t sub, double value, Time now) override {
    return script_->set_input(index, sub, value, now) || below_->set_input(index, sub, value, now);
  }
  std::optional<double> output(std::uint16_t index, std::uint8_t sub) const override {
    const auto own = script_->output(index, sub);
    return own ? own : below_->output(index, sub);
  }
  std::vector<sim::Point> points() const override { return joined(below_->points(), script_->points()); }
  std::vector<std::string_view> incidents() const override {
    return joined(below_->incidents(), script_->incidents());
  }
  std::vector<std::string_view> alarms() const override {
    return joined(below_->alarms(), script_->alarms());
  }
  void set_incident(std::size_t place, bool present, Time now) override {
    const std::size_t of_device = below_->incidents().size();
    if (place < of_device) return below_->set_incident(place, present, now);
    script_->set_incident(place - of_device, present, now);
  }

 private:
  using Object = std::pair<std::uint16_t, std::uint8_t>;  ///< index and sub-index

  template <class Item>
  static std::vector<Item> joined(std::vector<Item> all, const std::vector<Item>& more) {
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  // The node of both.
  ObjectDictionary& dictionary() override { return node_.dictionary(); }
  void write_own(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                 Time now) override {
    node_.write_own(index, sub, value, now);
  }
  void error(std::uint16_t code, std::uint8_t register_bits, const sim::EmergencyInfo& info,
             Time now) override {
    node_.error(code, register_bits, info, now);
  }
  void error_over(std::uint16_t code, Time now) override { node_.error_over(code, now); }
  void changed(std::uint16_t index, std::uint8_t sub, Time /*now*/) override {
    changed_.emplace_back(index, sub);
    if (in_script_) altered_.try_emplace({index, sub});
  }
  void terminals(std::uint16_t index, std::uint8_t sub, std::int32_t before, std::int32_t after,
                 Time now) override {
    node_.terminals(index, sub, before, after, now);
  }
  void tell(std::string_view text, Time now) override { node_.tell(text, now); }
  std::string inject(std::string_view fault, Time now) override { return node_.inject(fault, now); }

  /// Called again by the first TPDO of these, which is sampled after all of them.
  void report(Time now) {
    while (!changed_.empty()) {
      const Object object = changed_.back();
      changed_.pop_back();
      if (is_news(object)) node_.changed(object.first, object.second, now);
    }
  }

  /// What the device sets and the script alters again and again has changed only if the result has.
  bool is_news(const Object& object) {
    const auto altered = altered_.find(object);
    if (altered == altered_.end()) return true;
    const std::uint64_t value = node_.dictionary().get(object.first, object.second);
    return std::exchange(altered->second, value) != value;
  }

  sim::DeviceNode& node_;
  std::unique_ptr<sim::Behaviour> below_;
  std::unique_ptr<LuaBehaviour> script_;
  std::vector<Object> changed_;
  std::map<Object, std::optional<std::uint64_t>> altered_;  ///< by the script, and the value reported last
  Time due_ = kNever;
  bool in_script_ = false;
  bool reporting_ = false;
};

}  // namespace

std::unique_ptr<sim::Behaviour> make_beside(sim::DeviceNode& node, std::uint64_t seed,
                                            const std::string& name, const std::string& script,
                                            const sim::BehaviourMaker& below) {
  return std::make_unique<Beside>(node, seed, name, script, below);
}

}  // namespace cbcan::devices
