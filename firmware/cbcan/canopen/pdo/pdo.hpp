// SPDX-License-Identifier: MIT
#pragma once

/// Process data (CiA 301, 7.2.2): the RPDOs and TPDOs that a dictionary describes, up to 512 each way.
/// Objects: 1400h+n and 1600h+n (RPDO n+1), 1800h+n and 1A00h+n (TPDO n+1); gaps are fine, and a sub-index
/// that does not exist means 0. MPDOs are not supported.
///
/// Configured at run time by the procedure of CiA 301, 7.5.2.36 (make it invalid, mapping sub 0 = 0, write
/// entries, set sub 0, make it valid). check() rejects everything else:
///
///   0602 0000h, 0609 0011h  mapping: there is no such object or sub-index
///   0604 0041h              mapping: that object cannot be mapped this way, or its length differs
///   0604 0042h              mapping: more than 64 objects or 64 bits
///   0609 0030h              COB-ID of 29 bits or restricted, or changed while valid; undefined transmission
///                           type; SYNC start value above 240
///   0800 0022h              not while the PDO is valid: mapping, inhibit time, SYNC start value; not while
///                           sub 0 is not 0: mapping entries; not without a valid mapping: making it valid
///
/// A mapping entry may be set to 0 (unused), but sub 0 must not count it. A PDO that is valid from the start
/// with an invalid mapping stays off.
///
/// Decided where CiA 301 leaves it open: event-driven TPDOs are sent once when the node becomes Operational
/// or they become valid; an RTR for one of them is an event; synchronous ones are sampled at that time too,
/// so that an RTR before the first SYNC returns data. Bit 30 of a TPDO's COB-ID (no RTR) applies to every
/// type, also to the two that only an RTR triggers. Limits of objects do not apply to RPDOs.
///
/// Nothing blocks, nothing is allocated; not re-entrant. A frame that the port refuses is tried again after
/// kRetryInterval, before later frames.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cbcan/can_port.hpp"
#include "cbcan/canopen/dictionary/object_dictionary.hpp"
#include "cbcan/canopen/dictionary/objects.hpp"
#include "cbcan/canopen/part.hpp"
#include "cbcan/canopen/pdo/mapping.hpp"
#include "cbcan/frame.hpp"
#include "cbcan/time.hpp"

namespace cbcan {

/// The application of the process data. From these functions it may call changed() and request() of Pdo.
class PdoApplication {
 public:
  /// Bring the values that TPDOs carry up to date: some are sampled next.
  virtual void refresh(Time now) = 0;
  /// The data of an RPDO are in the dictionary.
  virtual void on_written(Time now) = 0;
  /// A SYNC: the data of synchronous RPDOs are in the dictionary, synchronous TPDOs are sampled next.
  virtual void on_sync(Time now) = 0;
  /// RPDO `number`, 1..512: Pdo::kTooShort (it was ignored), kTooLong (the rest was ignored), kTimedOut
  /// (once, until it is received again).
  virtual void on_pdo_error(std::uint16_t emergency_code, std::uint16_t number, Time now) = 0;
  /// No RPDO has this error any more: each has been received correctly, or is off.
  virtual void on_pdo_error_over(std::uint16_t emergency_code, Time now) = 0;

 protected:
  ~PdoApplication() = default;
};

class Pdo : public Part {
 public:
  // Emergency error codes (CiA 301, 7.2.7.1).
  static constexpr std::uint16_t kTooShort = 0x8210;
  static constexpr std::uint16_t kTooLong = 0x8220;
  static constexpr std::uint16_t kTimedOut = 0x8250;

