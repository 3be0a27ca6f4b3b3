// SPDX-License-Identifier: MIT
#pragma once

/// CANopen manager (CiA 302-2): boots the nodes of a network and supervises them. For each node that
/// NetworkObjects lists: check what it is, write its configuration, await its heartbeat, start it. Several
/// nodes at the same time; silent ones occupy one SDO client at most. It is active while bit 0 of 1F80h is
/// set.
///
///   kWait       passive; read of 1000h every second, as boot-up messages can be missed
///   kCheck      1000h and 1018h are compared with 1F84h..1F88h; a keep-alive node (bit 4 of 1F81h) that is
///               Operational is not touched: kStart
///   kRestore    1F8Ah: its defaults are restored, it is reset, and its boot-up message is awaited (kReboot)
///   kConfigure  1F22h is written, unless 1020h is equal to 1F26h and 1F27h
///   kWatch      its first heartbeat is awaited, if 1016h of the own node has a time for it; or its first
///               response to node guarding, if 1F81h has a guard time and a retry factor
///   kReady      waits until the own node is Operational, and for mandatory nodes
///   kStart      NMT start has been sent; a heartbeat or such a response must report Operational
///   kInputs     Operational; process data of the node have not been received (300Ah)
///   kRun        Operational, and all of them have
///   kLost       no heartbeat or response: it is not reset. Operational again without a boot-up message:
///               kInputs; another state: kCheck
///   kFailed     with a letter of CiA 302-2; kCheck again after a boot-up message, by 1F25h, or, if the
///               fault may pass, after 1, 2, 4 .. 60 s
///
/// Invariant: no node is started here unless each object of 1F22h has been written, or found by 1020h, since
/// its last boot-up message, except keep-alive nodes; "save" need not have been confirmed. Decided where CiA
/// 302-2 leaves it open: an SDO timeout is repeated kRetries times, an abort is not; "load" and "save" are
/// sent once for a boot-up message; more than kMostBoots boot-up messages in kBootWindow delay the next check
/// by a second; NMT commands of others win: Stop and Pre-operational hold the node until Start, those of
/// another master until its next boot-up message too.
///
/// Process data: RPDOs that 300Ah names count from the start of their node on. What own TPDOs carry before
/// the PLC has written outputs, and while it is silent, is in 300Bh; with kStop the nodes that run are
/// stopped then, and no node is started, until it writes outputs again.
///
/// Nothing blocks, nothing is allocated; not re-entrant. A node's event costs no search over nodes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/device.hpp"
#include "cbcan/canopen/lss_master.hpp"
#include "cbcan/canopen/manager/network_objects.hpp"
#include "cbcan/canopen/nmt/node_monitor.hpp"
#include "cbcan/canopen/nmt/node_set.hpp"
#include "cbcan/canopen/sdo/client.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

class ManagerApplication {
 public:
  /// When an SDO request to this node may begin: kNever = others use its SDO server, or wait for it. Asked
  /// again after Manager::kPause at the latest.
  virtual Time node_free_from(std::uint8_t node, Time now) = 0;
  /// What the manager knows about this node has changed; 0 = about the own node.
  virtual void on_node(std::uint8_t node) = 0;

 protected:
  ~ManagerApplication() = default;
};

class Manager {
 public:
  static constexpr std::uint8_t kRetries = 3;
  static constexpr std::uint8_t kMostBoots = 5;
  static constexpr Time kBootWindow = 10 * kSecond;
  static constexpr Time kProbePeriod = kSecond;
  static constexpr std::uint16_t kProbeTimeoutMs = 100;
  static constexpr Time kMostDelay = 60 * kSecond;  ///< until a node that has failed is booted again
  static constexpr Time kRebootTimeout = kSecond;   ///< from a reset to the boot-up message
  static constexpr Time kPause = kMillisecond;      ///< until a request is tried again that others delay
  static constexpr Time kLssPause = 10 * kSecond;   ///< after a request of the PLC
  static constexpr Time kInputsPeriod = 10 * kMillisecond;  ///< in kInputs
  /// SDO frames precede heartbeats on the bus: for this long before a heartbeat is overdue, at most a quarter
  /// of its time, no request is sent.
  static constexpr Time kListenTime = 50 * kMillisecond;
  static constexpr std::uint32_t kConf = 0x666E6F63;  ///< "conf"
  static constexpr std::size_t kMostReadBytes = 8;    ///< of an object
  static constexpr std::uint8_t kSignsOfTwin = 2;     ///< requests with two responses
  static constexpr std::size_t kMostSources = kServices.rpdos < 64 ? 64 : kServices.rpdos;

