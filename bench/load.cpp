// SPDX-License-Identifier: MIT
// A number of Modbus TCP clients, each with a thread and one transaction in progress: FC 16 of R3700..R3709,
// then FC 3 of R3700 until that is no longer CA0Eh.
#include <modbus.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>

#include "bench.hpp"
#include "cbcan/regmap.hpp"

namespace cbcan::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kWords = 10;  ///< R3700..R3709

/// What all clients share.
struct Load {
  int port;
  std::array<std::uint16_t, kWords> request;
  std::atomic<long> left;  ///< transactions that have not begun
  std::atomic<unsigned> polls{0};
};

struct Client {
  void run(Load& load) {
    const std::unique_ptr<modbus_t, void (*)(modbus_t*)> modbus(modbus_new_tcp("127.0.0.1", load.port),
                                                                modbus_free);
    if (modbus_connect(modbus.get()) != 0) return fail(modbus_strerror(errno));
    while (error.empty() && load.left-- > 0) {
      const auto started = Clock::now();
      execute(modbus.get(), load);
      took.push_back(Clock::now() - started);
    }
    modbus_close(modbus.get());
  }
  void execute(modbus_t* modbus, Load& load) {
    std::uint16_t flag = regmap::kExecute;
    if (modbus_write_registers(modbus, regmap::kExecuteFlag, kWords, load.request.data()) < 0)
      return fail(modbus_strerror(errno));
    for (; flag == regmap::kExecute; ++load.polls)
      if (modbus_read_registers(modbus, regmap::kExecuteFlag, 1, &flag) < 0)
        return fail(modbus_strerror(errno));
    if (flag != static_cast<std::uint16_t>(regmap::Result::kOk)) fail("a transaction has failed");
  }
  void fail(const char* why) { error = why; }

  std::vector<Clock::duration> took;
  std::string error;
};

double percentile(std::vector<Clock::duration>& all, std::size_t percent) {
  const auto place = all.begin() + static_cast<std::ptrdiff_t>(all.size() * percent / 100);
  std::nth_element(all.begin(), place, all.end());
  return std::chrono::duration<double, std::micro>(*place).count();
}

}  // namespace

void load(const Arguments& arguments) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(arguments.number(at, 0, 0, 0xFFFF));
  };
  const unsigned transactions = arguments.number(2, 0, 1);
  Load load{word(0), {regmap::kExecute, regmap::kSdoRead, word(3), word(4), 0, word(5)}, transactions};
  std::vector<Client> clients(arguments.number(1, 0, 1, 0xFFFF));
  const auto began = Clock::now();
  {
    std::vector<std::jthread> threads;
    for (Client& client : clients)
      threads.emplace_back([&] { client.run(load); });
  }
  const std::chrono::duration<double> took = Clock::now() - began;
  std::vector<Clock::duration> all;
  for (const Client& client : clients) {
    require(client.error.empty(), client.error);
    all.insert(all.end(), client.took.begin(), client.took.end());
  }
  std::printf("%.0f transactions a second, median %.1f us, 99 %% within %.1f us; %u polls\n",
              transactions / took.count(), percentile(all, 50), percentile(all, 99),
              load.polls - transactions);
}

}  // namespace cbcan::bench
