#include "common/runtime/configuration/pose_text.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "common/core/units.hpp"

namespace phantom::runtime {

core::Expected<geometry::Pose> parse_pose(const std::string& text) {
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::istringstream numbers(spaced);
  std::vector<double> values;
  for (double value; numbers >> value;) values.push_back(value);
  const bool all_finite =
      std::all_of(values.begin(), values.end(), [](double v) { return std::abs(v) < 1e6; });
  if (values.size() != 6 || !numbers.eof() || !all_finite) {
    return core::Status::invalid_argument(
        "'" + text + "'; allowed: six numbers, \"x y z roll pitch yaw\", in metres and degrees");
  }
  return geometry::Pose{
      geometry::rotation_from_rpy(values[3] * core::kRadPerDegree, values[4] * core::kRadPerDegree,
                                  values[5] * core::kRadPerDegree),
      {values[0], values[1], values[2]}};
}

std::string pose_text(const geometry::Pose& X) {
  const Eigen::Matrix3d& R = X.rotation;
  const double roll = std::atan2(R(2, 1), R(2, 2)), yaw = std::atan2(R(1, 0), R(0, 0)),
               pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const Eigen::Vector3d& p = X.translation_m;
  return fmt::format("{:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g}", p.x(), p.y(), p.z(),
                     roll / core::kRadPerDegree, pitch / core::kRadPerDegree + 0.0,
                     yaw / core::kRadPerDegree);  // + 0.0 avoids "-0"
}

}  // namespace phantom::runtime