  enum class Phase : std::uint8_t {
    kUnlisted,
    kWait,
    kCheck,
    kRestore,
    kReboot,
    kConfigure,
    kWatch,
    kReady,
    kStart,
    kInputs,
    kRun,
    kLost,
    kFailed,
  };
  static constexpr std::size_t kPhases = static_cast<std::size_t>(Phase::kFailed) + 1;
  /// The boot has got as far as it can without a start.
  static constexpr bool is_ready(Phase phase) { return phase >= Phase::kReady && phase <= Phase::kRun; }
  /// Its process data count.
  static constexpr bool is_started(Phase phase) { return phase >= Phase::kStart && phase <= Phase::kRun; }
  static constexpr bool is_missing(Phase phase) { return phase == Phase::kLost || phase == Phase::kFailed; }
  /// A request is sent each second, until the node responds.
  static constexpr bool is_looked_for(Phase phase) { return phase == Phase::kWait || phase == Phase::kLost; }

  /// Why a node has failed: a letter of CiA 302-2 and, of an SDO transfer, its object and abort code.
  struct Failure {
    AbortCode code = AbortCode::kNone;
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    char letter = 0;
  };
  /// Letters of this manager: no response or boot-up message; modules without a node ID that differ in the
  /// serial number only, which is not known.
  static constexpr Failure kNoResponse{AbortCode::kTimeOut, object::kDeviceType, 0, 'B'};
  static constexpr char kAlike = 'U';

