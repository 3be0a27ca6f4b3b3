// SPDX-License-Identifier: MIT
#include "cia405/plant.hpp"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace cbcan::cia405::test {

namespace {

std::string new_file() {
  std::string name = "/tmp/cbcan-cia405-XXXXXX";
  const int file = mkstemp(name.data());
  if (file < 0) throw std::runtime_error("no temporary file");
  close(file);
  return name;
}

int port_in(const std::string& ready) {
  const std::string begin = "modbus=127.0.0.1:";
  const std::size_t at = ready.find(begin);
  if (at == std::string::npos) throw std::runtime_error("no " + begin + " in: " + ready);
  return std::stoi(ready.substr(at + begin.size()));
}

}  // namespace

Plant::Plant(int port)
    : log_(new_file()),
      simulator_({CBCAN_SIM, "--clock", "manual", "--modbus", "127.0.0.1:" + std::to_string(port), "--log",
                  log_, "--node", "5=" CBCAN_PLANTS "/demo/generic.eds"}),
      port_(port_in(simulator_.hear())) {}

Plant::~Plant() {
  unlink(log_.c_str());
}

void Plant::pass(Time time) {
  simulator_.say("pass " + std::to_string(time) + "us");
  simulator_.hear();
  now_ += time;
}

std::vector<std::string> Plant::frames(const std::string& begin) {
  pass(0);  // received frames are processed, and the log is written
  std::ifstream file(log_);
  std::vector<std::string> frames;
  std::string time, interface, frame;
  while (file >> time >> interface >> frame)
    if (frame.starts_with(begin)) frames.push_back(frame);
  return frames;
}

Program::Program(int port) : link({.port = port}) {}

void Program::cycle(Time now) {
  wait_for(link);
  link.poll(now);
  for (FunctionBlock* block : blocks)
    block->call(now);
}

void wait_for(const Link& link) {
  if (link.events() == 0) return;
  pollfd wanted{link.descriptor(), link.events(), 0};
  constexpr int kPatienceMs = 60'000;
  if (poll(&wanted, 1, kPatienceMs) != 1)
    throw std::runtime_error("the server has said nothing for a minute");
}

}  // namespace cbcan::cia405::test
