#include "common/messages/codecs/fields_codec.hpp"

#include <cmath>
#include <sstream>

#include "common/robot/kinematics/joint_values.hpp"

namespace phantom::messages {
namespace {

template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream stream;
  (stream << ... << parts);
  return stream.str();
}

}  // namespace

bool Decoder::in_range(const char* field, double value, double least, double most) {
  if (value >= least && value <= most) return true;  // false for NaN
  if (least == -kAnyNumber || !std::isfinite(value)) {
    refuse(text(field, " is not finite"));
  } else if (most == kAnyNumber) {
    refuse(text(field, " is ", value, "; allowed: ", least, " or more"));
  } else {
    refuse(text(field, " is ", value, "; allowed: ", least, " to ", most));
  }
  return false;
}

bool Decoder::counts(const char* field, const char* unit, std::size_t count, std::size_t least,
                     std::size_t most) {
  if (count >= least && count <= most) return true;
  refuse(least == 0 ? text(field, " has ", count, " ", unit, "; allowed: at most ", most)
                    : text(field, " has ", count, " ", unit, "; allowed: ", least, " to ", most));
  return false;
}

std::string Decoder::joint_text(const char* field, std::size_t joint) const {
  std::string name = text(field, "[", joint, "]");
  if (joint < arm_.joint_names.size()) name += " (" + arm_.joint_names[joint] + ")";
  return name;
}

void Decoder::stamp(const msg::Stamp& from, core::SampleId& to) {
  to = dds::id_of(from);
  if (to.sequence_number == 0) refuse("stamp.sequence_number is 0; allowed: 1 or more");
}

void Decoder::joint_count(std::uint32_t from, std::uint32_t& to) {
  to = joint_count_ = std::min(from, static_cast<std::uint32_t>(core::kMaxJoints));
  if (arm_.joint_count != 0 && from != arm_.joint_count)
    refuse(text("joint_count is ", from, "; allowed: ", arm_.joint_count, ", as the arm"));
  if (from == 0 || from > core::kMaxJoints)
    refuse(text("joint_count is ", from, "; allowed: 1 to ", core::kMaxJoints));
}

void Decoder::link(std::uint32_t from, std::uint32_t& to) {
  to = from;
  if (arm_.link_count != 0 && from >= arm_.link_count)
    refuse(text("link is ", from, "; allowed: 0 to ", arm_.link_count - 1));
}

void Decoder::joints(const char* field, const core::JointArray& from, core::JointArray& to, double least) {
  to = {};
  for (std::size_t j = 0; j < joint_count_; ++j) {
    to[j] = from[j];
    if (std::isfinite(from[j]) && from[j] >= least) continue;
    const std::string name = joint_text(field, j);
    in_range(name.c_str(), from[j], least, kAnyNumber);
  }
}

void Decoder::positions(const char* field, const core::JointArray& from, core::JointArray& to) {
  joints(field, from, to);
  for (std::size_t j = 0; j < std::min<std::size_t>(joint_count_, arm_.joint_count); ++j) {
    if (robot::near_limits(from[j], arm_.lower[j], arm_.upper[j])) continue;
    refuse(text(joint_text(field, j), " is ", from[j], "; allowed: ", arm_.lower[j], " to ", arm_.upper[j],
                " and ", 100.0 * robot::kLimitMarginShare, " % of that range beyond"));
  }
}

void Decoder::place(const char* field, const msg::Vector3& from, workspace::VoxelSize& to) {
  Eigen::Vector3d sides_m;
  place(field, from, sides_m);
  to = workspace::VoxelSize(sides_m);
}

void Decoder::number(const char* field, double from, workspace::VoxelSize& to, double least, double most) {
  in_range(field, from, least, most);
  to = workspace::VoxelSize(from);
}

void Decoder::pose(const char* field, const msg::Pose& from, geometry::Pose& to) {
  place(text(field, ".position_m").c_str(), from.position_m(), to.translation_m);
  to.rotation = rotation(field, from);
}

Eigen::Matrix3d Decoder::rotation(const char* field, const msg::Pose& from) {
  constexpr double kNormTolerance = 1e-3;
  const Eigen::Vector4d quaternion(from.qx(), from.qy(), from.qz(), from.qw());
  const double norm = quaternion.norm();
  if (std::abs(norm - 1.0) <= kNormTolerance) return geometry::rotation_from_quaternion(quaternion);
  refuse(text(field, "'s quaternion has length ", norm, "; allowed: 1"));
  return Eigen::Matrix3d::Identity();
}

void Decoder::placement(const char* field, const msg::Pose& from, Vector3& position_m,
                        std::array<double, 9>& R, double most_m) {
  vector(field, from.position_m(), position_m, most_m);
  Eigen::Map<Eigen::Matrix3d>(R.data()) = rotation(field, from);
}

void Encoder::stamp(msg::Stamp& to, const core::SampleId& from) {
  to.sequence_number(from.sequence_number);
  to.monotonic_ns(from.monotonic_ns);
  to.session(from.session);
}

void Encoder::placement(const char* field, msg::Pose& to, const Vector3& position_m,
                        const std::array<double, 9>& R, double) {
  pose(field, to,
       {Eigen::Map<const Eigen::Matrix3d>(R.data()), Eigen::Map<const Eigen::Vector3d>(position_m.data())});
}

void Encoder::pose(const char* field, msg::Pose& to, const geometry::Pose& from) {
  place(field, to.position_m(), from.translation_m);
  const Eigen::Vector4d quaternion = geometry::quaternion_xyzw(from.rotation);
  to.qx(quaternion[0]);
  to.qy(quaternion[1]);
  to.qz(quaternion[2]);
  to.qw(quaternion[3]);
}

}  // namespace phantom::messages
