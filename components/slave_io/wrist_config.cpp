#include "components/slave_io/wrist_config.hpp"

#include <algorithm>

#include "common/can/bus_load.hpp"
#include "common/can/drive_config.hpp"
#include "common/can/user_bus.hpp"
#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/robot/kinematics/joint_values.hpp"

namespace phantom::slave_io {
namespace {

using runtime::Fields;

// A sample may be missing once without being noticed.
constexpr double kPeriodsUntilStale = 2.0;

std::string text(double value) { return std::to_string(value); }

void read_mount(const Fields& section, const robot::SerialArm& arm, teleop::WristSensorParameters& sensor) {
  const auto frame = arm.find_frame(section.text("link"));
  const robot::Link& last = arm.links().back();
  section.check(frame && frame->first == arm.joint_count(), "link",
                "is no link behind the last joint, where all that it carries is rigid; allowed: " +
                    last.name + ", or a link that is fixed to it");
  sensor.link = frame->first;
  sensor.X_LS = frame->second * section.pose("pose");
}

void read_rated(const Fields& section, const std::string& key, double threshold, Eigen::Vector3d& rated) {
  section.vector3(key, rated);
  section.check(rated.allFinite() && rated.minCoeff() > threshold, key,
                "is not above the threshold; allowed: more than " + text(threshold) + " along each axis");
}

void read_tare(const Fields& section, const robot::SerialArm& arm, teleop::WristSensorParameters& sensor) {
  section.flag("needed", sensor.needs_tare);
  section.number("time_s", sensor.tare_s);
  section.number("most_N", sensor.most_offset_N);
  section.number("most_Nm", sensor.most_offset_Nm);
  sensor.still =
      robot::by_joint_type(arm, section.value("still_rad_s", 0.01), section.value("still_m_s", 0.005));
}

void read_frames(const Fields& section, double rate_Hz, WristSensorConfig& config) {
  static const std::vector<std::string> kChannels(can::kWrenchNames.begin(), can::kWrenchNames.end());
  can::WrenchFrames& frames = config.frames;
  section.text("address", config.address);
  section.choice("identifiers", frames.extended, {{"standard", false}, {"extended", true}});
  section.choice("byte_order", frames.big_endian, {{"little", false}, {"big", true}});
  using enum can::NumberKind;
  section.choice("number", frames.kind, {{"signed", kSigned}, {"unsigned", kUnsigned}, {"float", kFloat}});
  section.number("bytes", frames.bytes);
  frames.set_s = 0.5 / rate_Hz;
  section.number("set_s", frames.set_s);
  section.check(
      frames.set_s < 1.0 / rate_Hz, "set_s",
      "is as long as from one wrench to the next; allowed: less than " + text(1.0 / rate_Hz) + " s");
  std::size_t read = 0;
  section.named("channels", kChannels, [&](const Fields& own, std::size_t c) {
    own.number("id", frames.channels[c].id);
    own.number("byte", frames.channels[c].first);
    own.number("scale", frames.channels[c].scale);
    own.number("zero", frames.channels[c].zero);
    ++read;
  });
  section.check(read == kChannels.size(), "channels",
                "has " + std::to_string(read) +
                    " of the six numbers; allowed: force_x, force_y, force_z, torque_x, torque_y, torque_z");
  for (const Fields& own : section.sections("status")) {
    can::StatusBits& status = frames.status.emplace_back();
    own.number("id", status.id);
    own.number("byte", status.byte);
    own.number("mask", status.mask);
    own.number("good", status.good);
  }
  const core::Status status = can::check(frames);
  section.check(static_cast<bool>(status), "channels", status ? "" : "describes " + status.message());
}

// On a bus of the drives the sensor's frames count into its load, and are no node's.
void check_shared_bus(const Fields& section, const runtime::DrivesConfig& drives,
                      const WristSensorConfig& config) {
  const auto bus = std::ranges::find(drives.addresses, config.address);
  if (bus == drives.addresses.end()) return;
  const auto b = static_cast<std::size_t>(bus - drives.addresses.begin());
  const std::vector<std::uint32_t> ids = can::ids_of(config.frames);
  const double bits =
      static_cast<double>(ids.size()) * can::worst_case_bits(8, config.frames.extended) * config.rate_Hz;
  const double share = can::bus_load(drives.group, b).share + bits / drives.group.bit_rates[b];
  section.check(share <= drives.group.load_budget, "rate_Hz",
                "makes the load of " + config.address + " " + text(100.0 * share) +
                    " % with its drives; allowed: at most " + text(100.0 * drives.group.load_budget) + " %");
  for (const can::AxisConfig& axis : drives.group.axes) {
    for (const std::uint32_t id : ids) {
      section.check(
          config.frames.extended || axis.bus != b || static_cast<int>(id & 0x7F) != axis.node, "can",
          "uses id " + std::to_string(id) + ", which is that of node " + std::to_string(axis.node) + " on " +
              config.address + "; allowed: an identifier that CANopen gives to no drive there");
    }
  }
}

}  // namespace

std::string check_wrist_bus(const WristSensorConfig& config) {
  if (config.address.empty()) return "";
  constexpr core::Nanoseconds kListen_ns = core::kNsPerSecond;
  auto opened = can::open_bus(config.address);
  if (!opened && can::is_user_address(config.address) && opened.status().code() == core::ErrorCode::kNotFound)
    return "\n  force sensor on " + config.address + ": the bus is not there yet";
  if (!opened) throw core::MissingError(opened.status().message());
  can::WrenchAssembly assembly(config.frames);
  can::Received received;
  const core::Nanoseconds until_ns = core::monotonic_ns() + kListen_ns;
  for (core::Nanoseconds now_ns = 0; (now_ns = core::monotonic_ns()) < until_ns;) {
    (*opened)->wait(until_ns - now_ns);
    while ((*opened)->receive(received)) {
      if (!received.is_frame() || !assembly.take(received.frame, received.time_ns)) continue;
      return "\n  force sensor on " + config.address +
             (assembly.wrench().valid ? ": measures" : ": says that it does not measure");
    }
  }
  throw core::MissingError("force_torque_sensor: no whole measurement on " + config.address +
                           " within a second; is it powered, and are its frames as configured?");
}

double force_lag_s(const WristSensorConfig& config, double period_s) {
  return config.sensor_lag_s + config.sensor.filter_s + 1.0 / config.rate_Hz + period_s;
}

WristSensorConfig read_wrist_sensor(const Fields& section, const robot::SerialArm& arm,
                                    const runtime::DrivesConfig* drives) {
  WristSensorConfig config;
  teleop::WristSensorParameters& sensor = config.sensor;
  bool by_can = false;
  section.choice("source", by_can, {{"topic", false}, {"can", true}});
  read_mount(section, arm, sensor);
  section.number("rate_Hz", config.rate_Hz);
  section.number("staleness_s", sensor.staleness_s);
  section.check(sensor.staleness_s >= kPeriodsUntilStale / config.rate_Hz, "staleness_s",
                "is less than two of the sensor's periods; allowed: at least " +
                    text(kPeriodsUntilStale / config.rate_Hz) + " s");
  section.number("sensor_lag_s", config.sensor_lag_s);
  section.number("filter_s", sensor.filter_s);
  section.number("threshold_N", sensor.threshold_N);
  section.number("threshold_Nm", sensor.threshold_Nm);
  read_rated(section, "rated_N", sensor.threshold_N, sensor.rated_N);
  read_rated(section, "rated_Nm", sensor.threshold_Nm, sensor.rated_Nm);
  section.number("payload_kg", sensor.payload_kg);
  section.vector3("payload_centre_m", sensor.payload_centre_m);
  read_tare(section.section("tare"), arm, sensor);
  if (by_can || section.has("can")) {
    const Fields can = section.section("can");
    section.check(section.has("can"), "can", "is missing; allowed: the sensor's bus and frames");
    read_frames(can, config.rate_Hz, config);
    if (drives != nullptr) check_shared_bus(section, *drives, config);
  }
  if (!by_can) config.address.clear();
  return config;
}

}  // namespace phantom::slave_io
