#include <set>

#include "common/core/units.hpp"
#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

robot::DhRow read_dh_row(const ConfigReader& reader) {
  robot::DhRow row;
  row.link = reader.text("link");
  row.joint = reader.text("joint", "");
  const bool slides = reader.choice("type", "revolute", {"revolute", "prismatic"}) == "prismatic";
  row.type = slides ? robot::JointType::kPrismatic : robot::JointType::kRevolute;
  row.theta_rad = reader.number("theta_deg", 0.0, {-360, 360, "degrees"}) * core::kRadPerDegree;
  row.alpha_rad = reader.number("alpha_deg", 0.0, {-360, 360, "degrees"}) * core::kRadPerDegree;
  row.d_m = reader.number("d_m", 0.0, {-100, 100, "m"});
  row.a_m = reader.number("a_m", 0.0, {-100, 100, "m"});
  const double unit = slides ? 1.0 : core::kRadPerDegree;
  const char* range_key = slides ? "range_m" : "range_deg";
  row.lower = -kInfinity;
  row.upper = kInfinity;
  if (slides || reader.has(range_key)) {  // a revolute joint may have no limits
    const auto range = reader.numbers(range_key, {-36000, 36000, slides ? "m" : "degrees"});
    if (range.size() != 2 || !(range[0] < range[1])) {
      throw reader.error(range_key, "is not [lower, upper] with lower below upper");
    }
    row.lower = range[0] * unit;
    row.upper = range[1] * unit;
  }
  row.max_speed = slides ? reader.number("max_speed_m_s", {1e-6, 100, "m/s"})
                         : reader.number("max_speed_deg_s", {1e-3, 36000, "degrees/s"}) * core::kRadPerDegree;
  row.max_effort = slides ? reader.number("max_force_N", {1e-6, 1e6, "N"})
                          : reader.number("max_torque_Nm", {1e-6, 1e6, "N·m"});
  row.mass_kg = reader.number("mass_kg", 0.0, {0, 1e5, "kg"});
  row.centre_of_mass_m = reader.vector3("centre_of_mass_m", row.centre_of_mass_m);
  return row;
}

void read_kinematics(const ConfigReader& reader, ArmConfig& arm) {
  if (reader.has("urdf") == reader.has("dh")) {
    throw reader.error(reader.has("dh") ? "dh" : "urdf",
                       reader.has("dh") ? "stands beside urdf; allowed: one of the two"
                                        : "is missing; allowed: urdf with tip_link, or dh");
  }
  if (reader.has("urdf")) {
    arm.urdf = reader.path("urdf");
    arm.tip_link = reader.text("tip_link");
    if (!std::filesystem::is_regular_file(arm.urdf))
      throw reader.error("urdf", "is not a file (" + arm.urdf.string() + ")");
    return;
  }
  const ConfigReader dh = reader.section("dh");
  arm.dh_convention = dh.choice("convention", "", {"classic", "modified"}) == "modified"
                          ? robot::DhConvention::kModified
                          : robot::DhConvention::kClassic;
  for (const auto& row : dh.sections("rows")) arm.dh.push_back(read_dh_row(row));
  if (arm.dh.empty()) throw dh.error("rows", "is empty; allowed: 1 to 16 rows");
  arm.tip_link = arm.dh.back().link;
}

void read_interest_points(const ConfigReader& reader, ArmConfig& arm) {
  std::set<std::string> names;
  for (const auto& point : reader.sections("interest_points")) {
    arm.interest_points.push_back({point.text("name"), point.text("link"), point.vector3("position_m")});
    if (!names.insert(arm.interest_points.back().name).second)
      throw point.error("name", "stands twice; allowed: each interest point once");
  }
  if (arm.interest_points.size() > kMostInterestPoints) {
    throw reader.error("interest_points", "has " + std::to_string(arm.interest_points.size()) +
                                              " entries; allowed: up to " +
                                              std::to_string(kMostInterestPoints));
  }
}

/// Reads the description of the arm itself, which does not depend on its mounting.
void read_body(const ConfigReader& reader, ArmConfig& arm) {
  arm.file = reader.file();
  read_kinematics(reader, arm);
  for (const auto& link : reader.sections("skin")) arm.skin.push_back(read_link_skin(link));
  read_interest_points(reader, arm);
}

}  // namespace

ArmConfig read_arm(const ConfigReader& reader) {
  ArmConfig arm;
  arm.name = read_name(reader);
  arm.X_WB = reader.pose("mount");
  if (reader.has("file")) {
    const ConfigReader own = ConfigReader::from_file(reader.path("file"));
    read_body(own, arm);
    arm.home = own.numbers("home");
    own.finish();
    if (reader.has("home")) arm.home = reader.numbers("home");
  } else {
    read_body(reader, arm);
    arm.home = reader.numbers("home");
  }
  for (const auto& contact : reader.sections("allowed_contact")) {
    arm.allowed_contact.push_back({contact.text("object"), contact.text("link", "")});
  }
  return arm;
}

}  // namespace phantom::runtime
