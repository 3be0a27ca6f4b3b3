// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace cbcan::test {

/// The message of the exception that `act` throws; "" = none.
template <class Error, class Act>
std::string complaint_of(Act act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace cbcan::test
