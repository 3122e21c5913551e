#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/can/can_bus.hpp"
#include "components/simulated_drive/homing.hpp"
#include "components/simulated_drive/motor.hpp"
#include "components/simulated_drive/object_dictionary.hpp"
#include "components/simulated_drive/sdo_server.hpp"

namespace phantom::simulated_drive {

struct DriveOptions {
  int node = 1;
  MotorParameters motor;
  double following_window_rad =
      0.2;                          ///< at power-up (0x6065): the position error at the joint that is a fault
  double quick_stop_rad_s2 = 20.0;  ///< deceleration at the joint
  bool incremental = false;     ///< its encoder counts from 0 where it stands at power-up, until it was homed
  HomingSwitches switches;      ///< turn is set by the encoder
  bool keeps_max_speed = true;  ///< object 0x6080 limits it in torque mode
  /// Digital inputs (bits of 0x60FD) that an enabling switch on its terminals closes while it is held; 0:
  /// none.
  std::uint32_t enabling_inputs = 0;
};

/// Faults that can be injected into a drive.
struct Misbehaviour {
  bool mute_heartbeat = false;
  bool mute_pdos = false;
  bool mute_measurement = false;  ///< the second of its transmit PDOs: velocity and torque
  bool mute_sdo = false;
  std::int8_t shown_mode = 0;      ///< displayed mode of operation, if not the true one; 0: the true one
  std::uint8_t cut_pdo_bytes = 0;  ///< number of bytes by which its PDOs are too short
  bool refuse_enable = false;
  bool refuse_reset = false;               ///< its fault lasts
  bool refuse_sdo = false;                 ///< every write is refused
  std::uint16_t other_status_bits = 0;     ///< set in its statusword
  std::uint16_t lacks_object = 0;          ///< as a drive without this object: it cannot be written
  bool keep_brake = false;                 ///< its brake does not open
  bool only_show_following_error = false;  ///< goes on in spite of it
  bool ignore_max_speed = false;           ///< as a drive that has no object 0x6080
  bool mute_inputs = false;                ///< the third of its transmit PDOs: digital inputs
  std::uint32_t stuck_inputs = 0;          ///< digital inputs that stay closed
  bool stuck_encoder = false;              ///< position and velocity stay as when it began
  bool mirrored_encoder = false;           ///< it counts the other way from where it stood when it began
  bool frozen_feedback = false;            ///< position, velocity and torque stay as when it began
  std::uint8_t pad_pdo_bytes = 0;          ///< its PDOs are filled with zeros up to this length
  std::int64_t count_jump = 0;             ///< added to its position, modulo 2^32
  double garbage_speed_rad_s = 0.0;        ///< amplitude of random velocity that it reports; 0: the true one
  bool negated_velocity = false;           ///< of what it reports; its position is right
  bool keeps_remote_bit = false;           ///< refuses a TPDO's COB-ID without bit 30, as many real drives do
  bool hides_mode_unpowered = false;       ///< displays mode 0 unless operation is enabled
  double mode_late_s = 0.0;                ///< for so long after 0x6060 was written, mode −1 is displayed
};

/// Simulates a CiA 402 servo drive as seen from the bus: CiA 301 services, the power state machine, cyclic
/// synchronous position, velocity and torque, quick stop and faults, with motor, gear, friction and encoder.
/// It shares no encoding with the master's side, so that the two check each other. Not real-time safe.
class SimulatedDrive {
 public:
  SimulatedDrive(const DriveOptions& options, std::unique_ptr<can::CanBus> bus);

  /// Processes received frames, advances the motor to `now_ns` and sends what is due. Call it about every
  /// millisecond or when the bus has received something. The first call is the power-up.
  void step(core::Nanoseconds now_ns);
  void wait(core::Nanoseconds timeout_ns) { bus_->wait(timeout_ns); }

  /// Puts the drive into fault, with an emergency code of CiA 402.
  void trip(std::uint16_t emergency_code);
  /// Sends an emergency message without going into fault.
  void warn(std::uint16_t emergency_code, std::uint8_t error_register = 1);
  /// Interrupts the logic supply: the drive boots and has lost everything but the motor's position.
  void power_cycle();
  /// Holds the enabling switch on its terminals, or lets it go.
  void hold_switch(bool held) { switch_held_ = held; }
  /// The contact of the switch on its lowest input stays closed.
  void stick_contact() { misbehaviour.stuck_inputs = options_.enabling_inputs & -options_.enabling_inputs; }
  /// Interrupts the supply of the power stage.
  void cut_power() { state_ = Power::kSwitchOnDisabled; }
  Misbehaviour misbehaviour;
  /// Whether what it says of its motion is false.
  bool lies() const;

