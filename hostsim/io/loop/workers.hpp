// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace cbcan::io {

/// Calls `work` for each number below `count` in `processes` copies of this process, each number once, and
/// `done` with what it returned, here, in the order in which they end. A process that dies takes its rest
/// with it: `lost` says what those have come to. With one process everything happens here. Throws
/// EnvironmentError when there can be no process more.
void work_in_processes(std::size_t count, std::size_t processes,
                       const std::function<std::string(std::size_t number)>& work,
                       const std::function<void(std::size_t number, std::string result)>& done,
                       const std::function<std::string()>& lost);

}  // namespace cbcan::io