  // Transmission types (CiA 301, 7.5.2.35 and 7.5.2.37).
  static constexpr std::uint8_t kAcyclic = 0;
  static constexpr std::uint8_t kLastSynchronous = 240;
  static constexpr std::uint8_t kRemoteSynchronous = 252;
  static constexpr std::uint8_t kRemoteEvent = 253;
  static constexpr std::uint8_t kFirstEvent = 254;
  static constexpr bool is_synchronous(std::uint8_t type) { return type <= kLastSynchronous; }
  /// The PDO with the parameters `index` may have it; the others are reserved.
  static constexpr bool is_type(std::uint16_t index, std::uint32_t type) {
    return type <= kLastSynchronous ||
           type >= (index < object::kTpdoParameter ? kFirstEvent : kRemoteSynchronous);
  }

  /// Microseconds since an epoch of Pdo's own, which it moves on before they could overflow.
  using Ticks = std::uint32_t;

  /// What both kinds of PDO have.
  struct Common {
    PdoMapping mapping;
    Ticks timer_at = 0;
    std::uint32_t timer = 0;   ///< us
    std::uint16_t number = 0;  ///< from 0
    std::uint8_t type = 0;
    bool active = false;

    void begin(std::uint16_t n) {
      number = n;
      mapping.forget();
    }
  };

  /// Room for one RPDO; the content is Pdo's.
  struct Rpdo : Common {
    bool fresh = false;       ///< data waits for the SYNC
    bool received = false;    ///< since forget_received()
    bool just_waits = false;  ///< synchronous, without a timer, and the only one with its CAN-ID
    bool ignored = false;
    std::uint16_t id = 0;
    std::uint16_t next = 0;                                   ///< see first_of_
    std::uint16_t error = 0;                                  ///< its emergency error code, 0 = none
    std::array<std::uint8_t, PdoMapping::kMostBytes> data{};  ///< as received; a synchronous RPDO's wait
  };

  /// Room for one TPDO; the content is Pdo's.
  struct Tpdo : Common {
    std::uint8_t start_value = 0;
    std::uint8_t syncs_left = 0;     ///< until it is sent; 0 = the first has not arrived
    bool remote = false;             ///< RTR allowed
    bool event = false;              ///< type 0: to be sent at the next SYNC
    bool wanted = false;             ///< to be sent as soon as inhibit time and port allow
    bool windowed = false;           ///< wanted because of a SYNC, so not after the window
    std::uint32_t inhibit_time = 0;  ///< us
    Ticks inhibited_until = 0;
    Frame frame;  ///< as sampled last

    /// True if values are sampled when they are sent.
    bool is_sampled_late() const { return type >= kRemoteEvent; }
  };

  /// The number of RPDOs, or of TPDOs, that a dictionary describes. `first`: object::kRpdoParameter or
  /// kTpdoParameter.
  static std::size_t count(std::span<const ObjectEntry> entries, std::uint16_t first);

  /// The caller's memory. If the dictionary describes more, the PDOs with the highest numbers do not work.
  struct Storage {
    std::span<Rpdo> rpdos;
    std::span<Tpdo> tpdos;
    /// Memory for the mappings, divided equally among all PDOs, RPDOs first: for each PDO as many as it may
    /// map objects.
    std::span<PdoMapping::Piece> pieces;
  };

  /// All outlive it. It does nothing before reset().
  Pdo(ObjectDictionary& dictionary, CanPort& port, const Storage& storage, PdoApplication& application)
      : dictionary_(dictionary), port_(port), application_(application), room_(storage) {}

