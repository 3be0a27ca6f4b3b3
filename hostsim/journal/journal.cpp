// SPDX-License-Identifier: MIT
#include "journal/journal.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/buffer.hpp"

namespace cbcan::journal {

/// Bytes that do not fit at the end of the ring begin at its front again: they are never in two pieces.
Event& Journal::add(Event event, std::initializer_list<std::span<const std::uint8_t>> parts) {
  if (end_ % (size_ / 2) == 0) on_filled();
  std::size_t size = 0;
  for (const auto& part : parts)
    size += part.size();
  if (used_ % bytes_size_ + size > bytes_size_) used_ += bytes_size_ - used_ % bytes_size_;
  std::uint8_t* to = bytes_.get() + used_ % bytes_size_;
  for (const auto& part : parts)
    to = std::copy_n(part.data(), part.size(), to);
  event.bytes = std::exchange(used_, used_ + size);
  event.size = static_cast<std::uint16_t>(size);
  latest_[static_cast<std::size_t>(event.kind)] = end_;
  const std::size_t place = end_++ % size_;
  return place == ring_.size() ? ring_.emplace_back(event) : ring_[place] = event;
}

Event& Journal::add(const Event& event, std::string_view text) {
  return add(event, {{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}});
}

std::uint64_t Journal::latest_of(Kinds kinds) const {
  if (kinds == kAllKinds) return end_ - 1;
  std::uint64_t latest = 0;
  for (; kinds != 0; kinds &= kinds - 1)
    latest = std::max(latest, latest_[static_cast<std::size_t>(std::countr_zero(kinds))]);
  return latest;
}

std::string_view Journal::text(const Event& event) const {
  return base::characters(bytes(event));
}

}  // namespace cbcan::journal
