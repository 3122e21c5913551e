// Sensors of a structured segment: polygons at both ends, lines between their corners.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/robot/skin/skin_parts.hpp"

namespace phantom::robot::detail {
namespace {

using core::Status;

/// Corners of both ends (the end points of the shell lines), and the number K of spans along each line.
struct Shell {
  std::vector<Eigen::Vector3d> from, to;
  int spans = 1;
};

double chord_m(double radius_m, int sides) { return 2.0 * radius_m * std::sin(std::numbers::pi / sides); }

std::string mm(double metres) { return std::to_string(metres * 1e3) + " mm"; }

/// Returns the fewest sides whose chord is below the pitch.
int fewest_sides(double radius_m, double pitch_m) {
  if (chord_m(radius_m, 3) < pitch_m) return 3;
  int sides =
      std::max(3, static_cast<int>(std::numbers::pi / std::asin(std::min(1.0, pitch_m / (2.0 * radius_m)))));
  while (chord_m(radius_m, sides) >= pitch_m) ++sides;
  return sides;
}

/// Returns the fewest spans of which each is strictly below the pitch.
double fewest_spans(double length_m, double pitch_m) { return std::floor(length_m / pitch_m) + 1.0; }

std::string check_polygon(const char* name, const std::vector<PolygonPoint>& polygon) {
  const std::string place = std::string(name) + ": ";
  if (polygon.size() < 3) return place + std::to_string(polygon.size()) + " corners; allowed: 3 or more";
  double greatest = 0.0;
  for (std::size_t p = 0; p < polygon.size(); ++p) {
    const PolygonPoint& corner = polygon[p];
    if (!(corner.r_m >= 0.0) || !(corner.r_m < 100.0) || !std::isfinite(corner.psi_rad))
      return place + "corner " + std::to_string(p) +
             ": r must be 0 or more and below 100 m, its angle finite";
    greatest = std::max(greatest, corner.r_m);
  }
  return greatest > 0.0 ? "" : place + "all corners lie on the axis";
}

std::string check_shape(const SkinSegment& segment) {
  const bool finite =
      segment.from_m.allFinite() && segment.to_m.allFinite() && std::isfinite(segment.spin_rad);
  if (!finite) return "positions and spin must be finite numbers";
  if (!((segment.to_m - segment.from_m).norm() > 1e-6))
    return "both ends are the same point; a length above 0 is needed";
  if (segment.from_polygon.empty()) {
    if (!segment.to_polygon.empty()) return "to_polygon: stands without from_polygon";
    if (!(segment.from_radius_m >= 0.0) || !(segment.to_radius_m >= 0.0) ||
        !(std::max(segment.from_radius_m, segment.to_radius_m) > 0.0) ||
        !(std::max(segment.from_radius_m, segment.to_radius_m) < 100.0)) {
      return "radii must be 0 or more, one of them above 0, and below 100 m";
    }
  } else {
    if (std::string fault = check_polygon("from_polygon", segment.from_polygon); !fault.empty()) return fault;
    if (!segment.to_polygon.empty()) {
      if (std::string fault = check_polygon("to_polygon", segment.to_polygon); !fault.empty()) return fault;
      if (segment.to_polygon.size() != segment.from_polygon.size()) {
        return "to_polygon: " + std::to_string(segment.to_polygon.size()) +
               " corners; allowed: " + std::to_string(segment.from_polygon.size()) +
               ", as many as from_polygon has";
      }
    }
  }
  return check_sensor(segment.gain, segment.cluster);
}

/// Returns two unit vectors that span the plane across `axis`. They depend on the axis alone, so that a
/// layout can be reproduced.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across(const Eigen::Vector3d& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = (Eigen::Vector3d::Unit(least) - axis[least] * axis).normalized();
  return {u, axis.cross(u)};
}

/// Returns the corners of one end.
std::vector<Eigen::Vector3d> ring(const Eigen::Vector3d& centre_m, const Eigen::Vector3d& axis,
                                  double spin_rad, const std::vector<PolygonPoint>& corners) {
  const auto [u, v] = across(axis);
  std::vector<Eigen::Vector3d> points;
  for (const PolygonPoint& corner : corners) {
    const double angle = spin_rad + corner.psi_rad;
    points.push_back(centre_m + corner.r_m * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return points;
}

std::vector<PolygonPoint> regular_polygon(double radius_m, int sides) {
  std::vector<PolygonPoint> corners;
  for (int p = 0; p < sides; ++p) corners.push_back({radius_m, 2.0 * std::numbers::pi * p / sides});
  return corners;
}

core::Expected<Shell> regular_shell(const SkinSegment& segment, const Eigen::Vector3d& axis, double pitch_m) {
  const double radius = std::max(segment.from_radius_m, segment.to_radius_m);
  const int least = fewest_sides(radius, pitch_m);
  if (segment.sides && *segment.sides < least) {
    return Status::invalid_argument("sides: " + std::to_string(*segment.sides) + "; allowed: at least " +
                                    std::to_string(least) + " on a radius of " + mm(radius) +
                                    ", which is needed for a pitch below " + mm(pitch_m));
  }
  const int sides = segment.sides.value_or(least);
  return Shell{ring(segment.from_m, axis, segment.spin_rad, regular_polygon(segment.from_radius_m, sides)),
               ring(segment.to_m, axis, segment.spin_rad, regular_polygon(segment.to_radius_m, sides))};
}

/// Adds points on the edges of both polygons until neighbours are closer than the pitch.
Shell subdivided(const Shell& coarse, double pitch_m) {
  Shell fine;
  for (std::size_t p = 0; p < coarse.from.size(); ++p) {
    const std::size_t next = (p + 1) % coarse.from.size();
    const Eigen::Vector3d top = coarse.from[next] - coarse.from[p], bottom = coarse.to[next] - coarse.to[p];
    const double parts = fewest_spans(std::max(top.norm(), bottom.norm()), pitch_m);
    for (double i = 0.0; i < parts; i += 1.0) {
      fine.from.push_back(coarse.from[p] + i / parts * top);
      fine.to.push_back(coarse.to[p] + i / parts * bottom);
    }
  }
  return fine;
}

core::Expected<Shell> polygon_shell(const SkinSegment& segment, const Eigen::Vector3d& axis, double pitch_m) {
  const auto& bottom = segment.to_polygon.empty() ? segment.from_polygon : segment.to_polygon;
  const Shell given{ring(segment.from_m, axis, segment.spin_rad, segment.from_polygon),
                    ring(segment.to_m, axis, segment.spin_rad, bottom)};
  if (!segment.sides) {
    double needed = 0.0;
    for (std::size_t p = 0; p < given.from.size(); ++p) {
      const std::size_t next = (p + 1) % given.from.size();
      needed += std::max((given.from[next] - given.from[p]).norm(), (given.to[next] - given.to[p]).norm()) /
                pitch_m;
    }
    if (needed > 1e6) return Status::invalid_argument("needs more than a million sensors around");
    return subdivided(given, pitch_m);
  }
  if (static_cast<std::size_t>(*segment.sides) != given.from.size()) {
    return Status::invalid_argument("sides: " + std::to_string(*segment.sides) + "; allowed: " +
                                    std::to_string(given.from.size()) + ", the number of corners, or auto");
  }
  for (const auto* corners : {&given.from, &given.to}) {
    for (std::size_t p = 0; p < corners->size(); ++p) {
      const std::size_t next = (p + 1) % corners->size();
      const double apart = ((*corners)[next] - (*corners)[p]).norm();
      if (apart < pitch_m) continue;
      return Status::invalid_argument(std::string(corners == &given.from ? "from_polygon" : "to_polygon") +
                                      ": corners " + std::to_string(p) + " and " + std::to_string(next) +
                                      " are " + mm(apart) + " apart; allowed: below " + mm(pitch_m) +
                                      ", or sides: auto");
    }
  }
  return given;
}

/// Sets K from the given number of rings, which must be fine enough, or else to the fewest spans.
std::optional<Status> choose_spans(const SkinSegment& segment, double pitch_m, Shell& shell) {
  double longest = 0.0;
  for (std::size_t p = 0; p < shell.from.size(); ++p)
    longest = std::max(longest, (shell.to[p] - shell.from[p]).norm());
  const double spans = fewest_spans(longest, pitch_m);
  if (spans > 1e6) return Status::invalid_argument("needs more than a million sensors");
  const int least_rings = static_cast<int>(spans) + 1;
  if (segment.rings && *segment.rings < least_rings) {
    return Status::invalid_argument("rings: " + std::to_string(*segment.rings) + "; allowed: at least " +
                                    std::to_string(least_rings) + " on a length of " + mm(longest) +
                                    ", which is needed for a pitch below " + mm(pitch_m));
  }
  shell.spans = segment.rings.value_or(least_rings) - 1;
  return std::nullopt;
}

/// Area of the four-sided patch a b c d: the mean of its two triangulations.
double patch_m2(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d) {
  const auto triangle = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r) {
    return 0.5 * (q - p).cross(r - p).norm();
  };
  return 0.5 * (triangle(a, b, c) + triangle(a, c, d) + triangle(a, b, d) + triangle(b, c, d));
}

/// Area between the lines of corner p and the next corner, from share t0 to t1 of the lines.
double strip_m2(const Shell& shell, std::size_t p, double t0, double t1) {
  const std::size_t next = (p + 1) % shell.from.size();
  const auto at = [&](std::size_t corner, double t) -> Eigen::Vector3d {
    return shell.from[corner] + t * (shell.to[corner] - shell.from[corner]);
  };
  return patch_m2(at(p, t0), at(next, t0), at(next, t1), at(p, t1));
}

/// Area of the round segment from share t0 to t1 of its axis.
double band_m2(const SkinSegment& segment, double t0, double t1) {
  const double taper = segment.to_radius_m - segment.from_radius_m;
  const double slant = std::hypot((segment.to_m - segment.from_m).norm(), taper);
  return std::numbers::pi * (2.0 * segment.from_radius_m + (t0 + t1) * taper) * slant * (t1 - t0);
}

}  // namespace

core::Expected<std::vector<PlacedSensor>> sensors_of(const SkinSegment& segment, const PartRules& rules) {
  if (const std::string fault = check_shape(segment); !fault.empty()) return Status::invalid_argument(fault);
  const double pitch = rules.pitch_of(segment.cluster);
  const Eigen::Vector3d axis = (segment.to_m - segment.from_m).normalized();
  const bool regular = segment.from_polygon.empty();
  if (regular && std::max(segment.from_radius_m, segment.to_radius_m) > 1e5 * pitch)
    return Status::invalid_argument("needs more than a million sensors");
  auto shell = regular ? regular_shell(segment, axis, pitch) : polygon_shell(segment, axis, pitch);
  if (!shell) return shell.status();
  if (const auto fault = choose_spans(segment, pitch, *shell)) return *fault;
  const std::size_t sides = shell->from.size();
  if (const auto fault = check_capacity(static_cast<double>(sides) * (shell->spans + 1), rules))
    return *fault;

  std::vector<PlacedSensor> sensors;
  for (int k = 0; k <= shell->spans; ++k) {
    const double spans = shell->spans, t = k / spans;
    const double before = std::max(0.0, (k - 0.5) / spans), after = std::min(1.0, (k + 0.5) / spans);
    for (std::size_t p = 0; p < sides; ++p) {
      const double area = regular ? band_m2(segment, before, after) / static_cast<double>(sides)
                                  : 0.5 * (strip_m2(*shell, p, before, after) +
                                           strip_m2(*shell, (p + sides - 1) % sides, before, after));
      sensors.push_back(
          {shell->from[p] + t * (shell->to[p] - shell->from[p]), area, segment.gain, segment.cluster});
    }
  }
  return sensors;
}

}  // namespace phantom::robot::detail
