// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "cbcanctl/commands.hpp"
#include "cbcanctl/http_client.hpp"
#include "text/address.hpp"

namespace cbcan::ctl {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kReset = "\033[0m";

text::ListenAddress server_of(const Options& options) {
  const char* const environment = std::getenv("CBCAN_HTTP");
  const std::string address = !options.http.empty()    ? options.http
                              : environment != nullptr ? environment
                                                       : "";
  const auto server = text::parse_listen_address(address.empty() ? "127.0.0.1" : address, 0);
  if (server.port == 0) throw tools::UsageError("--http HOST:PORT is missing: where cbcan-sim --http serves");
  return server;
}

std::string query_of(const Options& options) {
  std::string query = "?kinds=" + (options.kinds == "all" ? "" : options.kinds);
  const auto add = [&query](std::string_view key, const std::string& value) {
    if (!value.empty()) query += fmt::format("&{}={}", key, value);
  };
  add("node", options.node);
  add("service", options.service);
  add("failed", options.failed ? "1" : "");
  add("slow", options.slow_ms < 0 ? "" : std::to_string(options.slow_ms));
  return query;
}

std::string_view color_of(const Json& event) {
  const std::string kind = event.value("kind", "");
  if (kind == "ended") return event.value("ok", false) ? "\033[32m" : "\033[31m";
  if (kind == "fault" || kind == "emcy") return "\033[33m";
  return kind == "frame" || kind == "modbus" ? "\033[2m" : "";
}

class Statistics {
 public:
  void add(const Json& event) {
    ++kinds_[event.value("kind", "")];
    if (event.value("kind", "") != "ended") return;
    const double took = event.value("took_ms", 0.0);
    if (!event.value("ok", false)) ++failed_;
    sum_ += took;
    slowest_ = std::max(slowest_, took);
  }

  /// `before` and `after`: /api/time.
  Json json(const Json& before, const Json& after) const {
    const double passed = after.value("time", 0.0) - before.value("time", 0.0);
    const std::uint64_t ended = kinds_.contains("ended") ? kinds_.at("ended") : 0;
    Json result{{"kind", "statistics"}, {"seconds", passed}, {"events", kinds_}};
    result["transactions"] = {{"ended", ended},
                              {"failed", failed_},
                              {"mean_ms", ended == 0 ? 0 : sum_ / static_cast<double>(ended)},
                              {"slowest_ms", slowest_}};
    Json& networks = result["networks"] = Json::array();
    for (std::size_t i = 0; passed > 0 && i < after["networks"].size(); ++i) {
      const Json& now = after["networks"][i];
      const Json& then = before["networks"][i];
      const double bits = now.value("bits", 0.0) - then.value("bits", 0.0);
      const double rate = now.value("bit_rate", 0.0);
      networks.push_back(
          {{"network", i + 1},
           {"frames_per_second", (now.value("frames", 0.0) - then.value("frames", 0.0)) / passed},
           {"bits_per_second", bits / passed}});
      if (rate > 0) networks.back()["load_percent"] = 100 * bits / passed / rate;
    }
    return result;
  }

 private:
  std::map<std::string, std::uint64_t> kinds_;
  std::uint64_t failed_ = 0;
  double sum_ = 0;
  double slowest_ = 0;
};

std::string statistics_text(const Json& statistics) {
  const Json& transactions = statistics["transactions"];
  std::string text = fmt::format("{:.3f} s; transactions {}, failed {}, mean {:.3f} ms, slowest {:.3f} ms\n",
                                 statistics["seconds"].get<double>(), transactions["ended"].get<int>(),
                                 transactions["failed"].get<int>(), transactions["mean_ms"].get<double>(),
                                 transactions["slowest_ms"].get<double>());
  for (const Json& network : statistics["networks"])
    text += fmt::format("network {}: {:.1f} frames/s, {:.0f} bit/s{}\n", network["network"].get<int>(),
                        network["frames_per_second"].get<double>(), network["bits_per_second"].get<double>(),
                        network.contains("load_percent")
                            ? fmt::format(", bus load {:.1f} %", network["load_percent"].get<double>())
                            : "");
  return text;
}

Json get(const text::ListenAddress& server, std::string_view path) {
  return Json::parse(tools::HttpGet(server, path, [] { return false; }).line().value_or(""));
}

}  // namespace

void monitor(const Options& options) {
  constexpr std::string_view kData = "data: ";
  const text::ListenAddress server = server_of(options);
  const bool colored = isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr && !options.json;
  Statistics statistics;
  tools::HttpGet events(server, "/api/events" + query_of(options), interrupted);
  const Json before = get(server, "/api/time");
  int printed = 0;
  while (const auto line = events.line()) {
    if (!line->starts_with(kData)) continue;
    const Json event = Json::parse(line->substr(kData.size()));
    statistics.add(event);
    const std::string_view color = colored ? color_of(event) : "";
    if (options.json)
      std::cout << line->substr(kData.size()) << std::endl;
    else
      std::cout << color
                << fmt::format("{:.6f} {}", event.value("time", 0.0), event.value("text", event.dump()))
                << (color.empty() ? "" : kReset) << std::endl;
    if (++printed == options.count) break;
  }
  const Json result = statistics.json(before, get(server, "/api/time"));
  std::cout << (options.json ? result.dump() + "\n" : statistics_text(result)) << std::flush;
}

}  // namespace cbcan::ctl
