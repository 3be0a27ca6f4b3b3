// SPDX-License-Identifier: MIT
// What -v says about the boot of a network: each failure once, with what was seen and what was wanted.

#include "plant/journal_lines.hpp"
#include "support/source_file.hpp"

namespace cbcan::journal {
namespace {

using Lines = std::vector<std::string>;

/// What the demo plant, whose module boots this network, says about it.
class Boots {
 public:
  explicit Boots(std::string_view network) : plant_(plant::test::booting(network)), seen_(*plant_) {}
  /// `eds`: of node 9, which the demo plant has too.
  Boots(const std::string& network, const std::string& eds)
      : plant_(plant::test::demo("module.network = \"n.toml\"\n[[node]]\nid = 9\neds = \"9.eds\"\n",
                                 [=](const std::string& path) {
                                   return path == "n.toml" || path == "9.eds"
                                              ? std::optional(path == "n.toml" ? network : eds)
                                              : std::nullopt;
                                 })),
        seen_(*plant_) {}

  /// Lines of the kind boot since the last call.
  Lines after(std::initializer_list<const char*> commands) {
    for (const char* command : commands)
      CHECK(plant_->execute(command).find("error") == std::string::npos);
    Lines lines;
    const Journal& journal = plant_->control().journal();
    const auto no_name = [](auto...) -> const descriptions::Object* { return nullptr; };
    cursor_.look([&](std::uint64_t, const Event& event) {
      lines.push_back(text_of(event, journal, no_name));
      return true;
    });
    return lines;
  }
  /// R3972 + node, and R3928.
  std::uint16_t register_of(unsigned node) { return plant_->control().network(1).registers()[3972 + node]; }
  std::uint16_t status() { return plant_->control().network(1).registers()[3928]; }
  const NetworkWatch& watch() { return *plant_->control().network(1).watch(); }

