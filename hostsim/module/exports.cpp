// SPDX-License-Identifier: MIT
// The interface of the WebAssembly module: an Instance, and one more for each trial of a search. What a
// function takes is written to in(SIZE) before, what it returns is read from out() and out_size(). Call
// _initialize() once before anything else. After a trap the instance must not be used again.

#include <utility>

#include "module/instance.hpp"

namespace cbcan::module {
namespace {

struct Module {
  Instance instance;
  std::string in;
  std::string out;
  std::map<unsigned, std::unique_ptr<protocols::StreamSession>> connections;
  unsigned last_connection = 0;
};

/// Plants in this memory: the one of the program, and those of trials.
std::map<unsigned, Module> modules;
unsigned current = 0;

Module& here() {
  return modules[current];
}

protocols::StreamSession& connection(unsigned number) {
  return *here().connections.at(number);
}

/// {"service", "peer"}, or {"name", "network"} of a link: the number of the connection; 0 = it is not served.
Json connect(const Json& given) {
  Instance& instance = here().instance;
  auto session = given.contains("network") ? instance.join(given["name"], given["network"])
                                           : instance.connect(given["service"], given["peer"]);
  if (!session) return 0;
  here().connections[++here().last_connection] = std::move(session);
  return here().last_connection;
}

struct Call {
  std::string_view name;
  Json (*run)(const Json& given);
};

/// Calls, documented in instance.hpp.
constexpr Call kCalls[] = {
    {"start",
     [](const Json& given) {
       return here().instance.start(given["arguments"], given["folder"].get<std::string>(),
                                    given["environment"].get<Instance::Environment>());
     }},
    {"serve",
     [](const Json& given) {
       return here().instance.serve(given["places"], given["since_1970"], given["alone"]);
     }},
    {"connect", connect},
    {"lose",
     [](const Json& given) {
       return here().instance.lose(given["name"], given["network"], given["why"]), Json();
     }},
    {"plc", [](const Json& given) { return here().instance.plc(given["network"], given); }},
    {"respond", [](const Json& given) { return here().instance.respond(given); }},
    {"fill", [](const Json& given) { return here().instance.fill(given["stream"]); }},
    {"drop", [](const Json& given) { return here().instance.drop(given["stream"]), Json(); }},
    {"input",
     [](const Json& given) { return here().instance.input(given["line"].get<std::string>()), Json(); }},
    {"input_waits", [](const Json&) { return Json(here().instance.input_waits()); }},
    {"summary", [](const Json&) { return Json(here().instance.summary()); }},
    {"told", [](const Json&) { return here().instance.take_told(); }},
    {"play", [](const Json& given) { return here().instance.play(given["place"]); }},
    {"played", [](const Json&) { return here().instance.played(); }},
    {"search", [](const Json& given) { return here().instance.search(given["passed"], given["most"]); }},
    {"try_here", [](const Json& given) { return here().instance.try_here(given["trial"]), Json(); }},
    {"begin_trial",
     [](const Json& given) { return here().instance.begin_trial(modules[0].instance, given["trial"]); }},
    {"end_trial",
     [](const Json& given) {
       return here().instance.end_trial(given["code"], given["said"].get<std::string>()), Json();
     }},
    {"hang",
     [](const Json& given) {
       return here().instance.hang(given["trial"], given["limit"], given["said"].get<std::string>()), Json();
     }},
    {"show", [](const Json& given) { return here().instance.show(given["place"]), Json(); }},
};

}  // namespace
}  // namespace cbcan::module

using namespace cbcan;
using namespace cbcan::module;

#define CBCAN_EXPORT(name) __attribute__((export_name(name)))

extern "C" {

/// The plant that all that follows is about; 0 at the start.
CBCAN_EXPORT("use") void module_use(unsigned number) {
  current = number;
}
/// Ends a plant, not the first one.
CBCAN_EXPORT("forget") void module_forget(unsigned number) {
  modules.erase(number);
}

CBCAN_EXPORT("in") char* module_in(unsigned size) {
  here().in.resize(size);
  return here().in.data();
}
CBCAN_EXPORT("out") const char* module_out() {
  return here().out.data();
}
CBCAN_EXPORT("out_size") unsigned module_out_size() {
  return static_cast<unsigned>(here().out.size());
}

/// Takes a name of this size and then the content; a folder's are the files in it, one a line.
CBCAN_EXPORT("give") void module_give(unsigned name_size, bool is_folder, bool is_there) {
  std::string name = here().in.substr(0, name_size);
  auto content = is_there ? std::optional(here().in.substr(name_size)) : std::nullopt;
  here().instance.give(std::move(name), is_folder, std::move(content));
}

/// Takes {"call", ...} and returns JSON.
CBCAN_EXPORT("call") void module_call() {
  const Json given = Json::parse(here().in);
  for (const Call& call : kCalls)
    if (given["call"] == call.name) here().out = web::line_of(call.run(given));
}

/// Times in microseconds, which are exact to 2^53; infinity = never.
CBCAN_EXPORT("pass") double module_pass(double now) {
  const Time next = here().instance.pass(static_cast<Time>(now));
  return next == kNever ? HUGE_VAL : static_cast<double>(next);
}

// ---- Connections, as in protocols/stream_session.hpp

CBCAN_EXPORT("receive") void module_receive(unsigned number) {
  connection(number).receive(here().in);
}
CBCAN_EXPORT("end_input") void module_end_input(unsigned number) {
  connection(number).end_input();
}
/// Returns bytes that are to be sent together, and then count as sent; none = nothing is to be sent.
CBCAN_EXPORT("take") void module_take(unsigned number) {
  protocols::StreamSession& session = connection(number);
  here().out = session.unsent().substr(0, session.segment());
  if (!here().out.empty()) session.sent(here().out.size());
}
/// 1: wants more, 2: is busy, 4: has ended.
CBCAN_EXPORT("state") unsigned module_state(unsigned number) {
  const protocols::StreamSession& session = connection(number);
  return (session.wants_more() ? 1u : 0u) | (session.is_busy() ? 2u : 0u) | (session.has_ended() ? 4u : 0u);
}
CBCAN_EXPORT("disconnect") void module_disconnect(unsigned number) {
  here().connections.erase(number);
}

}  // extern "C"
