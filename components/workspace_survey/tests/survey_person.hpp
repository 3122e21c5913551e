#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string>

#include "common/core/units.hpp"
#include "common/survey/visible.hpp"

namespace phantom::workspace_survey {

/// A person who sees the spot of a head and puts it on corners of a part: wholly on the face, as near to the
/// corner as that goes.
struct SurveyPerson {
  const survey::PartModel& part;
  geometry::Pose X_WO;
  survey::RangeHead mounted;  ///< as the head is really mounted
  survey::HeadErrors errors;

  /// Returns the middle of a spot that touches both edges of a face at a corner.
  Eigen::Vector3d spot_at_W_m(const survey::VisibleFace& face, std::uint32_t node) const {
    const auto place = [&](std::uint32_t n) -> Eigen::Vector3d { return X_WO * part.nodes_O_m[n]; };
    const auto loop = std::find_if(part.loops.begin(), part.loops.end(), [&](const survey::BorderLoop& l) {
      return l.face == face.face && std::find(l.nodes.begin(), l.nodes.end(), node) != l.nodes.end();
    });
    const std::size_t n = loop->nodes.size(),
                      i = static_cast<std::size_t>(std::find(loop->nodes.begin(), loop->nodes.end(), node) -
                                                   loop->nodes.begin());
    const Eigen::Vector3d corner = place(node);
    const survey::Reading at = *survey::aim(mounted, corner);
    const Eigen::Vector3d beam = survey::beam_direction_W(mounted, at);
    const auto across = [&](std::uint32_t to) -> Eigen::Vector3d {
      const Eigen::Vector3d edge = place(to) - corner;
      return (edge - beam.dot(edge) * beam).normalized();
    };
    const Eigen::Vector3d a = across(loop->nodes[(i + 1) % n]), b = across(loop->nodes[(i + n - 1) % n]);
    const double half_rad = 0.5 * std::acos(std::clamp(a.dot(b), -1.0, 1.0));
    const double off_m = 1.1 * survey::spot_radius_m(errors, at.range_m) / std::sin(half_rad);
    const double inwards = loop->turn_rad[i] < 0.0 ? -1.0 : 1.0;  // the notches' corners turn the other way
    return corner + survey::displacement_on_face_m(inwards * off_m * (a + b).normalized(), beam,
                                                   X_WO.rotation * part.faces[face.face].normal_O);
  }

  /// Returns what the person types for a corner: `aim` and two angles.
  std::string aim_line(const Eigen::Vector3d& p_W_m) const {
    const survey::Reading at = *survey::aim(mounted, p_W_m);
    std::ostringstream line;
    line.precision(10);
    line << "aim " << at.pan_rad / core::kRadPerDegree << ' ' << at.tilt_rad / core::kRadPerDegree << '\n';
    return line.str();
  }

  /// Returns a face's lines: aim and measure at each corner, or the name of an earlier node.
  std::string face_lines(const survey::VisibleFace& face, std::map<std::uint32_t, std::size_t>& names) const {
    std::string lines;
    for (const std::uint32_t node : face.nodes) {
      const auto [known, is_new] = names.try_emplace(node, names.size() + 1);
      lines += is_new ? aim_line(spot_at_W_m(face, node)) + "measure\n"
                      : "=" + std::to_string(known->second) + "\n";
    }
    return lines + (face.closed ? "done\n" : "part\n");
  }
};

}  // namespace phantom::workspace_survey
