// SPDX-License-Identifier: MIT
// The suite's target "sim": a cbcan-sim process for each case, with Modbus TCP (libmodbus) for the PLC, an
// SLCAN adapter for the bus, and a clock controlled by the suite. There are no races: cbcan-sim has one
// thread, and all effects of a request, a frame or a `pass` are complete before it handles the next one, on
// any connection.

#include <modbus.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <thread>

#include "contract/remote/slcan_bus.hpp"
#include "contract/target.hpp"

namespace cbcan::contract {

namespace {

std::string in_ms(Duration duration) {
  return std::to_string(duration / 1ms);
}

/// The number after "modbus=127.0.0.1:" or "slcan=127.0.0.1:".
std::uint16_t port_in(const std::string& ready, const std::string& service) {
  const std::string begin = service + "=127.0.0.1:";
  const std::size_t at = ready.find(begin);
  if (at == std::string::npos) throw std::runtime_error("no " + begin + " in: " + ready);
  return static_cast<std::uint16_t>(std::stoul(ready.substr(at + begin.size())));
}

/// A PLC's connection.
struct Plc {
  explicit Plc(std::uint16_t port) : modbus_(modbus_new_tcp("127.0.0.1", port)) {
    constexpr std::uint32_t kPatienceSeconds = 60;
    if (modbus_ != nullptr) modbus_set_response_timeout(modbus_, kPatienceSeconds, 0);
    if (modbus_ == nullptr || modbus_connect(modbus_) != 0) fail("connect");
  }
  ~Plc() {
    modbus_close(modbus_);
    modbus_free(modbus_);
  }
  Plc(const Plc&) = delete;
  Plc& operator=(const Plc&) = delete;

  void write(unsigned first, const Words& words) {
    const int count = static_cast<int>(words.size());
    if (modbus_write_registers(modbus_, static_cast<int>(first), count, words.data()) != count) fail("write");
  }
  Words read(unsigned first, std::size_t count) {
    Words words(count);
    const int wanted = static_cast<int>(count);
    if (modbus_read_registers(modbus_, static_cast<int>(first), wanted, words.data()) != wanted) fail("read");
    return words;
  }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) {
    Words seen(count);
    const int wanted = static_cast<int>(count);
    if (modbus_write_and_read_registers(modbus_, static_cast<int>(to), static_cast<int>(words.size()),
                                        words.data(), static_cast<int>(from), wanted, seen.data()) != wanted)
      fail("write and read");
    return seen;
  }

 private:
  [[noreturn]] static void fail(const std::string& what) {
    throw std::runtime_error("Modbus " + what + ": " + modbus_strerror(errno));
  }

  modbus_t* modbus_;
};

std::vector<std::string> command(const Settings& settings) {
  const bool channels = settings.scanner_out_first == 500 && settings.process_first == 3800;
  const char* const other = std::getenv("CBCAN_SIM");
  std::vector<std::string> words{other != nullptr ? other : CBCAN_SIM,
                                 "--clock",
                                 "manual",
                                 "--modbus",
                                 "127.0.0.1:0",
                                 "--slcan",
                                 "127.0.0.1:0"};
  for (const std::string& setting :
       {"node_state_fresh_ms=" + in_ms(settings.state_fresh_for),
        "guarding_timeout_ms=" + in_ms(settings.guard_timeout),
        "process_first=" + std::to_string(settings.process_first),
        "scanner_out_first=" + std::to_string(settings.scanner_out_first),
        "scanner_in_first=" + std::to_string(settings.scanner_in_first),
        std::string("channels=") + (channels ? "16" : "1"), "plc_timeout_ms=" + in_ms(settings.plc_timeout),
        std::string("plc_lost_state=") + (settings.plc_lost_stopped ? "stopped" : "pre-operational")}) {
    words.push_back("--set");
    words.push_back("module." + setting);
  }
  if (settings.further_first != 0) {
    const std::string file =
        std::filesystem::temp_directory_path() / ("cbcan" + std::to_string(getpid()) + ".toml");
    std::ofstream(file) << "network.further_first = " << settings.further_first << '\n';
    words.insert(words.end(), {"--network-file", file});
  }
  return words;
}

struct SimTarget final : Target {
  explicit SimTarget(const Settings& settings)
      : simulator_(command(settings)),
        ready_(simulator_.hear()),
        plc_(port_in(ready_, "modbus")),
        bus_(port_in(ready_, "slcan")) {}

  std::string lacks(Ability ability) const override {
    switch (ability) {
      case Ability::kRefusal:
        return "cbcan-sim's virtual bus takes every frame, and has no option to refuse one";
      case Ability::kBusState:
      case Ability::kSecondReader:
      case Ability::kSecondClient:
      case Ability::kChannels:
      case Ability::kMorePdos:
      case Ability::kBlock:
      case Ability::kSettings: return "";
    }
    return "unknown";
  }

  void write(unsigned first, const Words& words) override { plc_.write(first, words); }
  Words read(unsigned first, std::size_t count) override { return plc_.read(first, count); }
  Words write_and_read(unsigned to, const Words& words, unsigned from, std::size_t count) override {
    return plc_.write_and_read(to, words, from, count);
  }

  Words read_as_another(unsigned first, std::size_t count) override {
    if (!other_) other_.emplace(port_in(ready_, "modbus"));
    return other_->read(first, count);
  }

  std::string next_frame() override {
    std::string frame = bus_.take();
    if (!frame.empty()) return frame;
    bus_.settle();
    return bus_.take();
  }
  void arrive(const std::string& frame) override { bus_.send(frame); }

  void pass(Duration duration) override {
    now_ += duration;
    tell("pass " + std::to_string(duration.count()) + "us", at(now_));
  }
  Duration precision() const override { return 1us; }

  void set_bus_state(BusState state) override {
    tell("clear bus", "ok");
    if (state == BusState::kActive) return;
    const char* const kinds[] = {"", "overflow", "error-passive", "bus-off"};
    tell(std::string("fault bus ") + kinds[static_cast<std::size_t>(state)],
         "ok " + std::to_string(++bus_faults_));
  }

  Words first_done(const std::function<void()>& ending) override {
    Plc second(port_in(ready_, "modbus"));
    std::atomic<bool> ended = false;
    Words seen;
    std::thread reader([&] { seen = read_until_done(second, ended); });
    ending();
    ended = true;
    reader.join();
    return seen;
  }

 private:
  void tell(const std::string& command, const std::string& expected) {
    simulator_.say(command);
    const std::string response = simulator_.hear();
    if (response != expected)
      throw std::runtime_error(command + ": \"" + response + "\" instead of \"" + expected + "\"");
  }

  static std::string at(Duration now) {
    const std::string fraction = std::to_string(now % 1s / 1us);
    return "at " + std::to_string(now / 1s) + "." + std::string(6 - fraction.size(), '0') + fraction;
  }

  /// At least once after the end.
  static Words read_until_done(Plc& plc, const std::atomic<bool>& ended) {
    constexpr std::uint16_t kExecute = 0xCA0E;
    for (bool last = false; !last;) {
      last = ended;
      const Words words = plc.read(3700, 70);
      if (words[0] != kExecute) return words;
    }
    return {};
  }

  Child simulator_;
  std::string ready_;
  Plc plc_;
  std::optional<Plc> other_;
  SlcanBus bus_;
  Duration now_{0};
  unsigned bus_faults_ = 0;
};

}  // namespace

std::unique_ptr<Target> make_target(const Settings& settings) {
  return std::make_unique<SimTarget>(settings);
}

}  // namespace cbcan::contract