 private:
  std::unique_ptr<plant::VirtualPlant> plant_;
  plant::test::JournalLines seen_;
  Cursor cursor_{plant_->control().journal(), kinds_of({Kind::kBoot})};
};

constexpr const char* kNode2 = "[[node]]\nid = 2\nheartbeat_ms = 500\n";  // pressure transducer of the demo

}  // namespace

TEST_CASE("a node is not the one that the network file wants") {
  // The demo's node 2: 1000h 00020194h, 1018h 0, 194h, 10000h, 1.
  const auto [wanted, said] = GENERATE(table<const char*, const char*>(
      {{"device_type = 0x20192", "device type 00020194h, the network file wants 00020192h (C)"},
       {"identity = [7]", "vendor-ID 00000000h, the network file wants 00000007h (D)"},
       {"identity = [0, 0x195]", "product code 00000194h, the network file wants 00000195h (M)"},
       {"identity = [0, 0, 2]", "revision number 00010000h, the network file wants 00000002h (N)"},
       {"identity = [0, 0, 0, 9]", "serial number 00000001h, the network file wants 00000009h (O)"}}));
  Boots boots(std::string("[[node]]\nid = 2\n") + wanted);
  boots.after({"pass 1s"});  // the journal begins after the first check
  CHECK(boots.after({"power 2 off", "power 2 on", "pass 60s"}) ==
        Lines{std::string("node 2: ") + said + "; it is not started"});
  CHECK(boots.after({"power 2 off", "power 2 on", "pass 60s"}).empty());
}

TEST_CASE("a node that is absent is looked for, and reported once") {
  Boots boots("[[node]]\nid = 99\n");
  CHECK(boots.after({"pass 60s"}) == Lines{"node 99: no response (B); it is looked for each second"});
  CHECK(boots.after({"pass 60s", "nmt reset-node 99", "pass 60s"}).empty());
}

TEST_CASE("a check that cannot be made, and a configuration that is refused or has no response") {
  const std::string serial = "[[node]]\nid = 2\nidentity = [0, 0, 0, 1]\n";
  const auto [network, fault, said] = GENERATE_REF(table<std::string, const char*, const char*>(
      {{serial, "fault 2 abort index=0x1018 code=0x06090011",
        "serial number at 1018h:04 Serial number: 0609 0011h sub-index does not exist (O); "
        "it is not started"},
       {serial, "fault 2 abort index=0x1018 code=0x08000022",
        "no response at 1018h:04 Serial number: 0800 0022h data cannot be transferred because of the present "
        "device state (B); it is tried again after 1, 2, 4 .. 60 s"},
       {serial, "fault 2 response-never index=0x1018",
        "no response at 1018h:04 Serial number: 0504 0000h SDO service timed out (B); "
        "it is tried again after 1, 2, 4 .. 60 s"},
       {kNode2, "fault 2 abort index=0x1017 code=0x06090030",
        "configuration failed at 1017h:00 Producer heartbeat time: 0609 0030h invalid value "
        "for the parameter (J); it is not started"},
       {kNode2, "fault 2 response-never index=0x1017",
        "configuration failed at 1017h:00 Producer heartbeat time: 0504 0000h SDO service timed out (J); it "
        "is tried again after 1, 2, 4 .. 60 s"}}));
  Boots boots(network);
  CHECK(boots.after({"pass 1s"}).empty());
  CHECK(boots.after({fault, "power 2 off", "power 2 on", "pass 60s"}) ==
        Lines{std::string("node 2: ") + said});
}

TEST_CASE("a node that does not boot after its defaults have been restored") {
  Boots boots("[[node]]\nid = 2\nrestore = 1\n");
  CHECK(boots.after({"power 2 off", "fault 2 heartbeat-stops after=1", "power 2 on", "pass 60s"}) ==
        Lines{"node 2: no boot-up message after its reset (B); it is tried again after 1, 2, 4 .. 60 s"});
}

TEST_CASE("heartbeats that do not come, or report another state") {
  Boots boots(kNode2);
  CHECK(boots.after({"pass 1s", "fault 2 state-wrong state=127", "power 2 off", "power 2 on", "pass 60s"}) ==
        Lines{"node 2: no heartbeat that reports Operational for 3400 ms (K); it is tried again after 1, 2, "
              "4 .. 60 s"});
  CHECK(boots.after({"clear", "pass 120s"}).empty());  // it runs
  CHECK(boots.after({"fault 2 heartbeat-stops", "pass 1s"}) ==
        Lines{"node 2: lost: no heartbeat for 850 ms; it is looked for each second"});
  CHECK(boots.after({"trigger write 2 0x1017 0 2 0", "pass 60s"}) ==
        Lines{"node 2: no heartbeat for 3400 ms (K); it is tried again after 1, 2, 4 .. 60 s"});
}

TEST_CASE("a device with 100Ch and 100Dh, and without 1017h, is guarded") {
  Boots boots("[[node]]\nid = 9\neds = \"9.eds\"\n",
              cbcan::test::source_file("tests/descriptions/guarded.eds"));
  CHECK(boots.after({"pass 60s"}).empty());
  CHECK((boots.register_of(9) == 0x0105 && boots.status() == 0x51));
  CHECK(boots.after({"power 9 off", "pass 5s"}) ==
        Lines{"node 9: lost: no response to node guarding for 3000 ms; it is asked again each guard time"});
  CHECK(boots.register_of(9) == 0x5800);
  CHECK(boots.after({"power 9 on", "pass 3s"}).empty());
  CHECK(boots.register_of(9) == 0x0105);
  CHECK(
      boots.after({"fault 9 heartbeat-stops", "nmt reset-node 9", "pass 60s"}) ==
      Lines{"node 9: no response to node guarding for 3000 ms (F); it is tried again after 1, 2, 4 .. 60 s"});
  CHECK(boots.after({"clear", "pass 60s"}).empty());
  CHECK(boots.register_of(9) == 0x0105);
  CHECK(boots.after({"fault 9 state-wrong state=127", "nmt reset-node 9", "pass 60s"}) ==
        Lines{"node 9: no response to node guarding that reports Operational for 12000 ms (F); it is tried "
              "again after 1, 2, 4 .. 60 s"});
}

TEST_CASE("a keep-alive node that is Operational is left as it is, which is no failure") {
  Boots boots(std::string(kNode2) + "keep_alive = true\n");
  CHECK(boots.after({"pass 3s", "power 1 off"}).empty());
  const char* const reset_module = "trigger write 0 0x1F82 127 1 6";
  CHECK(boots.after({reset_module, "pass 3s"}) ==
        Lines{"node 2: already Operational, so it has not been configured (L)"});
}

TEST_CASE("failures in words, by what is known of them") {
  using namespace descriptions;
  CHECK(failure_text({.letter = 'C'}) == "device type differs from the network file (C); it is not started");
  CHECK(failure_text({.letter = 'B'}) == "no response (B); it is tried again");
  CHECK(failure_text({.letter = 'E'}) == "failed (E); it is not started");
  CHECK(failure_text({.letter = BootFailure::kLost}) == "lost: no heartbeat; it is looked for each second");
  const BootFailure refused{.letter = 'J', .index = 0x6423, .code = 0x06010002, .name = "Interrupt enable"};
  CHECK(failure_text(refused) ==
        "configuration failed at 6423h:00 Interrupt enable: 0601 0002h attempt to write a "
        "read-only object (J); it is not started");
  const BootFailure own{.letter = 'J', .index = 0x1400, .sub = 1, .code = 0x1234, .is_own = true};
  CHECK(failure_text(own) ==
        "configuration failed at 1400h:01: 0000 1234h an abort code of the node's own (J)");
  const std::uint8_t bytes[] = {0x02, 0, 0x01, 0x06, 0x23, 0x64, 0, 'J'};
  BootFailure same = boot_failure_from(bytes);
  same.name = refused.name;
  CHECK(failure_text(same) == failure_text(refused));
}

TEST_CASE("a failure is reported again when the node has run, or fails otherwise") {
  Boots boots("[[node]]\nid = 2\nheartbeat_ms = 500\ndevice_type = 0x20194\n");
  const Lines lost{"node 2: lost: no heartbeat for 850 ms; it is looked for each second"};
  CHECK(boots.after({"pass 1s", "power 2 off", "pass 60s"}) == lost);
  CHECK("node 2: " + boots.watch().boot_failure(2) == lost.front());
  CHECK(boots.after({"power 2 on", "pass 1s"}).empty());
  CHECK(boots.watch().boot_failure(2).empty());
  CHECK(boots.after({"power 2 off", "pass 1s"}) == lost);
}

}  // namespace cbcan::journal
