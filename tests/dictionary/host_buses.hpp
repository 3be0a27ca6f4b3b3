// SPDX-License-Identifier: MIT
#pragma once

/// The simulated node of an EDS file; and the device of the header that was made of it, on the host.

#include "base/read_file.hpp"
#include "descriptions/eds_reader.hpp"
#include "dictionary/bus.hpp"
#include "dictionary/stored_device.hpp"
#include "support/world_bench.hpp"

namespace cbcan::test {

constexpr std::uint8_t kNode = 5;

inline descriptions::DictionaryImage image_of(std::size_t file) {
  const std::string path = dictionaries::kFiles[file].path;
  return descriptions::dictionary_image(
      descriptions::read(base::read_file(path).value(), path, kNode).device);
}

class SimulatedBus final : public Bus {
 public:
  Frames power_on(std::size_t file) override {
    bench_.emplace();
    sim::NodeParts parts;
    parts.node_id = kNode;
    parts.image = image_of(file);
    parts.lss = true;
    node_ = &bench_->world.add_node(std::move(parts));
    bench_->start();
    return bench_->heard();
  }
  Frames power_cycle() override {
    node_->set_power(false, bench_->now);
    node_->set_power(true, bench_->now);
    bench_->world.advance(bench_->now);
    return bench_->heard();
  }
  Frames exchange(const std::string& frame) override {
    bench_->send(frame);
    return bench_->heard();
  }
  Frames pass(Time duration) override {
    bench_->pass(duration);
    return bench_->heard();
  }

 private:
  std::optional<WorldBench> bench_;
  sim::Node* node_ = nullptr;
};

class DeviceBus final : public Bus, private CanPort {
 public:
  Frames power_on(std::size_t file) override {
    flash_.clear();
    dictionary_ = dictionaries::kFiles[file].dictionary;
    return power_cycle();
  }
  Frames power_cycle() override {
    device_ = std::make_unique<StoredDevice>(*dictionary_, flash_, static_cast<CanPort&>(*this));
    device_->start(now_);
    return pass(0);
  }
  Frames exchange(const std::string& frame) override {
    device_->device.on_frame(frame_from(frame), now_);
    Frames sent = pass(0);
    const bool saves = frame.starts_with("605#2310") || frame.starts_with("605#2311");
    for (unsigned ms = 0; saves && sent.empty() && ms < 500; ++ms)
      sent = pass(kMillisecond);
    return sent;
  }
  Frames pass(Time duration) override {
    const Time end = now_ + duration;
    unsigned polls = 0;
    for (Time due = device_->device.poll(now_); due <= end; due = device_->device.poll(now_)) {
      REQUIRE(++polls < 100'000);
      now_ = std::max(now_, due);
    }
    now_ = end;
    return std::exchange(sent_, {});
  }

 private:
  bool try_send(const Frame& frame) override {
    sent_.push_back(text_of(frame));
    return true;
  }

  RamFlash flash_;
  const EdsDictionary* dictionary_ = nullptr;
  std::unique_ptr<StoredDevice> device_;
  Frames sent_;
  Time now_ = 0;
};

}  // namespace cbcan::test
