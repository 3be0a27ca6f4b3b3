// SPDX-License-Identifier: MIT
#pragma once

/// Indices of the objects that CiA 301 defines, each with its section there.

#include <cstdint>

namespace cbcan::object {

inline constexpr std::uint16_t kDeviceType = 0x1000;             ///< 7.5.2.1
inline constexpr std::uint16_t kErrorRegister = 0x1001;          ///< 7.5.2.2
inline constexpr std::uint16_t kErrorHistory = 0x1003;           ///< 7.5.2.4, pre-defined error field
inline constexpr std::uint16_t kSyncCobId = 0x1005;              ///< 7.5.2.5
inline constexpr std::uint16_t kSyncPeriod = 0x1006;             ///< 7.5.2.6, us
inline constexpr std::uint16_t kSyncWindow = 0x1007;             ///< 7.5.2.7, us
inline constexpr std::uint16_t kDeviceName = 0x1008;             ///< 7.5.2.8
inline constexpr std::uint16_t kHardwareVersion = 0x1009;        ///< 7.5.2.9
inline constexpr std::uint16_t kSoftwareVersion = 0x100A;        ///< 7.5.2.10
inline constexpr std::uint16_t kGuardTime = 0x100C;              ///< 7.5.2.11, ms
inline constexpr std::uint16_t kLifeTimeFactor = 0x100D;         ///< 7.5.2.12
inline constexpr std::uint16_t kStore = 0x1010;                  ///< 7.5.2.13
inline constexpr std::uint16_t kRestore = 0x1011;                ///< 7.5.2.14
inline constexpr std::uint16_t kTimeCobId = 0x1012;              ///< 7.5.2.15
inline constexpr std::uint16_t kEmergencyCobId = 0x1014;         ///< 7.5.2.17
inline constexpr std::uint16_t kEmergencyInhibitTime = 0x1015;   ///< 7.5.2.18, 100 us
inline constexpr std::uint16_t kConsumerHeartbeatTime = 0x1016;  ///< 7.5.2.19, ms
inline constexpr std::uint16_t kProducerHeartbeatTime = 0x1017;  ///< 7.5.2.20, ms
inline constexpr std::uint16_t kIdentity = 0x1018;               ///< 7.5.2.21
inline constexpr std::uint16_t kSyncCounterOverflow = 0x1019;    ///< 7.5.2.22
inline constexpr std::uint16_t kErrorBehaviour = 0x1029;         ///< 7.5.2.32
inline constexpr std::uint16_t kSdoServerParameter = 0x1200;     ///< 7.5.2.33
// Each the first of 512.
inline constexpr std::uint16_t kRpdoParameter = 0x1400;  ///< 7.5.2.35
inline constexpr std::uint16_t kRpdoMapping = 0x1600;    ///< 7.5.2.36
inline constexpr std::uint16_t kTpdoParameter = 0x1800;  ///< 7.5.2.37
inline constexpr std::uint16_t kTpdoMapping = 0x1A00;    ///< 7.5.2.38
inline constexpr std::uint16_t kLastPdo = 0x1BFF;

// Objects of a CANopen manager (CiA 302-2 and -3); where there is a sub-index, it is a node ID.
inline constexpr std::uint16_t kNmtInhibitTime = 0x102A;     ///< between two NMT commands, 100 us
inline constexpr std::uint16_t kConfigurationDate = 0x1020;  ///< of every device: 1 = date, 2 = time
inline constexpr std::uint16_t kConciseDcf = 0x1F22;
inline constexpr std::uint16_t kConfigureSlave = 0x1F25;  ///< written "conf"
inline constexpr std::uint8_t kAllSlaves = 128;           ///< its sub-index for all of them
inline constexpr std::uint16_t kExpectedDate = 0x1F26;    ///< of the configuration: 1020h:01
inline constexpr std::uint16_t kExpectedTime = 0x1F27;    ///< 1020h:02
inline constexpr std::uint16_t kNmtStartup = 0x1F80;
inline constexpr std::uint16_t kSlaveAssignment = 0x1F81;
inline constexpr std::uint16_t kExpectedDeviceType = 0x1F84;    ///< 1000h
inline constexpr std::uint16_t kExpectedVendor = 0x1F85;        ///< 1018h:01
inline constexpr std::uint16_t kExpectedProduct = 0x1F86;       ///< 1018h:02
inline constexpr std::uint16_t kExpectedRevision = 0x1F87;      ///< 1018h:03
inline constexpr std::uint16_t kExpectedSerial = 0x1F88;        ///< 1018h:04
inline constexpr std::uint16_t kBootTime = 0x1F89;              ///< ms, for the mandatory slaves
inline constexpr std::uint16_t kRestoreConfiguration = 0x1F8A;  ///< sub-index of 1011h to be written first

// Program download (CiA 302-3), each with the program's number as sub-index.
inline constexpr std::uint16_t kProgramData = 0x1F50;
inline constexpr std::uint16_t kProgramControl = 0x1F51;
inline constexpr std::uint16_t kProgramIdentification = 0x1F56;
inline constexpr std::uint16_t kFlashStatus = 0x1F57;

// Objects of this library's manager.
inline constexpr std::uint16_t kRpdoSource = 0x300A;  ///< sub-index = RPDO: node, flags, mapping of its TPDO
inline constexpr std::uint16_t kOutputsMode =
    0x300B;  ///< 0 = TPDOs after the first write of outputs, 1 = at once
inline constexpr std::uint16_t kSlaveSdoTimeout = 0x300D;  ///< sub-index = node: ms, 0 = the manager's
inline constexpr std::uint16_t kSlaveLss = 0x3010;  ///< sub-index = node: 1 = it may have to get its ID by LSS

// Areas (7.4.1, table 33).
inline constexpr std::uint16_t kFirstCommunication = 0x1000;
inline constexpr std::uint16_t kLastCommunication = 0x1FFF;
inline constexpr std::uint16_t kFirstManufacturer = 0x2000;
inline constexpr std::uint16_t kLastManufacturer = 0x5FFF;
inline constexpr std::uint16_t kFirstProfile = 0x6000;
inline constexpr std::uint16_t kLastProfile = 0x9FFF;
inline constexpr std::uint16_t kLast = 0xFFFF;

/// The parameter of an SDO server in addition to that of 1200h.
constexpr bool is_further_sdo_server(std::uint16_t index) {
  return index > kSdoServerParameter && index <= 0x127F;
}

inline constexpr std::uint32_t kInhibitUnit = 100;  ///< us, of an inhibit time

}  // namespace cbcan::object
