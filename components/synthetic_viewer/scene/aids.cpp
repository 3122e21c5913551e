#include "components/synthetic_viewer/scene/aids.hpp"

#include <algorithm>

namespace phantom::synthetic_viewer {
namespace {

constexpr Colour kPgvColour{0.10F, 0.45F, 0.85F};
constexpr Colour kPlaneColour{0.25F, 0.62F, 0.92F};

/// Returns the frame at a point with z along `direction` (not zero).
geometry::Pose along(const Eigen::Vector3d& position_m, const Eigen::Vector3d& direction) {
  return {geometry::rotation_between(Eigen::Vector3d::UnitZ(), direction), position_m};
}

/// `heads`: one behind the other, at the tip.
void add_arrow(Frame& frame, const Eigen::Vector3d& from_m, const Eigen::Vector3d& arrow_m, double radius_m,
               const Colour& colour, int heads = 1) {
  constexpr double kBehind = 0.55;  // of a head's length
  const double length_m = arrow_m.norm();
  const double head_m =
      std::min({4.5 * radius_m, 0.6 * length_m, 0.9 * length_m / (1 + kBehind * (heads - 1))});
  const geometry::Pose base = along(from_m, arrow_m);
  frame.items.push_back(
      {kCylinder, matrix_of(base, {radius_m, radius_m, length_m - head_m}), colour, 1.0F, 0.55F});
  for (int head = 0; head < heads; ++head) {
    const geometry::Pose neck =
        along(from_m + arrow_m * (1 - (1 + kBehind * head) * head_m / length_m), arrow_m);
    frame.items.push_back(
        {kCone, matrix_of(neck, {2.4 * radius_m, 2.4 * radius_m, head_m}), colour, 1.0F, 0.55F});
  }
}

}  // namespace

Colour mix(const Colour& a, const Colour& b, double share) {
  const float t = static_cast<float>(std::clamp(share, 0.0, 1.0));
  return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

Colour closeness_colour(double closeness) {
  constexpr Colour kFar{0.05F, 0.42F, 0.62F}, kNear{0.98F, 0.78F, 0.05F}, kTouching{0.88F, 0.03F, 0.05F};
  return closeness < 0.5 ? mix(kFar, kNear, 2 * closeness) : mix(kNear, kTouching, 2 * closeness - 1);
}

Colour motion_colour(MotionClass motion) {
  // Chosen so that they, and the PGV's blue beside them, differ without red, green or blue cones, too.
  constexpr std::array<Colour, 4> kColours{
      {{0.13F, 0.13F, 0.14F}, {0.28F, 0.47F, 0.21F}, {0.87F, 0.47F, 0.05F}, {0.65F, 0.02F, 0.01F}}};
  return kColours.at(static_cast<std::size_t>(motion));
}

int motion_heads(MotionClass motion) {
  return motion == MotionClass::kDangerous ? 3 : motion == MotionClass::kNeutral ? 2 : 1;
}

double pgv_arrow_m(const Aids& aids, const PgvArrow& arrow) {
  constexpr double kMax_m = 0.15, kMin_m = 0.03;
  if (!aids.pgs_Pa_s_per_m || arrow.length == PgvLength::kGap)
    return std::clamp(aids.gap_m, 0.05 * aids.size, 0.12 * aids.size);
  const double s = *aids.pgs_Pa_s_per_m / arrow.half_strength_Pa_s_per_m;
  const double share = (arrow.length == PgvLength::kStrength ? s : 1.0) / (1.0 + s);
  return aids.size * std::max(kMin_m, kMax_m * share);
}

double aids_scale(double thickness_m, double gap_m, double size) {
  constexpr double kThick_m = 0.024, kWide_m = 0.05, kLeast = 0.1, kLeastByGap = 0.4;
  const double by_object = thickness_m > 0.0 ? thickness_m / (size * kThick_m) : 1.0;
  const double by_gap = std::max(kLeastByGap, gap_m / (size * kWide_m));
  return std::clamp(std::min(by_object, by_gap), kLeast, 1.0);
}

void add_arrows(Frame& frame, const Aids& aids, const PgvArrow& arrow) {
  constexpr double kLookAhead_s = 0.5, kMin_m_s = 0.005;
  const double speed = aids.velocity_m_s.norm();
  if (speed > aids.size * kMin_m_s) {
    const double length_m = std::clamp(speed * kLookAhead_s, 0.06 * aids.scale, 0.30 * aids.size);
    add_arrow(frame, aids.position_m, aids.velocity_m_s / speed * length_m, 0.006 * aids.scale,
              motion_colour(aids.motion), motion_heads(aids.motion));
  }
  if (!aids.pgv.isZero()) {
    add_arrow(frame, aids.position_m,
              aids.pgv.normalized() * (aids.scale / aids.size * pgv_arrow_m(aids, arrow)), 0.004 * aids.scale,
              kPgvColour);
  }
}

void add_cone_and_plane(Frame& frame, const Aids& aids) {
  constexpr double kPlane_m = 0.13;
  if (aids.pgv.isZero()) return;
  const Eigen::Vector3d direction = aids.pgv.normalized();
  const double gap_m = std::clamp(aids.gap_m, 0.0, 0.25 * aids.size),
               length_m = std::max(gap_m, 0.04 * aids.scale);
  const Eigen::Vector3d tip_m = aids.position_m + gap_m * direction;
  const double radius_m = std::clamp(0.3 * length_m, 0.012 * aids.scale, 0.04 * aids.size);
  const geometry::Pose base = along(tip_m - length_m * direction, direction);
  frame.items.push_back({kCone, matrix_of(base, {radius_m, radius_m, length_m}),
                         closeness_colour(aids.closeness), 0.45F, 0.5F});
  // Slightly in front of the surface that it touches, because the two would flicker otherwise.
  const geometry::Pose plane = along(tip_m - 0.001 * aids.size * direction, direction);
  frame.items.push_back({kDisc, matrix_of(plane, {kPlane_m * aids.scale, kPlane_m * aids.scale, 1.0}),
                         kPlaneColour, 0.28F, 0.6F});
}

void add_marker(Frame& frame, const Eigen::Vector3d& position_m, double radius_m, const Colour& colour) {
  const geometry::Pose pose{Eigen::Matrix3d::Identity(), position_m};
  frame.items.push_back({kSphere, matrix_of(pose, Eigen::Vector3d::Constant(radius_m)), colour, 1.0F, 0.6F});
  frame.items.push_back(
      {kSphere, matrix_of(pose, Eigen::Vector3d::Constant(2.2 * radius_m)), colour, 0.22F, 0.8F});
}

}  // namespace phantom::synthetic_viewer
