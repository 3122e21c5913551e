#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"

namespace phantom::runtime {

/// Graded fluid around an object (spec 1.4, 1.5). Layer 1 touches the surface.
struct LayerProfileConfig {
  std::vector<int> thickness_vox;     ///< per layer, ≥ 1
  std::vector<double> mu_Pa_s_per_m;  ///< per layer, strictly positive, falling outwards; same length
  double mu_skin_Pa_s_per_m = 100.0;  ///< at and inside the surface, ≥ mu of layer 1
  int guard_vox = 0;  ///< protective band of order 0 around the surface, with the μ of layer 1
};

/// A body that stands in the cell.
struct ObjectConfig {
  std::string name;
  std::filesystem::path mesh;                     ///< any format that assimp reads
  double mesh_scale = 1.0;                        ///< metres per mesh unit (0.001 for millimetres)
  bool y_up = false;                              ///< mesh has +y up; default +z
  geometry::Pose X_WO;                            ///< object frame in the workspace frame
  LayerProfileConfig profile;                     ///< the cell's, unless the object has its own
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< linear RGB, 0…1
  geometry::Pose
      X_deviation;  ///< real pose = X_WO · X_deviation: what the simulated world does not tell the model
};

/// One skin segment of a link (spec 2.2): rings at both ends of its axis, in the link's frame.
struct SkinSegmentConfig {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_m = Eigen::Vector3d::Zero();
  double from_radius_m = 0.0;
  double to_radius_m = 0.0;
  std::optional<int>
      sides;  ///< sensors around a ring; absent: chosen so that their pitch is below the voxel size
  std::optional<int> rings;  ///< rings along the axis (K ≥ 2); absent: likewise
  double spin_rad = 0.0;     ///< rotation of the first vertex about the axis
  double gain = 1.0;         ///< SG
};

struct LinkSkinConfig {
  std::string link;  ///< URDF link name
  std::vector<SkinSegmentConfig> segments;
};

/// A point of the arm that is watched by name (spec 2.5, interest points): an elbow, a motor body.
struct InterestPointConfig {
  std::string name;
  std::string link;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
};

struct ArmConfig {
  std::string name;
  std::filesystem::path urdf;
  std::string tip_link;      ///< last link of the serial chain
  geometry::Pose X_WB;       ///< base link in the workspace frame
  std::vector<double> home;  ///< joint positions in rad or m, one per moving joint
  std::vector<LinkSkinConfig> skin;
  std::vector<InterestPointConfig> interest_points;
};

/// deploy/cells/<name>/cell.yaml, checked. Frames: W is the workspace frame, z up, metres.
struct CellConfig {
  std::string name;
  std::filesystem::path file;
  Eigen::Vector3d min_m;  ///< the workspace box in W
  Eigen::Vector3d max_m;
  double voxel_size_m = 0.005;
  std::vector<ObjectConfig> objects;  ///< object id on topics and in voxels = index + 1
  std::vector<ArmConfig> arms;

  /// The arm called `name`, or the only one if `name` is empty. Throws ConfigError naming the arms there are.
  const ArmConfig& arm(const std::string& arm_name = "") const;
};

/// Reads and checks a cell file. Throws ConfigError (file, line, key, value, what is allowed). Not real-time
/// safe.
CellConfig load_cell(const std::filesystem::path& path);

}  // namespace phantom::runtime