  enum class Power { kSwitchOnDisabled, kReady, kSwitchedOn, kEnabled, kQuickStop, kFaultReaction, kFault };
  enum class Nmt { kPreOperational, kOperational, kStopped };
  Power power() const { return state_; }
  const Motor& motor() const { return loops_.motor(); }
  /// Position as the drive knows it.
  std::int64_t counts() const { return motor().counts() - zero_counts_; }
  /// Forgets where home is, as after damage to its encoder; its counts stay.
  void lose_reference() { homed_ = false; }
  double torque_mille() const { return torque_mille_; }
  const can::CanBus& bus() const { return *bus_; }
  int node() const { return options_.node; }
  const ObjectDictionary& dictionary() const { return od_; }

 private:
  struct Pdo {  // as configured in the dictionary
    bool on = false;
    std::uint32_t cob = 0;
    std::uint8_t transmission = 1;
    std::vector<std::uint32_t> mapping;
  };
  void build_communication_objects();
  void listen_to_own();
  void build_profile_objects();
  void boot();
  AbortCode write_object(std::uint16_t index, std::uint8_t sub, const std::vector<std::uint8_t>& bytes);
  AbortCode check_mapping(std::uint16_t index, std::uint8_t sub, std::uint32_t value) const;
  Pdo pdo(std::uint16_t communication) const;
  void take(const can::CanFrame& frame);
  void take_nmt(std::uint8_t command);
  void take_rpdo(const Pdo& rpdo, const can::CanFrame& frame);
  void on_sync();
  void report_motion();
  void send_tpdo(std::uint16_t communication);
  void send(std::uint32_t cob, const std::vector<std::uint8_t>& bytes);
  void leave_operational();
  void abort_connection();
  void obey_controlword();
  void leave_enabled(std::int64_t option);
  void watch();
  void forget_position();
  MotionDemand home(double dt_s);
  void watch_following();
  void move(double dt_s);
  MotionDemand demand(double dt_s);
  void run_quick_stop(double dt_s);
  std::uint16_t statusword() const;
  std::int64_t displayed_mode() const;
  void begin_interpolation();
  double within_limits(double counts);
  double velocity_within_limits();

  DriveOptions options_;
  std::unique_ptr<can::CanBus> bus_;
  ObjectDictionary od_;
  SdoServer sdo_;
  MotionLoops loops_;
  Homing homing_;
  std::int64_t zero_counts_ = 0;  // true angle of the motor at count 0
  bool homed_ = true, start_bit_ = false, switch_held_ = false;
  Power state_ = Power::kSwitchOnDisabled;
  Nmt nmt_ = Nmt::kPreOperational;
  bool booted_ = false, following_error_ = false, limited_ = false;
  core::Nanoseconds now_ns_ = 0, moved_ns_ = 0, heartbeat_ns_ = 0, master_heartbeat_ns_ = -1,
                    off_track_ns_ = -1;
  std::uint16_t last_controlword_ = 0;
  std::array<std::vector<std::uint8_t>, 4> latched_;  // RPDOs waiting for the next SYNC
  std::array<int, 4> syncs_{};                        // SYNCs since each TPDO was sent
  std::array<core::Nanoseconds, 4> rpdo_ns_{};        // when each RPDO came last; 0: its timer does not run
  core::Nanoseconds mode_written_ns_ = 0;
  std::optional<std::int64_t> lie_began_counts_;  // where a stuck or mirrored encoder stood when that began
  std::uint32_t garbage_ = 1;                     // state of a random number generator
  double demand_counts_ = 0.0,
         demand_speed_ = 0.0;  // interpolated position; velocity that is ramped down
  double torque_mille_ = 0.0;
  double torque_sum_mille_s_ = 0.0, torque_sum_s_ = 0.0;  // since the last SYNC
  double to_go_s_ = 0.0;
  double closing_s_ = 0.0;  // for how long its brake has been closing at the end of a stop
};

}  // namespace phantom::simulated_drive
