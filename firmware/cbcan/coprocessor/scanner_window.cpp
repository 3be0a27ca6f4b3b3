// SPDX-License-Identifier: MIT
#include "cbcan/coprocessor/scanner_window.hpp"

#include <algorithm>
#include <atomic>

namespace cbcan {

namespace {

constexpr std::size_t kHeadWords = regmap::kData - regmap::kWindowFirst;
/// SDO abort code of a request that the PLC has cancelled: 0800 0000h, low word first.
constexpr std::uint16_t kCancelledLow = 0x0000;
constexpr std::uint16_t kCancelledHigh = 0x0800;

}  // namespace

void ScannerWindow::restart() {
  if (!kServices.scanner_window || in_ == nullptr) return;
  std::fill_n(in_, regmap::kScannerInWords, std::uint16_t{0});
  in_[regmap::kScannerResult] = static_cast<std::uint16_t>(regmap::Result::kRestarted);
  taken_ = 0;
  state_ = State::kIdle;
  restarted_ = true;
}

bool ScannerWindow::on_written(std::size_t first, std::size_t count) {
  if (!kServices.scanner_window || in_ == nullptr) return false;
  const std::uint16_t number = out_[regmap::kScannerNumber];
  const bool numbered = first == regmap::kScannerNumber;
  if (numbered && number == 0) return cancel();
  if (numbered && number != taken_) return take(number, count);
  // A request may be written again until its turn comes, but only completely.
  const std::size_t needed = words_needed();
  if (waiting() && first < needed && (!numbered || count < needed)) finish(regmap::Result::kIncomplete);
  return false;
}

bool ScannerWindow::take(std::uint16_t number, std::size_t count) {
  const bool under_way = state_ == State::kUnderWay;
  taken_ = number;
  in_[regmap::kScannerTaken] = number;
  if (restarted_ || count < words_needed()) {
    finish(restarted_ ? regmap::Result::kRestarted : regmap::Result::kIncomplete);
    restarted_ = false;
    return under_way;
  }
  state_ = State::kWaiting;
  return true;
}

bool ScannerWindow::cancel() {
  if (state_ == State::kIdle) return false;
  const bool under_way = state_ == State::kUnderWay;
  data()[0] = kCancelledLow;
  data()[1] = kCancelledHigh;
  finish(regmap::Result::kSdoExecutionError);
  return under_way;
}

/// Words that this request consists of; other errors are not checked here.
std::size_t ScannerWindow::words_needed() const {
  if (out_[regmap::kCommand - regmap::kWindowFirst] != regmap::kSdoWrite) return kHeadWords;
  if (out_[regmap::kObjectIndex - regmap::kWindowFirst] == regmap::kNmtService) return kHeadWords + 1;
  const std::size_t size = out_[regmap::kDataSize - regmap::kWindowFirst];
  return size > regmap::kMaxDataBytes ? kHeadWords : kHeadWords + (size + 1) / 2;
}

void ScannerWindow::finish(regmap::Result result, std::size_t size) {
  state_ = State::kIdle;
  in_[regmap::kScannerSize] = static_cast<std::uint16_t>(size);
  in_[regmap::kScannerResult] = static_cast<std::uint16_t>(result);
  std::atomic_ref<std::uint16_t>(in_[regmap::kScannerAnswered]).store(taken_, std::memory_order_release);
}

}  // namespace cbcan
