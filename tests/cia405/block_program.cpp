// SPDX-License-Identifier: MIT
// A program whose blocks and inputs scenarios_test.py controls, by lines on standard input. Only `cycle` is
// answered, with a line of members for each block.
//
//   new BLOCK              adds a block, which each cycle calls from then on
//   set N MEMBER [VALUE]   of the N-th block; bytes are written in hexadecimal
//   clear                  removes all blocks
//   cycle TIME
//
// usage: cia405_block_program PORT

#include <algorithm>
#include <deque>
#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "base/text.hpp"
#include "cia405/plant.hpp"
#include "io/bytes.hpp"

namespace cbcan::cia405::test {

namespace {

template <typename Member>
void assign(Member& member, const std::string& value) {
  static std::deque<io::test::Bytes> buffers;  // of the program, which outlive its blocks
  if constexpr (std::is_same_v<Member, EmcyError>)
    throw std::runtime_error("an output");
  else if constexpr (std::is_same_v<Member, std::array<std::uint8_t, 4>>)
    std::ranges::copy(io::test::hex(value), member.begin());
  else if constexpr (requires { member.data(); })
    member = buffers.emplace_back(io::test::hex(value));
  else
    member = static_cast<Member>(std::stoull(value));
}

/// An EMCY message as it was on the bus.
template <typename Member>
std::string text(const Member& member) {
  if constexpr (std::is_same_v<Member, EmcyError>) {
    return base::hex(member.error_code & 0xFFu, 2) + base::hex(member.error_code >> 8, 2) +
           base::hex(member.error_register, 2) + base::hex(member.error_field, "");
  } else if constexpr (requires { member.data(); })
    return base::hex(member, "");
  else
    return std::to_string(static_cast<std::uint64_t>(member));
}

struct Member {
  std::string name;
  std::function<std::string()> text;
  std::function<void(const std::string&)> assign;
};

/// A block with named members.
struct Named {
  std::shared_ptr<FunctionBlock> block;
  std::vector<Member> members{};

  void set(const std::string& name, const std::string& value) {
    for (const Member& member : members)
      if (member.name == name) member.assign(value);
  }
};

template <typename Block>
Named make(Link& link) {
  const auto block = std::make_shared<Block>(link);
  Named named{block};
  const auto add = [&named](const char* name, auto& member) {
    named.members.push_back({name, [&member] { return text(member); },
                             [&member](const std::string& value) { assign(member, value); }});
  };
  add("ENABLE", block->enable);
  add("TIMEOUT", block->timeout);
  add("NETWORK", block->network);
  add("CONFIRM", block->confirm);
  add("ERROR", block->error);
  if constexpr (requires { block->device; }) add("DEVICE", block->device);
  if constexpr (requires { block->state; }) add("STATE", block->state);
  if constexpr (requires { block->errorinfo; }) add("ERRORINFO", block->errorinfo);
  if constexpr (requires { block->channel; }) add("CHANNEL", block->channel);
  if constexpr (requires { block->index; }) add("INDEX", block->index);
  if constexpr (requires { block->subindex; }) add("SUBINDEX", block->subindex);
  if constexpr (requires { block->mode; }) add("MODE", block->mode);
  if constexpr (requires { block->data; }) add("DATA", block->data);
  if constexpr (requires { block->datalength; }) add("DATALENGTH", block->datalength);
  return named;
}

const std::map<std::string, Named (*)(Link&)> kBlocks{
    {"NMT", make<Nmt>},
    {"RECV_EMCY", make<RecvEmcy>},
    {"RECV_EMCY_DEV", make<RecvEmcyDev>},
    {"GET_LOCAL_NODE_ID", make<GetLocalNodeId>},
    {"GET_CANOPEN_KERNEL_STATE", make<GetCanopenKernelState>},
    {"GET_STATE", make<GetState>},
    {"SDO_READ", make<SdoRead>},
    {"SDO_READ4", make<SdoRead4>},
    {"SDO_WRITE", make<SdoWrite>},
    {"SDO_WRITE4", make<SdoWrite4>}};

void serve(int port) {
  Program program(port);
  std::vector<Named> blocks;
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string what, first, member, value;
    words >> what >> first >> member >> value;
    if (what == "new") {
      blocks.push_back(kBlocks.at(first)(program.link));
      program.blocks.push_back(blocks.back().block.get());
    } else if (what == "set") {
      blocks.at(std::stoul(first)).set(member, value);
    } else if (what == "clear") {
      program.blocks.clear();
      blocks.clear();
    } else {
      program.cycle(std::stoll(first));
      for (const Named& block : blocks) {
        for (const Member& each : block.members)
          std::cout << each.name << "=" << each.text() << " ";
        std::cout << std::endl;
      }
    }
  }
}

}  // namespace

}  // namespace cbcan::cia405::test

int main(int /*argc*/, char** argv) {
  cbcan::cia405::test::serve(std::stoi(argv[1]));
}
