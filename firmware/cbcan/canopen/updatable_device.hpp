// SPDX-License-Identifier: MIT
#pragma once

/// An EdsDeviceOf whose EDS file has 1F50h, 1F51h, 1F56h and 1F57h, sub-index 1: its program can be replaced
/// over CAN (program_download.hpp). For a boot loader and for the programs that it starts.

#include "cbcan/canopen/eds_device.hpp"
#include "cbcan/canopen/program_download.hpp"

namespace cbcan {

template <const EdsDictionary& kDictionary, class Memory>
class UpdatableDevice : public EdsDeviceOf<kDictionary> {
  using Base = EdsDeviceOf<kDictionary>;

 public:
  /// `runs`: this is the program, not its boot loader. All outlive it.
  UpdatableDevice(CanPort& port, Memory& memory, bool runs) : Base(port), download_(memory, runs) {
    this->device().slave().sdo_server().set_stream(download_);
  }

  Time poll(Time now) {
    const Time due = Base::poll(now);
    return earlier(due, download_.poll(now));
  }

 protected:
  ~UpdatableDevice() = default;

  AbortCode on_read(const ObjectEntry& entry, std::uint8_t sub, std::span<std::uint8_t> out,
                    std::size_t& size, Time now) override {
    if (sub == 0 || !is_program_number(entry.index)) return Base::on_read(entry, sub, out, size, now);
    size = entry.capacity;
    return download_.on_read(entry.index, out.first(size));
  }
  AbortCode on_write(const ObjectEntry& entry, std::uint8_t sub, std::span<const std::uint8_t> value,
                     Time now) override {
    if (entry.index != object::kProgramControl) return Base::on_write(entry, sub, value, now);
    return download_.on_write(value[0], now);
  }

 private:
  ProgramDownload<Memory> download_;
};

}  // namespace cbcan
