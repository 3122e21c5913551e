#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/fusion/depth_noise.hpp"
#include "common/fusion/fusion_parameters.hpp"
#include "components/workspace_camera/file_camera.hpp"
#include "components/workspace_camera/openni_camera.hpp"
#include "components/workspace_camera/pose_check.hpp"

namespace phantom::workspace_camera {

enum class CameraDriver : std::uint8_t { kTopic, kSimulated, kFiles, kOpenNi };

/// Where a simulated camera's images come from.
struct SimulatedOptions {
  fusion::PinholeCamera camera;
  double rate_hz = 15.0, latency_s = 0.03;
  fusion::DepthNoise noise;
  std::uint64_t seed = 1;
};

struct CameraConfig {
  std::string name;
  CameraDriver driver = CameraDriver::kTopic;
  geometry::Pose X_FC;  ///< camera in the frame of `link`, or in W
  std::string link;     ///< of the arm; empty: fixed in W
  std::string place;    ///< in the configuration: "workspace_camera.yaml:9: cameras[0]"
  SimulatedOptions simulated;
  FileOptions files;
  OpenNiOptions openni;
};

/// A thing in the world of simulated cameras that the model does not know. Times count from the start.
struct Thing {
  enum class Shape : std::uint8_t { kBox, kBall, kCylinder };
  std::string name;
  Shape shape = Shape::kBox;
  Eigen::Vector3d size_m = Eigen::Vector3d::Constant(0.1);
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero(), to_m = Eigen::Vector3d::Zero();
  double trip_s = 0.0, appears_s = 0.0, stays_s = 0.0, every_s = 0.0;
  bool steel = false;

  /// Returns whether it is there.
  bool is_there(double time_s) const noexcept;
  /// Returns where its middle is in W: it sways between its ends like a pendulum.
  Eigen::Vector3d middle_m(double time_s) const noexcept;
};

/// An object of the cell that somebody moves in the world of simulated cameras; the model does not know it.
struct Displacement {
  std::string object;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();  ///< W axes
  double from_s = 0.0;                             ///< after the start
  std::string place;                               ///< in the configuration
};

enum class OnLoss : std::uint8_t { kKeep, kEnd };

/// A part of the workspace with a policy of its own for unknown space.
struct UnknownRegionConfig {
  Eigen::Vector3d min_m = Eigen::Vector3d::Zero(), max_m = Eigen::Vector3d::Zero();  ///< W
  fusion::UnknownPolicy policy = fusion::UnknownPolicy::kIgnore;
};

/// The checked content of workspace_camera.yaml.
struct WorkspaceCameraConfig {
  std::string arm;  ///< empty: the cell's only one, or none
  double status_rate_hz = 4.0, heartbeat_s = 0.1, whole_every_s = 2.0;
  double late_s = 0.2, dead_s = 0.4;
  OnLoss on_loss = OnLoss::kKeep;
  fusion::FusionParameters fusion;                   ///< without the grid and its regions
  std::vector<UnknownRegionConfig> unknown_regions;  ///< later ones prevail
  PoseCheckRules pose_check;
  std::vector<CameraConfig> cameras;
  std::vector<Thing> things;
  std::vector<Displacement> displaced;

  bool has(CameraDriver driver) const;
};

extern const char* const kParameters;  ///< the shipped workspace_camera.yaml

/// Reads and checks a configuration. Throws runtime::ConfigError (file, line, key, value, what is allowed).
WorkspaceCameraConfig load_config(const std::filesystem::path& path);

/// Returns the pose of a camera that is held upright at `eye_m` and looks at `target_m`, which is not
/// straight above or below it.
geometry::Pose looking_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m);

}  // namespace phantom::workspace_camera
