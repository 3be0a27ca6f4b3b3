// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "cli/command_line.hpp"
#include "config/eds_file.hpp"
#include "explore/exploration.hpp"
#include "io/loop/descriptor.hpp"

namespace cbcan::app {

/// Runs the command, each time with its plant in a process of its own. Throws io::EnvironmentError.
class Processes final : public explore::Runner {
 public:
  Processes(const cli::Start& start, config::EdsFiles& files, const explore::Settings& settings)
      : start_(start), files_(files), settings_(settings) {}

  void all(std::size_t count, const std::function<explore::Run(std::size_t)>& make,
           const std::function<bool()>& wanted,
           const std::function<void(std::size_t, const explore::Told&)>& ended) override;

 private:
  struct Process {
    pid_t id;
    io::Descriptor end;
    std::size_t number;
    Time begun;
    std::string text{};
  };

  void begin(std::size_t number, const explore::Run& run);
  [[noreturn]] void be(const explore::Run& run, int to);
  explore::Told run_here(const explore::Run& run);
  void wait(const std::function<void(std::size_t, const explore::Told&)>& ended);

  const cli::Start& start_;
  config::EdsFiles& files_;
  const explore::Settings& settings_;
  std::vector<Process> processes_;
};

}  // namespace cbcan::app