  static constexpr bool owns(std::uint16_t index) {
    return index >= object::kRpdoParameter && index <= object::kLastPdo;
  }
  AbortCode check(std::uint16_t index, std::uint8_t sub, std::uint32_t number) const;
  /// If the PDO stays valid, data waiting to be sent or for a SYNC are dropped and its timer restarts.
  void configure(std::uint16_t index, Time now);
  /// Counts the PDOs; load_one() loads them. Not Operational until on_state().
  void reset(std::uint8_t node_id, Time now);
  /// Loads PDO k, from 0, after reset(). False: there are no more, and all are ready.
  bool load_one(std::size_t k, Time now);
  /// PDOs are exchanged in Operational only. What is waiting when it is left is dropped.
  void on_state(nmt::State state, Time now);
  /// Data or RTR. For a data frame only the valid RPDOs whose CAN-ID has the same place in a hash table of 32
  /// are checked. True: deadline() may have changed.
  bool on_frame(const Frame& frame, Time now) {
    if (!operational_) return false;
    if (frame.flags != 0) return on_remote(frame, now);
    Rpdo* const addressed = with_id(frame.id, first_of_[place_of(frame.id)]);
    if (addressed == nullptr) return false;
    if (addressed->just_waits && fits_as_before(*addressed, frame)) {
      if (now <= window_end_) keep(*addressed, frame);
      return false;
    }
    receive_all(*addressed, frame, now);
    return true;
  }

  /// A SYNC with this counter, 0 = none: applies RPDOs, calls the application, samples and sends TPDOs.
  /// Synchronous PDOs are valid for `window` (1007h) after it, 0 = without limit. True: deadline() has
  /// changed.
  bool on_sync(std::uint8_t counter, Time window, Time now);

  /// The event of all TPDOs that map this object.
  void changed(std::uint16_t index, std::uint8_t sub);
  /// Any values may have changed: the event of all TPDOs whose data differ from the last sample.
  void look_for_changes(Time now);
  /// The event of TPDO `number`, 1..512, or of all, 0.
  void request(std::uint16_t number, Time now);

  /// RPDO `number`, from 0, has been received since it was last forgotten, or since reset().
  bool has_received(std::size_t number) const { return number < rpdos_.size() && rpdos_[number].received; }
  void forget_received(std::size_t number) {
    if (number < rpdos_.size()) rpdos_[number].received = false;
  }
  /// RPDO `number`, from 0, is not received until it is no longer ignored, or until reset().
  void ignore(std::size_t number, bool ignored);
  /// RPDO `number`, from 0, has these data, as if they had been received; also if it is ignored.
  void put(std::size_t number, std::uint64_t data, Time now);
  /// The mapped objects of all RPDOs have the values that were received last again.
  void restore_received() const;

  /// What TPDOs carry. After each change all of them are due, as if the node had become Operational.
  enum class Outputs : std::uint8_t { kValues, kZeros, kNone };
  void send_outputs(Outputs outputs, Time now);

  void poll(Time now);
  /// May be too early, never too late.
  Time deadline() const {
    return due_ == kNoTick ? kNever : now_ + static_cast<Time>(static_cast<std::int32_t>(due_ - ticks_));
  }

  /// CAN-IDs of the valid RPDOs and of valid TPDOs that answer an RTR. Only reset() and configure() change
  /// them.
  void visit_ids(auto visit) const {
    for (const Rpdo& rpdo : rpdos_)
      if (rpdo.active) visit(std::uint32_t{rpdo.id});
    for (const Tpdo& tpdo : tpdos_)
      if (tpdo.active && tpdo.remote) visit(tpdo.frame.id);
  }

 private:
  static constexpr std::size_t kPlaces = 32;
  static constexpr Ticks kNoTick = ~Ticks{0};  ///< never
  static constexpr Ticks kMost = 1U << 31;     ///< the epoch moves when it is that long ago
  static constexpr Ticks kPast = 1U << 27;     ///< how long it is ago then: more than any timer

  /// CAN-IDs of one kind of PDO increase with the node ID; those of one node differ by 100h and 80h.
  static constexpr std::size_t place_of(std::uint32_t id) { return (id ^ id >> 5) % kPlaces; }
  /// PDOs up to the last valid one.
  template <class Kind>
  struct Used {
    Kind* first = nullptr;
    Kind* last = nullptr;  ///< one after it
    Kind* begin() const { return first; }
    Kind* end() const { return last; }
  };

  void begin(Time now);
  /// `at` since an epoch later by this.
  static void move(Ticks& at, Ticks by) {
    if (at != kNoTick) at = at > by ? at - by : 0;
  }

