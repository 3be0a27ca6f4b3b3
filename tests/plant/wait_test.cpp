// SPDX-License-Identifier: MIT
// Commands that are answered later: wait and pass, with commands that cause events.
#include "plant/demo.hpp"

namespace cbcan::plant::test {

using Lines = std::vector<std::string>;

TEST_CASE("pass: time goes by") {
  const auto plant = demo();
  CHECK(plant->execute("pass 100ms") == "at 0.100000\n");
  CHECK(plant->execute("pass 0us") == "at 0.100000\n");
  CHECK(plant->execute("time") == "ok 0.100000\n");
  CHECK(plant->execute("pass 5m") ==
        "error: \"5m\": write a whole number of us, ms or s, such as 100ms; an hour is 3600s, 31536000s the "
        "most\n");
}

TEST_CASE("the PLC's side: registers and transactions") {
  const auto plant = demo();
  Frames frames(*plant);
  CHECK(plant->execute("trigger read 0x42 0x1000 0 4") == "ok\n");
  CHECK(plant->execute("read 3700 8") == "ok 0 5055 66 4096 0 4 401 15\n");
  CHECK(frames.seen == Lines{"642#4000100000000000", "5C2#4300100091010F00"});
  CHECK(plant->execute("write 3701 5066 42h 6411h 1 2 300") == "ok\n");
  CHECK(plant->execute("write 3700 0CA0Eh") == "ok\n");
  CHECK(plant->execute("read 3700") == "ok 0\n");
  CHECK(frames.seen.back() == "5C2#6011640100000000");
  CHECK(plant->execute("trigger 1234 0x42 0x1000 0 4") == "ok\n");
  CHECK(plant->execute("read 3700") == "ok 1\n");
  CHECK(plant->execute("read 4160 9") == "error: register 4160: there are 0..4167\n");
  CHECK(plant->execute("write 4167 1 2") == "error: register 4167: there are 0..4167\n");
  CHECK(plant->execute("write 3701 70000") == "error: word \"70000\": must be 0..65535\n");
  CHECK(plant->execute("read 2/3700") == "error: network \"2\": must be 1..1\n");
}

TEST_CASE("a write that the node refuses: result 4, and the object is as it was; after abort it is not") {
  const auto plant = demo();
  const auto writes_2000 = [&plant] {
    plant->execute("trigger write 16 0x6081 0 4 2000 0");
    CHECK(plant->execute("read 3700") == "ok 4\n");
    return plant->execute("get 16 0x6081");
  };
  CHECK(plant->execute("fault 16 refuse index=0x6081 code=0x06090030 count=1") == "ok 1\n");
  CHECK(writes_2000() == "ok 100000\n");
  CHECK(plant->execute("read 3706 2") == "ok 48 1545\n");  // 0609 0030h
  CHECK(plant->execute("fault 16 abort index=0x6081 count=1") == "ok 2\n");
  CHECK(writes_2000() == "ok 2000\n");
}

TEST_CASE("a trigger is whole, and a service") {
  const auto plant = demo();
  CHECK(plant->execute("trigger reed 99 0x1000 0 4") ==
        "error: \"reed\": must be read, write or a number; did you mean read?\n");
  CHECK(plant->execute("trigger read 99 0x1000") ==
        "error: trigger read 99 0x1000: write trigger read NODE INDEX SUB SIZE\n");
  CHECK(plant->execute("trigger write 99 0x2001 0 1") ==
        "error: trigger write 99 0x2001 0 1: write trigger write NODE INDEX SUB SIZE WORD...\n");
  CHECK(plant->execute("trigger 5055 0x42 0x1000") == "ok\n");
}

TEST_CASE("a transaction in progress, or one that has ended, is counted from the start of the wait") {
  const auto plant = demo();
  plant->execute("fault 0x42 response-late delay_ms=1000");
  plant->execute("trigger read 0x42 0x1000 0 4");
  plant->execute("wait transaction ended");
  CHECK(plant->execute("wait transaction started within 1s").starts_with("error: not within"));
  CHECK(plant->execute("wait transaction ended within 1s").starts_with("error: not within"));
  plant->execute("trigger read 0x42 0x1000 0 4");
  CHECK(plant->execute("wait 1 transaction started within 0s").starts_with("ok"));
  CHECK(plant->execute("wait no transaction ended within 500ms").starts_with("ok"));
  CHECK(plant->execute("wait 1 transaction ended").starts_with("ok"));
}

TEST_CASE("wait for a transaction: the end of one in progress, and its time") {
  const auto plant = demo();
  CHECK(plant->execute("trigger read 99 0x1000 0 4") == "ok\n");
  CHECK(plant->execute("wait transaction started") == "ok 0.000000\n");
  CHECK(plant->execute("wait transaction ended") == "ok 1.000000\n");
  CHECK(plant->execute("read 3706 2") == "ok 0 1284\n");  // 0504 0000h
  CHECK(plant->execute("wait transaction ended within 2s") ==
        "error: not within 2.000000 s: transaction ended: 0 of them\n");
  CHECK(plant->execute("wait transaction over") == "error: \"over\": must be started or ended\n");
}

TEST_CASE("wait for a register") {
  const auto plant = demo();
  plant->execute("trigger read 99 0x1000 0 4");
  CHECK(plant->execute("wait register 3700 != 0CA0Eh within 999ms") ==
        "error: not within 0.999000 s: register 3700 != 0CA0Eh: it is 51726\n");
  CHECK(plant->execute("wait register 3700 = 4 within 1ms") == "ok 1.000000\n");
  CHECK(plant->execute("wait register 3705 = 4 0 1284") == "ok 1.000000\n");
  CHECK(plant->execute("wait register 3700 > 3") == "ok 1.000000\n");
  CHECK(plant->execute("wait register 3700 ~ 3") == "error: \"~\": must be =, !=, <, <=, > or >=\n");
  CHECK(plant->execute("wait register 3700 > 3 4") == "error: \">\": of several registers write =\n");
  CHECK(plant->execute("wait register 3700 =") == "error: write register R OP VALUE...\n");
}

TEST_CASE("wait for a frame, with any digits and any end, and for how many") {
  const auto plant = demo(
      "[[node]]\nid = 5\neds = \"demo:/io_module.eds\"\nobjects = [ { index = 0x1017, value = 100 } ]\n");
  CHECK(plant->execute("wait frame 705#7F") == "ok 0.100000\n");
  CHECK(plant->execute("wait 3 frame 7x5#7f") == "ok 0.400000\n");
  CHECK(plant->execute("wait frame 705#*") == "ok 0.500000\n");
  CHECK(plant->execute("wait frame 705#xx within 99ms") ==
        "error: not within 0.099000 s: frame 705#xx: 0 of them\n");
  CHECK(plant->execute("wait frame 705#x within 1s") ==
        "error: not within 1.000000 s: frame 705#x: 0 of them\n");
  CHECK(
      plant->execute("wait frame 705") ==
      "error: frame \"705\": write it as candump does, 605#4017*, with x for any digit and * for any end\n");
}

TEST_CASE("wait for an EMCY message, any or one with this code") {
  const auto plant = demo();
  plant->execute("fault 0x42 emcy-storm interval_ms=500 code=0x5000");
  CHECK(plant->execute("wait emcy 0x42 0x8130 within 2s").starts_with("error: not within 2.000000 s: "));
  CHECK(plant->execute("wait emcy 0x42 0x5000 within 1s").starts_with("ok 2."));
  CHECK(plant->execute("wait emcy 0x42 within 1s").starts_with("ok "));
  CHECK(plant->execute("wait emcy 1 within 1s").starts_with("error: "));
}

TEST_CASE("wait for a state, and another master's NMT commands") {
  const auto plant = demo();
  Frames frames(*plant);
  CHECK(plant->execute("nmt start 0x42") == "ok\n");
  CHECK(frames.seen.front() == "000#0142");
  CHECK(plant->execute("wait state 0x42 operational") == "ok 0.000000\n");
  CHECK(plant->execute("nmt stop all") == "ok\n");
  CHECK(frames.seen.back() == "000#0200");
  CHECK(plant->execute("wait state 16 stopped") == "ok 0.000000\n");
  CHECK(plant->execute("wait state 16 operational within 1s") ==
        "error: not within 1.000000 s: state 16 operational: it is stopped\n");
  CHECK(plant->execute("wait state 16 running") ==
        "error: \"running\": must be initialising, pre-operational, operational, stopped or off\n");
  CHECK(plant->execute("nmt go 16") ==
        "error: \"go\": must be start, stop, preop, reset-node or reset-comm\n");
}

TEST_CASE("wait for an object, which a device changes by itself") {
  const auto plant = demo(
      "[[node]]\nid = 5\neds = \"demo:/io_module.eds\"\nsignals = [ { index = 0x6401, sub = 1, shape = "
      "\"ramp\", to = 1000, "
      "duration_ms = 1000, sample_ms = 1 } ]\n");
  CHECK(plant->execute("wait object 5 0x6401:1 >= 500") == "ok 0.500000\n");
  CHECK(plant->execute("wait object 5 0x1008 = cbcan I/O module") == "ok 0.500000\n");
  CHECK(plant->execute("wait object 5 0x6401:1 = 499 within 10ms") ==
        "error: not within 0.010000 s: object 5 0x6401:1 = 499: it is 510\n");
  CHECK(plant->execute("wait object 5 0x5FFF = 1").starts_with("error: 5FFFh:00: node 5 has no such object"));
}

TEST_CASE("wait for a time, or for how long something took") {
  const auto plant = demo();
  CHECK(plant->execute("wait time 3s") == "ok 3.000000\n");
  CHECK(plant->execute("wait time 2s") == "ok 3.000000\n");
  CHECK(plant->execute("wait took > 10ms") == "ok 3.010001\n");
  CHECK(plant->execute("wait time 100s") == "error: not within 60.000000 s: time 100s: it is 63.010001\n");
  CHECK(plant->execute("wait tyme 1s") == "error: \"tyme\": no such condition; did you mean time?\n");
  CHECK(plant->execute("wait 2 time 1s") ==
        "error: 2 time 1s: only events are counted: transaction, frame, emcy\n");
}

TEST_CASE("faults of the module: another master's NMT commands to it, and its bus-off") {
  const auto plant = demo();
  const auto read = [&] {
    plant->execute("trigger read 0x42 0x1000 0 4");
    plant->execute("wait transaction ended within 5s");
  };
  Frames frames(*plant);
  plant->execute("fault bus module-nmt after=1 count=1");  // after its second frame
  read();
  CHECK(frames.seen == Lines{"642#4000100000000000", "5C2#4300100091010F00"});
  frames.seen.clear();
  read();  // the command wins the bus against the response
  CHECK(frames.seen == Lines{"642#4000100000000000", "000#817F", "5C2#4300100091010F00", "77F#00"});
  frames.seen.clear();
  plant->execute("fault bus module-nmt command=stop");
  read();
  CHECK(frames.seen == Lines{"642#4000100000000000", "000#027F", "5C2#4300100091010F00"});
  plant->execute("clear bus");
  plant->execute("fault bus module-bus-off for_ms=300");
  plant->execute("pass 100ms");
  frames.seen.clear();
  plant->execute("trigger read 0x42 0x1000 0 4");
  CHECK(frames.seen.empty());
  plant->execute("pass 2s");
  frames.seen.clear();
  read();
  CHECK(frames.seen.back() == "5C2#4300100091010F00");
}

TEST_CASE("a node without power is not there, and comes back with its stored parameters") {
  const auto plant = demo();
  const auto read_heartbeat = [&] {
    plant->execute("trigger read 0x42 0x1017 0 2");
    plant->execute("wait transaction ended within 5s");
    return plant->execute("read 3700") + plant->execute("read 3706");
  };
  plant->execute("trigger write 0x42 0x1017 0 2 1000");
  plant->execute("trigger write 0x42 0x1010 1 4 0x6173 0x6576");  // "save"
  plant->execute("trigger write 0x42 0x1017 0 2 500");
  CHECK(plant->execute("power 0x42 off") == "ok\n");
  Frames frames(*plant);
  CHECK(plant->execute("wait state 0x42 off") == "ok 0.000000\n");
  CHECK(plant->execute("get 0x42 0x1017") ==
        "error: node 0x42 has no power; switch it on by power 0x42 on\n");
  CHECK(read_heartbeat() == "ok 4\nok 0\n");
  CHECK(frames.seen == Lines{"642#4017100000000000", "642#8017100000000405"});
  plant->execute("pass 5s");
  CHECK(plant->execute("power 0x42 on") == "ok\n");
  CHECK(frames.seen.back() == "742#00");
  CHECK(plant->execute("wait state 0x42 pre-operational") == plant->execute("time"));
  CHECK(read_heartbeat() == "ok 0\nok 1000\n");
  CHECK(plant->execute("power 0x42 maybe") == "error: \"maybe\": must be on or off\n");
}

TEST_CASE("all power off and on: one boot-up message for each node, and nothing in between") {
  const auto plant = demo();
  Frames frames(*plant);
  plant->execute("power all off");
  plant->execute("power all off");
  plant->execute("nmt reset-node all");
  plant->execute("pass 10s");
  CHECK(frames.seen == Lines{"000#8100", "77F#00"});
  plant->execute("power all on");
  plant->execute("power all on");
  CHECK(frames.seen == Lines{"000#8100", "77F#00", "701#00", "702#00", "710#00", "720#00", "742#00"});
}

TEST_CASE("a drive that moves when its power goes does not move without") {
  const auto plant = demo();
  plant->execute("nmt start 16");
  for (const char* word : {"6", "7", "15"})
    plant->execute(std::string("trigger write 16 0x6040 0 2 ") + word);
  plant->execute("trigger write 16 0x6060 0 1 3");
  plant->execute("trigger write 16 0x60FF 0 4 1000 0");
  plant->execute("pass 2s");
  plant->execute("power 16 off");
  plant->execute("pass 100s");
  plant->execute("power 16 on");
  CHECK(plant->execute("get 16 0x606C") == "ok 0\n");
  CHECK(plant->execute("get 16 0x6041") == "ok 592\n");
}

TEST_CASE("a frame of another node") {
  const auto plant = demo();
  Frames frames(*plant);
  CHECK(plant->execute("send 602#4000100000000000") == "ok\n");
  CHECK(frames.seen == Lines{"602#4000100000000000", "582#4300100094010200"});
  CHECK(plant->execute("send 742#R") == "ok\n");
  CHECK(frames.seen.back() == "742#7F");
  for (const char* bad : {"605", "605#4", "605#112233445566778899", "800#", "60#00", "605#R9", "20000000#"}) {
    CAPTURE(bad);
    CHECK(plant->execute(std::string("send ") + bad) ==
          "error: frame \"" + std::string(bad) + "\": write it as candump does: 605#4017100000000000\n");
  }
}

TEST_CASE("shutdown is for the owner of the plant") {
  const auto plant = demo();
  CHECK(plant->control().execute("shutdown", 0).shutdown);
  CHECK_FALSE(plant->control().execute("time", 0).shutdown);
}

}  // namespace cbcan::plant::test
