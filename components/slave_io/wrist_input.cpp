#include "components/slave_io/wrist_input.hpp"

#include <vector>

#include "common/can/user_bus.hpp"

namespace phantom::slave_io {
namespace {

constexpr int kMaxFramesPerTick = 64;

// Events after which frames of the sensor may be missing or wrong. Others concern what this host sends.
constexpr std::uint16_t kDamaging =
    can::kErrorProtocol | can::kErrorOverflow | can::kErrorBusOff | can::kErrorDown | can::kErrorTransceiver;

}  // namespace

core::Status TareRequest::ask() {
  using teleop::TareRefusal;
  const int refusal = refusal_.load(std::memory_order_acquire);
  if (refusal == kNoSensor)
    return core::Status::invalid_argument(
        "tare: no sensor at the wrist is in use; allowed: with force_sensor and force_torque_sensor");
  switch (static_cast<TareRefusal>(refusal)) {
    case TareRefusal::kNotMeasured:
      return core::Status::invalid_argument("tare: the sensor does not measure; component_status says why");
    case TareRefusal::kMoves:
      return core::Status::invalid_argument("tare: the arm moves; allowed: at rest (tare.still_*)");
    case TareRefusal::kTouched:
      return core::Status::invalid_argument(
          "tare: the arm is touched, or the force is too great; allowed: up to tare.most_N and tare.most_Nm");
    case TareRefusal::kRuns:
      return core::Status::invalid_argument("tare: the sensor is being tared already");
    case TareRefusal::kNone:
      break;
  }
  requested_.store(true, std::memory_order_release);
  return core::Status::ok();
}

WristInput::WristInput(const ArmModel& model, const WristSensorConfig& config, Inbox& inbox,
                       std::unique_ptr<can::CanBus> bus)
    : model_(model),
      inbox_(inbox),
      bus_(std::move(bus)),
      sensor_(model.arm, config.sensor, model.tip_in_last_link_m) {
  if (!bus_) return;
  assembly_.emplace(config.frames);
  std::vector<can::CanFilter> filters;
  for (const std::uint32_t id : can::ids_of(config.frames))
    filters.push_back({.id = id,
                       .mask = config.frames.extended ? 0x1FFFFFFFU : 0x7FFU,
                       .extended = config.frames.extended});
  if (const core::Status status = bus_->set_filters(filters); !status)
    throw core::ConfigError(status.message());
}

void WristInput::read_topic() noexcept {
  if (!inbox_.wrist.read(received_)) return;
  sample_ = {
      {messages::eigen(received_.force_N), messages::eigen(received_.torque_Nm)}, received_.valid, true};
  received_ns_ = received_.received_ns;
}

// One wrench or event of a tick that is not sound makes it unsound as a whole.
void WristInput::read_bus() noexcept {
  can::Received received;
  bool damaged = false;
  for (int i = 0; i < kMaxFramesPerTick && bus_->receive(received); ++i) {
    if (!received.is_frame()) {
      if ((received.errors & kDamaging) == 0) continue;
      assembly_->drop();
      damaged = true;
    } else if (assembly_->take(received.frame, received.time_ns)) {
      const can::SentWrench& wrench = assembly_->wrench();
      const auto& n = wrench.values;
      sample_ = {{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}}, wrench.valid, true};
      received_ns_ = wrench.time_ns;
      damaged = damaged || !wrench.valid;
    }
  }
  if (damaged) sample_.valid = false;
}

void WristInput::step(SlaveReport& report, double dt_s, core::Nanoseconds now_ns) noexcept {
  const bool reset = report.outputs.reset == teleop::ResetOutcome::kReleased;
  if (reset && bus_ && bus_->state() == can::BusState::kDown && can::is_user_address(bus_->address()))
    static_cast<void>(bus_->restart());  // a failure shows in the sensor's silence
  sample_.fresh = false;
  bus_ ? read_bus() : read_topic();
  if (received_ns_ != 0) sample_.age_s = core::seconds(now_ns - received_ns_);
  if (inbox_.tare.take()) sensor_.tare();
  model_.arm.link_poses(report.position, X_WL_);
  const teleop::WristForce& force = sensor_.step(sample_, X_WL_, report.velocity, report.contact, dt_s);
  inbox_.tare.report(force.refusal);
  report.wrist = force;
  report.force_measured = force.measured();
  report.external_torque_Nm = force.torque_Nm;
  report.contact = report.contact || force.contact;
  report.contact_point_m = force.on_line_W_m;
  const bool known = force.measured() && (force.has_line || !report.contact);
  report.contact_force_N = !known ? -1.0 : report.contact ? force.force_N : 0.0;
}

std::string wrist_sentence(const teleop::WristForce& force, bool& hinders) {
  using teleop::TareState, teleop::WristState;
  hinders = true;
  switch (force.state) {
    case WristState::kSilent:
      return "the force sensor has not been heard yet";
    case WristState::kStale:
      return "force sensor lost: no force is measured";
    case WristState::kInvalid:
      return "the force sensor or its bus reports an error: no force is measured";
    case WristState::kSaturated:
      return "the force sensor is beyond its rated range: no force is measured";
    case WristState::kNotTared:
      if (force.tare == TareState::kNone)
        return "the force sensor has not been tared: slave_io command tare, with the arm at rest and free";
      break;
    default:
      hinders = false;
  }
  switch (force.tare) {
    case TareState::kRuns:
      return "the force sensor is being tared";
    case TareState::kMoved:
      return "the force sensor's tare has failed: the arm moved";
    case TareState::kTouched:
      return "the force sensor's tare has failed: the arm is touched, or the force is beyond tare.most";
    case TareState::kLost:
      return "the force sensor's tare has failed: it did not measure";
    default:
      return "";
  }
}

}  // namespace phantom::slave_io