  std::uint32_t parameter(std::uint16_t index, std::uint8_t sub) const {
    return static_cast<std::uint32_t>(dictionary_.get(index, sub));
  }
  AbortCode check_mapping(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const;
  AbortCode check_cob_id(std::uint16_t index, std::uint32_t value, std::uint32_t current) const;
  AbortCode take_mapping(std::uint16_t index, std::uint32_t count, bool again) const;
  bool has_mapping(std::uint16_t index) const;
  std::span<PdoMapping::Piece> pieces_of(std::size_t place) const;
  std::uint32_t load_common(Common& pdo, std::uint16_t index, bool after_reset);
  void load(Rpdo& rpdo, bool after_reset);
  void load(Tpdo& tpdo, bool after_reset);
  template <class Kind>
  static Used<Kind> used(std::span<Kind> pdos);
  void index_rpdos();
  void find_tpdos();
  void start(Rpdo& rpdo);
  void start(Tpdo* first, Tpdo* last, bool send);

  bool receive(Rpdo& rpdo, const Frame& frame);
  bool fits(Rpdo& rpdo, std::size_t length);
  /// RPDO k, from 1, or the next one in its list, with this CAN-ID; null = none.
  Rpdo* with_id(std::uint32_t id, std::uint16_t k) {
    for (; k != 0; k = rpdos_[k - 1u].next)
      if (rpdos_[k - 1u].id == id) return &rpdos_[k - 1u];
    return nullptr;
  }
  static bool fits_as_before(const Rpdo& rpdo, const Frame& frame) {
    return frame.length == rpdo.mapping.bytes() && rpdo.error == 0;
  }
  /// Keeps the data until the SYNC.
  static void keep(Rpdo& rpdo, const Frame& frame) {
    rpdo.data = frame.data;
    rpdo.fresh = true;
    rpdo.received = true;
  }
  void receive_all(Rpdo& first, const Frame& frame, Time now);
  void drop_windowed();
  bool on_remote(const Frame& frame, Time now);
  void sample_and_send(std::uint8_t counter);
  void on_event(Tpdo& tpdo);
  void want(Tpdo& tpdo) {
    tpdo.wanted = true;
    tpdo.windowed = false;
    due_ = std::min(due_, due_of(tpdo));
  }
  Ticks due_of(const Tpdo& tpdo) const {
    return tpdo.wanted ? std::max(tpdo.inhibited_until, retry_at_) : tpdo.timer_at;
  }
  void sample(Tpdo& tpdo) {
    if (outputs_ == Outputs::kZeros) [[unlikely]]
      tpdo.frame.data = {};
    else
      tpdo.mapping.sample(dictionary_, tpdo.frame.data);
  }
  void send(Tpdo& tpdo);
  void go_on();

  void notify(auto call);
  void update();
  void note(std::uint16_t emergency_code, Rpdo& rpdo);

  bool operational_ = false;
  Outputs outputs_ = Outputs::kValues;
  /// The application is being called: what it asks to be sent waits until it returns.
  bool notifying_ = false;
  ObjectDictionary& dictionary_;
  CanPort& port_;
  PdoApplication& application_;
  Used<Rpdo> used_rpdos_;
  Used<Tpdo> used_tpdos_;
  std::span<Rpdo> rpdos_;  ///< by number
  std::span<Tpdo> tpdos_;
  Ticks ticks_ = 0;  ///< the same as now_: the epoch is now_ - ticks_
  Ticks due_ = kNoTick;
  Ticks retry_at_ = 0;  ///< the port has no room until then
  Time window_end_ = kNever;
  Time now_ = 0;  ///< of the call
  Storage room_;
  /// Lists by place_of(id): first RPDO, from 1, of a list linked by Rpdo::next.
  std::array<std::uint16_t, kPlaces> first_of_;
};

}  // namespace cbcan
