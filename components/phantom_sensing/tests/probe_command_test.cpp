// `phantom_sensing probe` from files to files, against the thesis's double sums written out over every
// sensor: with its own forward kinematics, voxel look-up and cluster zones, from the exported skin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include "common/robot/sensing/cluster_sensor.hpp"
#include "common/robot/tests/foreign_arms.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tools/probe.hpp"

namespace phantom::phantom_sensing::probe_command_test {
namespace {

const std::filesystem::path kBench = PHANTOM_SOURCE_DIR "/deploy/cells/arm_bench/cell.yaml";

std::filesystem::path temporary(const std::string& name) {
  const auto folder = std::filesystem::path(testing::TempDir()) / ("probe_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  return folder / name;
}

/// A CSV file as text cells by column.
struct Table {
  std::map<std::string, std::vector<std::string>> columns;
  std::size_t rows = 0;
  explicit Table(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::vector<std::string> names;
    for (std::string line; std::getline(file, line);) {
      std::istringstream cells(line);
      std::size_t i = 0;
      for (std::string cell; std::getline(cells, cell, ','); ++i) {
        if (rows == 0 && columns.size() == names.size() && names.size() == i) {
          names.push_back(cell);
        } else {
          columns[names.at(i)].push_back(cell);
        }
        if (rows == 0 && names.size() == i + 1 && !columns.contains(cell)) columns[names[i]];
      }
      rows = columns.begin()->second.size();
    }
  }
  double at(const std::string& column, std::size_t row) const {
    return std::stod(columns.at(column).at(row));
  }
};

struct Sensor {
  std::size_t link;
  Eigen::Vector3d p_m;
  double weight;
  int reach_vox;
  std::string shape;
};

std::vector<Sensor> read_skin(const std::filesystem::path& path) {
  const Table table(path);
  std::vector<Sensor> sensors;
  for (std::size_t i = 0; i < table.rows; ++i) {
    sensors.push_back({static_cast<std::size_t>(table.at("link", i)),
                       {table.at("x_m", i), table.at("y_m", i), table.at("z_m", i)},
                       table.at("weight", i),
                       static_cast<int>(table.at("reach_vox", i)),
                       table.columns.at("shape")[i]});
  }
  return sensors;
}

workspace::Index3 voxel_at(const workspace::Workspace& workspace, const Eigen::Vector3d& p_W_m) {
  const Eigen::Vector3d v = workspace.grid().to_voxels(p_W_m);
  return {static_cast<std::int32_t>(std::floor(v.x())), static_cast<std::int32_t>(std::floor(v.y())),
          static_cast<std::int32_t>(std::floor(v.z()))};
}

/// μ_e of a sensor: the voxel's, or Σ(SLA·SSA)/ΣSSA over its zone (eq. 6.1).
double felt(const Sensor& sensor, const workspace::Workspace& workspace, const Eigen::Vector3d& p_W_m) {
  const workspace::Index3 c = voxel_at(workspace, p_W_m);
  const int m = sensor.reach_vox;
  if (m == 0) return static_cast<double>(workspace.mu(c));
  double sum = 0.0, weights = 0.0;
  for (int x = -m; x <= m; ++x) {
    for (int y = -m; y <= m; ++y) {
      for (int z = -m; z <= m; ++z) {
        const double share = sensor.shape == "cube"     ? 1.0
                             : sensor.shape == "sphere" ? (x * x + y * y + z * z <= m * m ? 1.0 : 0.0)
                                                        : robot::fraction_in_sphere(x, y, z, m + 0.5);
        sum += share * static_cast<double>(workspace.mu({c.x + x, c.y + y, c.z + z}));
        weights += share;
      }
    }
  }
  return sum / weights;
}

/// T_l / θ'_l = Σ over sensors on links ≥ l of w·μ_e·d_l² (eqs. 5.29–5.35, C.9–C.11), prismatic Σ w·μ_e
/// (C.12), and the coupled torque −Σ w·μ_e·Jᵀ(J·v).
struct Literal {
  std::vector<double> coefficient, coupled_torque;
};

Literal literal(const robot::SerialArm& arm, const std::vector<Sensor>& skin,
                const workspace::Workspace& workspace, const std::vector<double>& q,
                const std::vector<double>& v) {
  const std::size_t n = arm.joint_count();
  std::vector<Eigen::Isometry3d> X_W(n + 1);
  std::vector<Eigen::Vector3d> axis(n), origin(n);
  const auto isometry = [](const geometry::Pose& pose) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.linear() = pose.rotation;
    X.translation() = pose.translation_m;
    return X;
  };
  X_W[0] = isometry(arm.base_pose());
  for (std::size_t j = 0; j < n; ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const Eigen::Isometry3d X_WJ = X_W[j] * isometry(joint.X_parent_joint);
    axis[j] = X_WJ.linear() * joint.axis;
    origin[j] = X_WJ.translation();
    X_W[j + 1] = joint.type == robot::JointType::kRevolute
                     ? X_WJ * Eigen::Isometry3d(Eigen::AngleAxisd(q[j], joint.axis))
                     : X_WJ * Eigen::Isometry3d(Eigen::Translation3d(q[j] * joint.axis));
  }
  Literal result{std::vector<double>(n), std::vector<double>(n)};
  for (const Sensor& sensor : skin) {
    const Eigen::Vector3d p = X_W[sensor.link] * sensor.p_m;
    const double mu = sensor.weight * felt(sensor, workspace, p);
    if (mu == 0.0) continue;
    std::vector<Eigen::Vector3d> column(sensor.link);
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < sensor.link; ++j) {
      const bool slides = arm.joints()[j].type == robot::JointType::kPrismatic;
      column[j] = slides ? axis[j] : Eigen::Vector3d(axis[j].cross(p - origin[j]));
      velocity += v[j] * column[j];
      const double d = slides ? 1.0 : (p - origin[j] - axis[j] * axis[j].dot(p - origin[j])).norm();
      result.coefficient[j] += mu * d * d;
    }
    for (std::size_t j = 0; j < sensor.link; ++j) result.coupled_torque[j] -= mu * column[j].dot(velocity);
  }
  return result;
}

struct Rows {
  std::vector<std::vector<double>> q, v;
};

/// Poses all over the joints' ranges, also at their ends, and speeds of either sign.
Rows wander(const robot::SerialArm& arm, std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Rows rows;
  for (std::size_t i = 0; i < count; ++i) {
    rows.q.emplace_back();
    rows.v.emplace_back();
    for (const robot::Joint& joint : arm.joints()) {
      const double low = std::max(joint.lower, -3.0), high = std::min(joint.upper, 3.0);
      const double share = i == 0 ? 0.0 : i == 1 ? 1.0 : unit(random);
      rows.q.back().push_back(low + share * (high - low));
      rows.v.back().push_back(2.0 * unit(random) - 1.0);
    }
  }
  return rows;
}

void write_rows(const Rows& rows, const std::filesystem::path& path) {
  std::ofstream csv(path);
  csv.precision(17);
  csv << "t";
  for (const char* name : {"q", "v"}) {
    for (std::size_t j = 1; j <= rows.q[0].size(); ++j) csv << ',' << name << j;
  }
  csv << '\n';
  for (std::size_t i = 0; i < rows.q.size(); ++i) {
    csv << 0.01 * static_cast<double>(i);
    for (const double x : rows.q[i]) csv << ',' << x;
    for (const double x : rows.v[i]) csv << ',' << x;
    csv << '\n';
  }
}

/// Runs the command in both modes and compares every joint of every row.
void expect_literal(const std::filesystem::path& cell_file, const std::string& arm_name,
                    const workspace::Workspace& workspace) {
  SCOPED_TRACE(arm_name);
  Config config;
  config.arm = arm_name;
  const runtime::CellConfig cell = runtime::load_cell(cell_file);
  const PhantomModel model = load_model(cell, config);
  const std::size_t n = model.arm.joint_count();
  const Rows rows = wander(model.arm, 60);
  const auto joints = temporary("joints.csv"), skin_file = temporary("skin.csv"), out = temporary("out.csv");
  write_rows(rows, joints);
  std::map<std::string, Table> tables;
  for (const std::string mode : {"separable", "coupled"}) {
    ASSERT_EQ(run_probe({cell_file, arm_name, joints, mode, false, out, skin_file}, Config{}), 0);
    tables.emplace(mode, Table(out));
  }
  const std::vector<Sensor> skin = read_skin(skin_file);
  ASSERT_EQ(skin.size(), model.skin.size());
  const Table &separable = tables.at("separable"), &coupled = tables.at("coupled");
  ASSERT_EQ(separable.rows, rows.q.size());
  std::vector<std::size_t> met(n, 0);
  for (std::size_t i = 0; i < rows.q.size(); ++i) {
    const Literal expected = literal(model.arm, skin, workspace, rows.q[i], rows.v[i]);
    double total = 0.0;
    for (const double b : expected.coefficient) total = std::max(total, b);
    for (std::size_t j = 0; j < n; ++j) {
      const std::string number = std::to_string(j + 1);
      const double b = expected.coefficient[j];
      met[j] += b > 0.0 ? 1U : 0U;
      // Where all that meets fluid stands on the joint's axis, d_l² is rounding itself.
      const double close = 1e-9 * b + 1e-15 * total;
      EXPECT_NEAR(separable.at("b" + number, i), b, close) << "row " << i << " joint " << number;
      EXPECT_NEAR(separable.at("tau" + number, i), -b * rows.v[i][j], close)
          << "row " << i << " joint " << number;
      EXPECT_NEAR(coupled.at("tau" + number, i), expected.coupled_torque[j], 1e-9 * total) << "row " << i;
    }
  }
  for (std::size_t j = 0; j < n; ++j)
    EXPECT_GT(met[j], 2U) << "joint " << j + 1 << " hardly ever meets fluid";
}

const workspace::Workspace& bench_workspace() {
  static const workspace::Workspace workspace = build_workspace(runtime::load_cell(kBench));
  return workspace;
}

TEST(ProbeCommand, GivesTheLiteralSumsOnEveryArmOfTheThesis) {
  for (const auto& arm : runtime::load_cell(kBench).arms) expect_literal(kBench, arm.name, bench_workspace());
}

TEST(ProbeCommand, GivesTheLiteralSumsOnTheHotCellsArm) {
  const std::filesystem::path cell = PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml";
  expect_literal(cell, "suspended_arm", build_workspace(runtime::load_cell(cell)));
}

TEST(ProbeCommand, GivesTheLiteralSumsOnForeignArms) {
  for (const robot::foreign_arms::Foreign& foreign : robot::foreign_arms::all()) {
    const auto urdf = temporary(foreign.name + ".urdf"), cell = temporary(foreign.name + ".yaml");
    std::ofstream(urdf) << "<robot name=\"" << foreign.name << "\">" << foreign.body << "</robot>";
    const auto arm = robot::SerialArm::from_urdf(urdf, foreign.tip, {});
    ASSERT_TRUE(arm) << arm.status().message();
    std::ofstream file(cell);
    file
        << "name: foreign\n"
           "workspace: {min_m: [-1.2, -1.2, -1.2], max_m: [1.2, 1.2, 1.2], voxel_size_m: 0.02}\n"
           "profile: {thickness_vox: [6, 6, 6, 6], mu_Pa_s_per_m: [32, 20, 13, 9]}\n"
           "objects:\n"
           "  - {name: ball, primitive: {sphere: {radius_m: 0.3}}, pose: {xyz_m: [0.5, 0.2, 0.4]}}\n"
           "  - {name: block, primitive: {box: {size_m: [0.3, 0.4, 0.5]}}, pose: {xyz_m: [-0.4, -0.5, 0.3]}}\n"
           "arms:\n  - name: foreign\n    urdf: "
        << urdf.filename().string() << "\n    tip_link: " << foreign.tip << "\n    home: [";
    for (std::size_t j = 0; j < arm->joint_count(); ++j) {
      const robot::Joint& joint = arm->joints()[j];
      file << (j == 0 ? "" : ", ") << std::clamp(0.0, joint.lower, joint.upper);
    }
    file << "]\n    skin:\n";
    for (std::size_t l = 1; l < arm->links().size(); ++l) {
      file << "      - {link: " << arm->links()[l].name
           << ", segments: [{offset_m: 0, length_m: 0.25, from_radius_m: 0.06, to_radius_m: "
              "0.04, spin_deg: 10}], axes: [{from_m: [0, 0, 0], to_m: [0.1, 0.05, 0], cluster: {reach_vox: "
              "2}}]}\n";
    }
    file.close();
    expect_literal(cell, "foreign", build_workspace(runtime::load_cell(cell)));
  }
}

/// Compares with the literal sums an arm whose whole skin is sampled from the meshes that its URDF shows,
/// among fluid about `reach_m` away from its base.
void expect_literal_with_mesh_skin(const std::string& name, const std::filesystem::path& urdf,
                                   const std::string& tip, double reach_m) {
  const auto arm = robot::SerialArm::from_urdf(urdf, tip, {});
  ASSERT_TRUE(arm) << arm.status().message();
  const auto cell = temporary(name + ".yaml");
  std::ofstream file(cell);
  const double edge_m = 1.5 * reach_m;
  const auto object = [&](const char* what, const std::string& primitive, double x, double y, double z) {
    file << "  - {name: " << what << ", primitive: " << primitive << ", pose: {xyz_m: [" << x * reach_m
         << ", " << y * reach_m << ", " << z * reach_m << "]}}\n";
  };
  file << "name: meshes\nworkspace: {min_m: [" << -edge_m << ", " << -edge_m << ", " << -edge_m
       << "], max_m: [" << edge_m << ", " << edge_m << ", " << edge_m << "], voxel_size_m: 0.02}\n"
       << "profile: {thickness_vox: [6, 6, 6, 6], mu_Pa_s_per_m: [32, 20, 13, 9]}\nobjects:\n";
  object("ball", "{sphere: {radius_m: 0.2}}", 0.5, 0.2, 0.4);
  object("block", "{box: {size_m: [0.3, 0.4, 0.5]}}", -0.4, -0.5, 0.3);
  object("post", "{cylinder: {radius_m: 0.1, height_m: 1.0}}", 0.1, -0.5, -0.2);
  object("floor", "{box: {size_m: [1.5, 1.5, 0.1]}}", 0.0, 0.0, -0.3);
  file << "arms:\n  - name: " << name << "\n    urdf: \"" << urdf.string() << "\"\n    tip_link: \"" << tip
       << "\"\n    home: [";
  for (std::size_t j = 0; j < arm->joint_count(); ++j)
    file << (j == 0 ? "" : ", ") << std::clamp(0.0, arm->joints()[j].lower, arm->joints()[j].upper);
  file << "]\n    skin:\n";
  std::size_t links = 0;
  for (std::size_t l = 1; l < arm->links().size(); ++l) {
    if (arm->links()[l].meshes.empty()) continue;
    file << "      - {link: \"" << arm->links()[l].name << "\", meshes: [{"
         << (++links % 3 == 0 ? "cluster: {reach_vox: 2}" : "gain: 1.5") << "}]}\n";
  }
  file.close();
  ASSERT_GT(links, 4U);
  expect_literal(cell, name, build_workspace(runtime::load_cell(cell)));
}

TEST(ProbeCommand, GivesTheLiteralSumsOnASkinSampledFromTheLinksMeshes) {
  expect_literal_with_mesh_skin("meshes", PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/arm/suspended_arm.urdf",
                                "tool", 0.8);
}

// Arms that others drew: DART's examples, of Debian's package dart-doc (scripts/setup installs it).
const std::filesystem::path kDart = "/usr/share/doc/dart/data/urdf";

TEST(ProbeCommand, GivesTheLiteralSumsOnAWholeArmManipulatorInItsOwnMeshes) {
  if (!std::filesystem::is_directory(kDart)) GTEST_SKIP() << "dart-doc is not installed";
  expect_literal_with_mesh_skin("wam", kDart / "wam/wam.urdf", "/wam7", 0.9);
}

TEST(ProbeCommand, GivesTheLiteralSumsOnAnIndustrialArmInItsOwnMeshes) {
  if (!std::filesystem::is_directory(kDart)) GTEST_SKIP() << "dart-doc is not installed";
  // It leaves its efforts at 0, which ours must state; kinematics and meshes are as drawn.
  std::ifstream original(kDart / "KR5/KR5 sixx R650.urdf");
  std::string text(std::istreambuf_iterator<char>(original), {});
  const auto replace_all = [&text](const std::string& what, const std::string& by) {
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
      text.replace(at, what.size(), by);
  };
  replace_all("effort=\"0\"", "effort=\"50\"");
  replace_all("filename=\"meshes/", "filename=\"" + (kDart / "KR5/meshes").string() + "/");
  const auto urdf = temporary("kr5.urdf");
  std::ofstream(urdf) << text;
  expect_literal_with_mesh_skin("kr5", urdf, "palm", 0.8);
}

/// Sum of the joint's drag over rows that go up to the object and over those that come back the same way.
std::pair<double, double> approach_and_retreat(bool directional) {
  Rows rows;
  constexpr int kSteps = 60;
  for (int i = 0; i < 2 * kSteps; ++i) {
    const bool back = i >= kSteps;
    const double share = static_cast<double>(back ? 2 * kSteps - 1 - i : i) / (kSteps - 1);
    const double theta = (5.0 + 28.0 * share) * std::numbers::pi / 180.0;
    rows.q.push_back({0.0, theta, 0.0});
    rows.v.push_back({0.0, back ? -0.1 : 0.1, 0.0});
  }
  const auto joints = temporary("reach.csv"), out = temporary("reach_out.csv");
  write_rows(rows, joints);
  EXPECT_EQ(run_probe({kBench, "test_arm", joints, "", directional, out, {}}, Config{}), 0);
  const Table table(out);
  double approach = 0.0, retreat = 0.0;
  for (std::size_t i = 0; i < table.rows; ++i)
    (i < kSteps ? approach : retreat) += std::abs(table.at("tau2", i));
  return {approach, retreat};
}

TEST(ProbeCommand, RetreatIsFreeInDirectionalModeAndTheSameInSymmetricMode) {
  const auto [symmetric_in, symmetric_out] = approach_and_retreat(false);
  ASSERT_GT(symmetric_in, 0.0);
  EXPECT_NEAR(symmetric_out, symmetric_in, 1e-12 * symmetric_in);
  const auto [in, out] = approach_and_retreat(true);
  EXPECT_NEAR(in, symmetric_in, 1e-3 * symmetric_in) << "nearing is felt in full";
  EXPECT_LT(out, 0.1 * in);
}

TEST(ProbeCommand, SaysWhatIsBeyondTheDrives) {
  const auto warnings = [](double speed) {
    const auto joints = temporary("fast.csv"), out = temporary("fast_out.csv");
    std::ofstream(joints) << "t,q1,q2,v1,v2\n0,0,0," << speed << ",0\n";
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_EQ(run_probe({kBench, "active_joystick", joints, "", false, out, {}}, Config{}), 0);
    return testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(warnings(1.0), testing::Not(testing::HasSubstr("reaches")));
  EXPECT_THAT(warnings(400.0), testing::HasSubstr("v1 reaches 400 rad/s, the drive of joint theta 314"));
}

}  // namespace
}  // namespace phantom::phantom_sensing::probe_command_test
