#include <set>

#include "common/core/units.hpp"
#include "common/runtime/cell/arm_file.hpp"
#include "common/runtime/cell/cell_parts.hpp"

namespace phantom::runtime {
namespace {

robot::DhRow read_dh_row(const Fields& fields) {
  robot::DhRow row;
  fields.text("link", row.link);
  fields.text("joint", row.joint);
  fields.choice("type", row.type,
                {{"revolute", robot::JointType::kRevolute}, {"prismatic", robot::JointType::kPrismatic}});
  fields.number("theta_deg", row.theta_rad, core::kRadPerDegree);
  fields.number("alpha_deg", row.alpha_rad, core::kRadPerDegree);
  fields.number("d_m", row.d_m);
  fields.number("a_m", row.a_m);
  const bool slides = row.type == robot::JointType::kPrismatic;
  const double unit = slides ? 1.0 : core::kRadPerDegree;
  const char* range_key = slides ? "range_m" : "range_deg";
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> range{-kInfinity, kInfinity};  // a revolute joint may have no limits
  fields.numbers(range_key, range);
  fields.check(range.size() == 2 && range[0] < range[1], range_key,
               "is not [lower, upper] with lower below upper");
  row.lower = range[0] * unit;
  row.upper = range[1] * unit;
  fields.number(slides ? "max_speed_m_s" : "max_speed_deg_s", row.max_speed, unit);
  fields.number(slides ? "max_force_N" : "max_torque_Nm", row.max_effort);
  fields.number("mass_kg", row.mass_kg);
  fields.vector3("centre_of_mass_m", row.centre_of_mass_m);
  std::vector<double> i(6, 0.0);  // xx, yy, zz, xy, xz, yz
  fields.numbers("inertia_kg_m2", i);
  fields.check(i.size() == 6, "inertia_kg_m2", "is not [xx, yy, zz, xy, xz, yz]");
  row.inertia_kg_m2 << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  return row;
}

void read_kinematics(const Fields& fields, ArmConfig& arm) {
  if (fields.one_of("urdf", "joints") == "urdf") {
    fields.text("tip_link", arm.tip_link);
    fields.numbers("held_joints", arm.held_joints);
    fields.numbers("gripper_closed", arm.gripper_closed);
    fields.numbers("lower_limits", arm.limits.lower);
    fields.numbers("upper_limits", arm.limits.upper);
    fields.numbers("max_speeds", arm.limits.max_speed);
    fields.numbers("max_efforts", arm.limits.max_effort);
    for (const auto& [joint, q] : arm.gripper_closed)
      fields.check(arm.held_joints.contains(joint), "gripper_closed",
                   "names " + joint +
                       ", which held_joints does not have at the gripper's widest; allowed: its joints");
    arm.urdf = fields.existing_file("urdf");
    return;
  }
  const Fields dh = fields.section("dh");
  dh.choice("convention", arm.dh_convention,
            {{"classic", robot::DhConvention::kClassic}, {"modified", robot::DhConvention::kModified}});
  for (const Fields& row : dh.sections("rows")) arm.dh.push_back(read_dh_row(row));
  dh.check(!arm.dh.empty(), "rows", "is empty; allowed: 1 to 16 rows");
  arm.tip_link = arm.dh.back().link;
}

void read_interest_points(const Fields& fields, ArmConfig& arm) {
  std::set<std::string> names;
  for (const Fields& point : fields.sections("interest_points")) {
    arm.interest_points.push_back({point.text("name"), point.text("link"), point.vector3("position_m")});
    point.check(names.insert(arm.interest_points.back().name).second, "name",
                "stands twice; allowed: each interest point once");
  }
  fields.check(arm.interest_points.size() <= kMaxInterestPoints, "interest_points",
               "has " + std::to_string(arm.interest_points.size()) + " entries; allowed: up to " +
                   std::to_string(kMaxInterestPoints));
}

void read_displaced(const Fields& fields, ArmConfig& arm) {
  for (const Fields& link : fields.sections("displaced")) {
    DisplacedLinkConfig& stated = arm.displaced.emplace_back();
    link.text("link", stated.link);
    link.number("volume_m3", stated.volume_m3);
    if (link.has("centre_m")) stated.centre_m = link.vector3("centre_m");
  }
}

/// Reads the description of the arm itself, which does not depend on its mounting.
void read_arm(const Fields& fields, ArmConfig& arm) {
  arm.file = fields.file();
  read_kinematics(fields, arm);
  for (const Fields& link : fields.sections("skin")) arm.skin.push_back(read_link_skin(link));
  read_displaced(fields, arm);
  read_interest_points(fields, arm);
  fields.numbers("home", arm.home);
}

}  // namespace

ArmConfig read_arm_file(const std::filesystem::path& file) {
  ArmConfig arm;
  arm.name = file.stem().string();
  const Fields own = Fields(file, cell_table()).as("arm");
  read_arm(own, arm);
  own.finish();
  return arm;
}

ArmConfig read_mounted_arm(const Fields& fields) {
  ArmConfig arm;
  arm.name = read_name(fields);
  arm.X_WB = fields.pose("mount");
  if (fields.has("file")) {
    const Fields own = Fields(fields.path("file"), cell_table()).as("arm");
    read_arm(own, arm);
    own.finish();
    fields.numbers("home", arm.home);
  } else {
    read_arm(fields.as("arm"), arm);
  }
  for (const Fields& contact : fields.sections("allowed_contact"))
    arm.allowed_contact.push_back({contact.text("object"), contact.text("link")});
  return arm;
}

}  // namespace phantom::runtime
