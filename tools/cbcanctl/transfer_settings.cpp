// SPDX-License-Identifier: MIT
#include "cbcanctl/transfer_settings.hpp"

namespace cbcan::ctl {

Borrowed::Borrowed(window::Client& client, std::uint16_t index, const tools::Bytes& value)
    : client_(client), index_(index), before_(own::read(client, index, 0, value.size())) {
  if (before_ == value) return;
  changed_ = true;
  try {
    own::write(client, index, value);
  } catch (const Refused&) {
    changed_ = false;
    throw;
  } catch (...) {
    put_back();  // a cancelled write may have been carried out
    throw;
  }
}

void Borrowed::put_back() noexcept {
  if (!changed_) return;
  changed_ = false;
  forget_interrupt();
  try {
    own::write(client_, index_, before_);
  } catch (const std::exception& error) {
    say(own::name(index_) + " was " + tools::print_value(before_) +
        " and could not be restored: " + error.what());
  }
}

tools::Bytes with_settings(window::Client& client, const Options& options,
                           const tools::Transaction& transfer) {
  const bool asked = options.timeout_ms != 0 || options.mode;
  // The own node's objects are not read by SDO, and 3003h and 3004h should be shown unchanged.
  if (!asked || transfer.node == 0 || transfer.node == own::read(client, own::kOwnNodeId, 0, 1)[0])
    return execute(client, transfer);
  std::optional<Borrowed> timeout;
  std::optional<Borrowed> mode;
  if (options.timeout_ms != 0)
    timeout.emplace(client, own::kSdoTimeout,
                    descriptions::to_bytes(static_cast<unsigned>(options.timeout_ms), 2));
  if (options.mode)
    mode.emplace(client, own::kTransferMode, tools::Bytes{static_cast<std::uint8_t>(*options.mode)});
  return execute(client, transfer);
}

}  // namespace cbcan::ctl
