// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fuzz/modbus_model.hpp"

namespace cbcan::fuzz {

/// What a Modbus RTU server has to do with bytes at times, written down once more (MODBUS over Serial Line
/// V1.02; modbus/rtu_server.hpp where that leaves a choice): it looks at all bytes of a frame each time, and
/// its times never wrap. What is answered is up to the model of the TCP server.
struct RtuModel {
  using Bytes = ModbusModel::Bytes;
  using View = ModbusModel::View;

  struct Settings {
    std::uint8_t station;
    std::uint64_t silence_us;
    std::uint64_t gap_us;
    std::uint64_t response_delay_us;
    std::size_t read_only_first;
    std::size_t read_only_count;
    std::size_t missing_count;  ///< registers behind the read-only ones that there are not
  };
  struct Counts {
    std::uint32_t frames, crc_errors, exceptions, executed, unanswered, foreign, broken, ignored;
  };

  RtuModel(const Settings& settings, std::vector<std::uint16_t> at_start)
      : settings_(settings), hopeless_(exact()), application_(std::move(at_start)) {}

  void receive(std::uint8_t byte, std::uint64_t now_us);
  /// One with a parity or framing error.
  void receive_broken(std::uint64_t now_us);
  /// How long until it executes the request that waits; 0 = now, nothing = there is none.
  std::optional<std::uint64_t> wait(std::uint64_t now_us) const;
  /// Executes it; the frame to send; empty = none.
  Bytes execute();
  void sent();

  const std::vector<std::uint16_t>& registers() const { return application_.registers; }
  const Counts& counts() const { return counts_; }

 private:
  enum class Busy { kNo, kRequest, kSending };
  /// What is known of the next frame of another station.
  enum class Turn { kUnknown, kMaster, kStation };
  struct Size;

  bool exact() const { return settings_.gap_us <= settings_.silence_us; }
  bool ours() const { return frame_[0] == settings_.station || frame_[0] == 0; }
  bool responses_turn() const;
  bool may_be_request() const;
  bool may_be_response() const;
  Size size() const;
  bool hears(std::uint64_t now_us);
  void end_by_gap();
  void look();
  void end_of_foreign();
  void lose(std::uint32_t& count);
  bool touches_others_registers(View pdu) const;
  Bytes response_to(View pdu);

  Settings settings_;
  bool hopeless_;  ///< nothing but a gap begins a frame
  ModbusModel application_;
  Counts counts_{};
  Bytes frame_;
  bool after_gap_ = true;  ///< the frame began after one
  std::uint64_t last_us_ = 0;
  Busy busy_ = Busy::kNo;
  std::size_t unheard_ = 0;   ///< bytes while sending
  std::size_t response_ = 0;  ///< bytes that are being sent
  Turn turn_ = Turn::kUnknown;
  std::uint8_t asked_station_ = 0;
  std::uint8_t asked_function_ = 0;
};

/// `bytes` and their CRC.
RtuModel::Bytes with_crc(RtuModel::View bytes);

}  // namespace cbcan::fuzz
