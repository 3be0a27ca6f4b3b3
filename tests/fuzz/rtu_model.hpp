// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "fuzz/modbus_model.hpp"

namespace cbcan::fuzz {

/// What a Modbus RTU server has to do with bytes at times, written down once more (MODBUS over Serial Line
/// V1.02; modbus/rtu_server.hpp where that leaves a choice): it looks at all bytes of a frame each time, and
/// its times never wrap. What is answered is up to the model of the TCP server.
class RtuModel {
 public:
  using Bytes = ModbusModel::Bytes;
  using View = ModbusModel::View;

  struct Settings {
    std::uint8_t station;
    std::uint64_t gap_us;
    std::size_t read_only_first;
    std::size_t read_only_count;
  };
  struct Counts {
    std::uint32_t frames, crc_errors, exceptions, executed, unanswered, foreign, broken, ignored;
  };

  RtuModel(const Settings& settings, std::vector<std::uint16_t> at_start)
      : settings_(settings), application_(std::move(at_start)) {}

  void receive(std::uint8_t byte, std::uint64_t now_us);
  /// The frame to send; empty = none.
  Bytes poll();
  void sent();

  const std::vector<std::uint16_t>& registers() const { return application_.registers; }
  const Counts& counts() const { return counts_; }

 private:
  enum class Busy { kNo, kRequest, kSending };
  enum class Verdict { kMore, kRight, kWrong, kTooLong };

  Verdict look() const;
  bool ours() const { return frame_[0] == settings_.station || frame_[0] == 0; }
  bool touches_read_only(View pdu) const;
  Bytes answer_to(View pdu);

  Settings settings_;
  ModbusModel application_;
  Counts counts_{};
  Bytes frame_;
  std::uint64_t last_us_ = 0;
  Busy busy_ = Busy::kNo;
  bool hopeless_ = false;  ///< nothing but a gap begins a frame
};

/// `bytes` and their CRC.
RtuModel::Bytes with_crc(RtuModel::View bytes);

}  // namespace cbcan::fuzz