  /// All outlive it. `own` is the device of this node; `monitor` receives all error control messages before
  /// this. `sdo_timeout_ms`: for requests to nodes without a time of their own (300Dh); 0 = the default.
  template <Services kOf = kServices>
  Manager(Device& own, NodeMonitor& monitor, CanPort& port, ManagerApplication& application,
          std::uint16_t sdo_timeout_ms = SdoClient::kDefaultTimeoutMs)
      : Manager(own, monitor, port, application, sdo_timeout_ms,
                std::make_index_sequence<kOf.manager_clients>()) {
    static_assert(kOf.manager_clients >= 2, "for a Manager, Services::manager_clients is 2 or more");
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  /// Call it before the own node is started: what the manager knows of its network, see
  /// NetworkObjects::use().
  bool use(NetworkObjects::Bytes image) { return objects_.use(image); }
  bool use(std::span<std::uint8_t> memory, std::size_t used) { return objects_.use(memory, used); }
  /// Call it before the own node is started: nodes with a 1 in 3010h that do not respond may get their ID by
  /// this; it outlives the manager. It may be used by others while uses_lss() is false.
  void use(LssMaster* master) { lss_ = master; }
  bool uses_lss() const { return joining_ != 0; }
  /// Another request has been started there.
  void leave_lss(Time now) {
    joining_ = 0;
    lss_from_ = now + kLssPause;
  }
  /// Value of one of its objects, empty = not set.
  NetworkObjects::Bytes object(std::uint16_t index, std::uint8_t sub) const {
    return objects_.find(index, sub);
  }
  /// The manager uses its objects while it is active: only 1F80h, which stops it, and 1F25h can be written
  /// then.
  AbortCode write_object(std::uint16_t index, std::uint8_t sub, NetworkObjects::Bytes value, Time now);
  /// 1F80h has bit 0.
  bool active() const { return active_; }
  /// The PLC has written outputs; it is silent. Also while this is not active.
  void on_outputs_written(Time now) {
    if (!outputs_written_ || plc_lost_) take_outputs(now);
  }
  void on_plc_lost(Time now);
  /// 1F80h has been written.
  void on_startup_written(Time now);

  /// The own node has entered this state; Initialising: it is reset, and all boots begin again.
  void on_own_state(nmt::State state, Time now);
  /// A node has reported by this frame: see NodeMonitor.
  void on_report(const Frame& frame, NodeMonitor::News news, Time now);
  /// This NMT command has been sent to this node, 0 = to all, by the PLC or by another master.
  void on_command(nmt::Command command, std::uint8_t node, bool by_plc, Time now) {
    if (active_) take_command(command, node, by_plc ? Held::kByPlc : Held::kByOther, now);
  }
  /// The PLC's command to this node, or to all but the own one, 128. False: the port has no room.
  bool command(nmt::Command command, std::uint8_t node, Time now);
  /// The same as "conf" in 1F25h:n; 128 = all.
  bool boot_again(std::uint8_t node, Time now) { return configure(node, kConf, now) == AbortCode::kNone; }
  /// A frame of another SDO client to this node: two responses are no sign of a second node.
  void on_request_of_others(std::uint8_t node) { nodes_[node].shared = true; }
  /// True: the frame, with a CAN-ID of 580h + 1..127, is for one of its SDO clients.
  bool on_response(const Frame& frame, Time now) { return active_ && take_response(frame, now); }

  void poll(Time now) {
    if (now >= deadline()) work(now);
  }
  Time deadline() const { return active_ || begins_ || ends_ ? next_deadline() : kNever; }

  /// When others may send an SDO request to this node; kNever = not before the current transfer ends.
  Time node_free_from(std::uint8_t node, Time now) {
    return clients_in_use_ == 0 ? now : free_from(node, now);
  }

  // ---- What is known

  Phase phase(std::uint8_t node) const { return nodes_[node].phase; }
  const Failure& failure(std::uint8_t node) const { return nodes_[node].failure; }
  bool is_listed(std::uint8_t node) const { return phase(node) != Phase::kUnlisted; }
  bool is_operational(std::uint8_t node) const {
    return phase(node) == Phase::kInputs || phase(node) == Phase::kRun;
  }
  /// Its heartbeat, or else node guarding, shows its state.
  bool is_watched(std::uint8_t node) const {
    return monitor_.consumer_time(node) != 0 || nodes_[node].life_time() != 0;
  }
  bool is_guarded(std::uint8_t node) const { return is_watched(node) && monitor_.consumer_time(node) == 0; }
  /// How long to wait for a report of the node's state.
  Time heartbeat_time(std::uint8_t node) const;
  /// 1F22h has been written since its last boot-up message.
  bool is_configured(std::uint8_t node) const { return nodes_[node].configured; }
  bool was_lost(std::uint8_t node) const { return lost_.has(node); }
  void forget_loss(std::uint8_t node) { lost_.erase(node); }
  /// Two nodes use the same ID.
  bool any_twin() const { return !twins_.empty(); }
  std::uint8_t listed() const { return listed_; }
  std::uint8_t running() const {
    return static_cast<std::uint8_t>(in_phase(Phase::kInputs) + in_phase(Phase::kRun));
  }
  std::uint8_t booting() const;
  /// A mandatory node has failed, is lost, or has not booted within 1F89h.
  bool mandatory_missing() const {
    return mandatory_missing_ != 0 || (boot_is_over_ && mandatory_unready_ != 0);
  }
  /// The listed node with the lowest ID that is not in kRun; 0 = none.
  std::uint8_t first_unwell() const { return unwell_.next(0); }

 private:
  /// Not to be started until an NMT start of others; after another master's Stop also at the next boot-up.
  enum class Held : std::uint8_t { kNo, kByPlc, kByOther };
  /// What LSS does for a node: a module with its identity is found, and again, as a lost frame may hide a
  /// second one; it gets and stores the node ID, and boots.
  enum class Joining : std::uint8_t { kFind, kFindAgain, kSetNodeId, kStore, kSwitch };

  /// Once for each boot-up message that it has not caused.
  enum class Restoring : std::uint8_t { kDue, kLoadSent, kDone };

  struct Node {
    Time due = kNever;
    Time booted_since = 0;  ///< boot-up messages are counted from here
    Failure failure{};
    std::uint16_t at = 0;        ///< of the phase: number of the check, offset in 1F22h, place in 300Ah
    std::uint16_t saved_to = 0;  ///< offset in 1F22h after the last "save" sent since its boot-up message
    std::uint32_t answered = 0;  ///< index, sub-index of the last transfer; 0 = a second response is no sign
    Phase phase = Phase::kUnlisted;
    std::uint8_t tries = 0;
    std::uint8_t boot_ups = 0;
    std::uint8_t signs = 0;     ///< that there are two nodes
    std::uint8_t failures = 0;  ///< in succession that may pass
    Restoring restoring = Restoring::kDue;
    bool boots = true;  ///< it is configured and started here
    Held held = Held::kNo;
    bool owes = false;    ///< the response to an earlier request, which a second response may be
    bool shared = false;  ///< another SDO client uses it since its boot has begun
    bool configured = false;
    bool mandatory = false;
    bool missing = false;  ///< it is mandatory, has failed or is lost, and has not become ready since
    bool keep_alive = false;
    bool was_operational = false;  ///< reported before it was started
    // Node guarding.
    std::uint16_t guard_ms = 0;
    std::uint8_t retry_factor = 0;
    std::uint8_t unanswered = 0;  ///< requests in succession
    std::uint8_t toggle = 1;      ///< bit 7 of the last response; 1 = there has been none
    Time guard_at = 0;            ///< the next request

    Time life_time() const { return milliseconds(std::uint32_t{guard_ms} * retry_factor); }
  };

  struct Client {
    explicit Client(CanPort& port) : sdo(port, data) {}
    Client(const Client&) = delete;
    Client& operator=(const Client&) = delete;

    NetworkObjects::Bytes data_read() const { return std::span(data).first(sdo.size()); }

    std::array<std::uint8_t, kMostReadBytes> data{};
    SdoClient sdo;
    std::uint8_t node = 0;      ///< whose boot it serves; 0 = none
    Time resume_at = kNever;    ///< the next transfer waits for others
    ConciseDcf::Entry asked{};  ///< object of the transfer
    std::uint64_t inputs = 0;   ///< data of a PDO that are being read
    std::uint8_t input_bits = 0;
  };

  /// What each kind of event means in one phase of a node.
  struct State {
    /// Sends the next request, or releases the client; null: no SDO client is needed.
    void (*ask)(Manager&, Client&, Time);
    void (*on_done)(Manager&, Client&, Time);
    void (*on_refused)(Manager&, Client&, Time);  ///< by an abort, or no response to any try
    void (*on_state)(Manager&, std::uint8_t node, nmt::State, Time);  ///< a heartbeat
    void (*on_deadline)(Manager&, std::uint8_t node, Time);
  };
  template <auto kAsk, auto kDone, auto kRefused, auto kState, auto kDeadline>
  static constexpr State state_of();
  /// Null: nothing happens.
  template <auto kHandler, class... Given>
  static void call(Manager& manager, Given... given) {
    if constexpr (!std::is_null_pointer_v<decltype(kHandler)>) (manager.*kHandler)(given...);
  }
  static const std::array<State, kPhases> kStates;

  template <std::size_t... kClient>
  Manager(Device& own, NodeMonitor& monitor, CanPort& port, ManagerApplication& application,
          std::uint16_t sdo_timeout_ms, std::index_sequence<kClient...> /*clients*/)
      : own_(own),
        monitor_(monitor),
        port_(port),
        application_(application),
        sdo_timeout_ms_(sdo_timeout_ms == 0 ? SdoClient::kDefaultTimeoutMs : sdo_timeout_ms),
        clients_{(void(kClient), Client(port))...} {}

  const State& state(std::uint8_t node) const { return kStates[static_cast<std::size_t>(phase(node))]; }
  void enter(std::uint8_t node, Phase phase, Time due);
  void enter_talking(std::uint8_t node, Phase phase, Time now);
  std::uint8_t in_phase(Phase phase) const { return count_[static_cast<std::size_t>(phase)]; }
  bool mode(std::uint8_t bit) const { return (objects_.number(object::kNmtStartup, 0) >> bit & 1) != 0; }

  AbortCode configure(std::uint8_t node, std::uint32_t signature, Time now);
  void begin(Time now);
  void end(Time now);
  void write_own_objects(Time now);
  void list_nodes(Time now);

  // State::ask
  void ask_device_type(Client& client, Time now);
  void ask_producer_time(Client& client, Time now);
  void ask_check(Client& client, Time now);
  void ask_restore(Client& client, Time now);
  void ask_configure(Client& client, Time now);
  void ask_input(Client& client, Time now);
  // State::on_done
  void found(Client& client, Time now);
  void producer_time_read(Client& client, Time now);
  void check(Client& client, Time now);
  void restored(Client& client, Time now);
  void configured(Client& client, Time now);
  void input_read(Client& client, Time now);
  // State::on_refused
  void keep_waiting(Client& client, Time now);
  void look_later(Client& client, Time now);
  void check_failed(Client& client, Time now);
  void configuration_failed(Client& client, Time now);
  void input_failed(Client& client, Time now);
  // State::on_state
  void appeared(std::uint8_t node, nmt::State state, Time now);
  void watched(std::uint8_t node, nmt::State state, Time now);
  void started(std::uint8_t node, nmt::State state, Time now);
  void stays(std::uint8_t node, nmt::State state, Time now);
  void returned(std::uint8_t node, nmt::State state, Time now);
  // State::on_deadline
  void probe(std::uint8_t node, Time now);
  void no_boot_up(std::uint8_t node, Time now);
  void no_heartbeat(std::uint8_t node, Time now);
  void look_for_inputs(std::uint8_t node, Time now);

  void stays_out(std::uint8_t node, nmt::State state, Time now);
  void on_boot_up(std::uint8_t node, Time now);
  void command_one(nmt::Command command, std::uint8_t node, Held by, Time now);
  void configure_again(std::uint8_t node, Time now);
  void note_twin(std::uint8_t node);
  bool is_foreign(std::uint8_t node) const;
  void begin_check(std::uint8_t node, Time now);
  void checked(Client& client, Time now);
  void ask_state(std::uint8_t node, Time now);
  void decide(std::uint8_t node, Time now);
  void await_boot_up(std::uint8_t node, Time now);
  void boot_from_reset(std::uint8_t node, Time now);
  void boot_in(nmt::State state, std::uint8_t node, Time now);
  void begin_configuration(Client& client, Time now);
  void configured_all(Client& client, Time now);
  void look_for_starts(Time now);
  void await_start(std::uint8_t node, Time now);
  void run(std::uint8_t node, Time now);
  void stop(std::uint8_t node, Time now);
  void lose(std::uint8_t node, Time now);
  void fail(std::uint8_t node, Time now);

  // Process data: 300Ah, 300Bh
  Pdo::Outputs outputs() const;
  std::uint32_t outputs_mode() const { return objects_.number(object::kOutputsMode, 0); }
  bool plc_stops_nodes() const { return plc_lost_ && (outputs_mode() & OutputsMode::kStop) != 0; }
  void take_outputs(Time now);
  NetworkObjects::Bytes source(std::size_t rpdo) const;
  bool awaits_inputs(std::uint8_t node) const;
  bool next_input(std::uint8_t node);
  void zero_inputs(std::uint8_t node, Time now);
  void forget_inputs(std::uint8_t node);
  void ignore_inputs(std::uint8_t node, bool ignored);

  // SDO clients
  std::uint16_t timeout_of(std::uint8_t node) const;
  void release(Client& client);
  void ask(Client& client, const ConciseDcf::Entry& object);
  void request_read(Client& client, std::uint16_t index, std::uint8_t sub, std::size_t size, Time now);
  void request_write(Client& client, const ConciseDcf::Entry& value, Time now);
  void go_on(Client& client, Time now);
  void follow(Client& client, Time now);
  void look_for_twin(const Frame& frame, std::uint8_t node);
  void try_again(Client& client);
  void serve(Time now);
  void poll_clients(Time now);
  void drop_client(std::uint8_t node, Time now);
  bool take_response(const Frame& frame, Time now);
  void take_command(nmt::Command command, std::uint8_t node, Held by, Time now);
  void work(Time now);
  Time next_deadline() const;
  Time free_from(std::uint8_t node, Time now);

  // LSS
  void look_for_unconfigured(std::uint8_t node);
  void serve_lss(Time now);
  void ask_lss(Joining step, Time now);
  void end_joining(bool found);

  // NMT commands
  void command_all(nmt::Command command, Time now);
  void send_commands(Time now);
  bool send_command(nmt::Command command, std::uint8_t node, Time now);
  void want_command(std::uint8_t node, Time now) {
    commanded_.insert(node);
    wake_at(now);
  }
  void start_sent(std::uint8_t node, Time now);

  void look_at_nodes(Time now);
  void look_at(std::uint8_t node, Time now);
  bool counts(const Frame& frame, NodeMonitor::News news);
  void guard(std::uint8_t node, Time now);
  void send_guard_requests(Time now);
  Time guard_due(std::uint8_t node) const;
  Time heartbeat_due(std::uint8_t node) const;
  Time next_look(std::uint8_t node) const;
  void wake_at(Time time) { due_ = earlier(due_, time); }

  Device& own_;
  NodeMonitor& monitor_;
  CanPort& port_;
  ManagerApplication& application_;
  NetworkObjects objects_;
  bool active_ = false;
  bool begins_ = false;        ///< at the next poll
  bool ends_ = false;          ///< inactive, but aborts may be waiting for the port
  bool starts_ = false;        ///< the next poll looks for nodes to start
  bool inputs_again_ = false;  ///< the own node has become Operational: its inputs may be out of date
  bool own_held_ = false;      ///< the own node is not to be started here
  bool started_all_ = false;
  bool outputs_written_ = false;        ///< by the PLC, since power-on
  bool plc_lost_ = false;               ///< until it writes outputs
  bool boot_is_over_ = false;           ///< 1F89h has passed
  bool broadcasts_ = false;             ///< broadcast_ is waiting for the port
  nmt::Command broadcast_{};            ///< to all nodes
  std::uint8_t mandatory_unready_ = 0;  ///< mandatory nodes that are not in kReady or beyond
  std::uint8_t mandatory_missing_ = 0;  ///< see Node::missing
  std::uint8_t clients_in_use_ = 0;
  std::uint8_t listed_ = 0;
  std::uint16_t sdo_timeout_ms_;
  Time due_ = kNever;       ///< no node's deadline is earlier
  Time retry_at_ = kNever;  ///< an NMT command is waiting for the port, or for the inhibit time
  Time command_from_ = 0;   ///< by the inhibit time, 102Ah
  Time boot_over_at_ = kNever;
  std::array<std::uint8_t, kPhases> count_{};  ///< of listed nodes
  std::array<Node, nmt::kMaxNode + 1> nodes_{};
  NodeSet ready_;      ///< wait for a client
  NodeSet silent_;     ///< wait for the first client, the only one for nodes that may not respond
  NodeSet commanded_;  ///< wait for an NMT command, which follows from their phase
  NodeSet delayed_;    ///< boot too often
  NodeSet answering_;  ///< have answered, perhaps too late: the next probe waits longer
  NodeSet asked_;      ///< wait for a node guarding request
  NodeSet listening_;  ///< their heartbeats are almost overdue: no requests
  NodeSet absent_;     ///< do not respond: a module without a node ID may be theirs
  NodeSet unwell_;
  NodeSet lost_;
  NodeSet twins_;
  NodeSet stopped_;           ///< by this, as the PLC is silent
  std::uint8_t served_ = 0;   ///< the node that got a client last
  std::uint8_t joining_ = 0;  ///< the node that LSS serves; 0 = none
  std::uint8_t joined_ = 0;   ///< or has served last
  Joining step_{};
  LssMaster* lss_ = nullptr;
  Time lss_from_ = 0;
  std::array<std::uint8_t, kMostSources> sources_{};  ///< node whose TPDO an own RPDO receives, 0 = not known
  std::array<Client, kServices.manager_clients> clients_;
};

}  // namespace cbcan
