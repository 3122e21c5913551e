// A cell in voxels that are higher than wide, from its file to what an arm feels in it, against a twin that
// knows nothing of the product's grids, voxels and layers: boxes, and distances in metres.
// And the guard of a survey, in the same voxels.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include "common/layers/live_workspace.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/survey/fit.hpp"
#include "tests/support/files.hpp"

namespace phantom {
namespace {

using Eigen::Vector3d;

// Faces lie off the borders of voxels.
constexpr const char* kFlatCell = R"(name: flat
workspace: {min_m: [-0.7, -0.7, 0], max_m: [0.7, 0.7, 0.8], voxel_size_m: [0.01, 0.01, 0.02]}
profile: {thickness_vox: [3, 2, 4, 5], mu_Pa_s_per_m: [32, 20, 13, 5], mu_skin_Pa_s_per_m: 100}
objects:
  - {name: block, primitive: {box: {size_m: [0.197, 0.153, 0.111]}}, pose: {xyz_m: [0.3, 0.1, 0.25]}}
  - {name: guarded, primitive: {box: {size_m: [0.2, 0.2, 0.214]}}, pose: {xyz_m: [-0.3035, -0.0035, 0.4]}, guard_vox: 2}
  - name: sharp
    polyhedron:
      vertices_m: [0, 0, 0, 0.2, 0, 0, 0.2, 0.15, 0, 0, 0.15, 0, 0, 0, 0.1, 0.2, 0, 0.1, 0.2, 0.15, 0.1, 0, 0.15, 0.1]
      triangles: [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7]
    pose: {xyz_m: [0.1035, 0.3035, 0.333]}
    profile: {thickness_vox: [4, 4], mu_Pa_s_per_m: [30, 8], mu_skin_Pa_s_per_m: 90, method: surface}
  - name: piston
    primitive: {box: {size_m: [0.093, 0.147, 0.173]}}
    pose: {xyz_m: [0.403, -0.4027, 0.601]}
    profile:
      mu_skin_Pa_s_per_m: 600
      mpc:
        cylinder_diameter_m: 0.02
        fluid_viscosity_Pa_s: 0.4
        pipes:
          - {diameter_m: 0.004, length_m: 0.05, gap_m: 0.02}
          - {diameter_m: 0.006, length_m: 0.05, gap_m: 0.03}
          - {diameter_m: 0.006, length_m: 0.10, gap_m: 0.04}
arms:
  - {name: scara, file: PHANTOM/deploy/arms/scara.yaml, mount: {xyz_m: [0, 0, 0.35]}}
)";

/// A box of the twin, with what surrounds it.
struct TwinBox {
  Vector3d low_m, high_m;
  std::vector<double> edges_m, mu;  // outer edge of each layer by its distance, and what it holds
  double mu_skin;
  bool to_surface;
};

const Vector3d kSides_m(0.01, 0.01, 0.02), kCorner_m(-0.7, -0.7, 0.0);

/// γ of a cylinder of 20 mm whose open pipes carry so much per pressure (Hagen–Poiseuille; μ_f = 0.4 Pa·s).
double piston_gamma(const std::vector<std::pair<double, double>>& open_pipes_m) {
  double m3_per_Pa_s = 0.0;
  for (const auto& [diameter_m, length_m] : open_pipes_m)
    m3_per_Pa_s += M_PI * std::pow(diameter_m, 4) / (128 * 0.4 * length_m);
  const double area_m2 = M_PI * 0.01 * 0.01;
  return static_cast<double>(static_cast<float>(area_m2 * area_m2 / m3_per_Pa_s));
}

std::vector<TwinBox> twin_boxes() {
  return {{{0.2015, 0.0235, 0.1945},
           {0.3985, 0.1765, 0.3055},
           {0.03, 0.05, 0.09, 0.14},
           {32, 20, 13, 5},
           100,
           false},
          {{-0.4035, -0.1035, 0.293},
           {-0.2035, 0.0965, 0.507},
           {0.02, 0.05, 0.07, 0.11, 0.16},
           {32, 32, 20, 13, 5},
           100,
           false},
          {{0.1035, 0.3035, 0.333}, {0.3035, 0.4535, 0.433}, {0.04, 0.08}, {30, 8}, 90, true},
          {{0.3565, -0.4762, 0.5145},
           {0.4495, -0.3292, 0.6875},
           {0.02, 0.05, 0.09},
           {piston_gamma({{0.004, 0.05}}), piston_gamma({{0.004, 0.05}, {0.006, 0.05}}),
            piston_gamma({{0.004, 0.05}, {0.006, 0.05}, {0.006, 0.10}})},
           600,
           false}};
}

/// What a voxel holds of one box: of the distance from its centre to the nearest voxel that the box touches,
/// or to the box itself.
double mu_of(const TwinBox& box, const std::array<int, 3>& v) {
  double square = 0.0;
  bool touches = true;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = kSides_m[axis],
                 centre = kCorner_m[axis] + side * (v[static_cast<std::size_t>(axis)] + 0.5);
    double low = box.low_m[axis], high = box.high_m[axis];
    touches = touches && centre + side / 2 > low && centre - side / 2 < high;
    if (!box.to_surface) {  // centres of the outermost voxels that it touches
      low = kCorner_m[axis] + side * (std::floor((low - kCorner_m[axis]) / side) + 0.5);
      high = kCorner_m[axis] + side * (std::floor((high - kCorner_m[axis]) / side) + 0.5);
    }
    const double away = std::max({low - centre, centre - high, 0.0});
    square += away * away;
  }
  if (touches) return box.mu_skin;
  for (std::size_t i = 0; i < box.mu.size(); ++i)
    if (std::sqrt(square) <= box.edges_m[i] * (1.0 + 1e-9)) return box.mu[i];
  return 0.0;
}

double mu_at(const Vector3d& p_m) {
  std::array<int, 3> v;
  const Vector3d end_m(0.7, 0.7, 0.8);
  for (int axis = 0; axis < 3; ++axis) {
    if (p_m[axis] < kCorner_m[axis] || p_m[axis] >= end_m[axis]) return 0.0;
    v[static_cast<std::size_t>(axis)] =
        static_cast<int>(std::floor((p_m[axis] - kCorner_m[axis]) / kSides_m[axis]));
  }
  double mu = 0.0;
  for (const TwinBox& box : twin_boxes()) mu = std::max(mu, mu_of(box, v));
  return mu;
}

struct Met {
  double mean, greatest;
};

/// Mean and greatest over the voxels whose centres are within `radius_m` of the centre of a point's voxel.
Met mu_around(const Vector3d& p_m, double radius_m) {
  Vector3d centre_m;
  for (int axis = 0; axis < 3; ++axis)
    centre_m[axis] =
        kCorner_m[axis] + kSides_m[axis] * (std::floor((p_m[axis] - kCorner_m[axis]) / kSides_m[axis]) + 0.5);
  Met met{0.0, 0.0};
  int voxels = 0;
  for (int x = -9; x <= 9; ++x)
    for (int y = -9; y <= 9; ++y)
      for (int z = -9; z <= 9; ++z) {
        const Vector3d off_m = kSides_m.cwiseProduct(Vector3d(x, y, z));
        if (off_m.norm() > radius_m + 1e-9) continue;
        ++voxels;
        const double mu = mu_at(centre_m + off_m);
        met.mean += mu, met.greatest = std::max(met.greatest, mu);
      }
  met.mean /= voxels;
  return met;
}

runtime::CellConfig flat_cell() {
  const std::filesystem::path file = test::new_folder() / "cell.yaml";
  std::ofstream(file) << test::replaced(kFlatCell, "PHANTOM", PHANTOM_SOURCE_DIR);
  return runtime::load_cell(file);
}

workspace::Workspace activated(const runtime::CellConfig& cell) {
  layers::LiveWorkspace live(runtime::grid_of(cell), cell.merge);
  const std::vector<runtime::CellBody> bodies = runtime::load_bodies(cell);
  std::vector<layers::LiveBody> all;
  for (const runtime::CellBody& body : bodies) all.push_back({&body.body, 0});
  const auto added = live.add(all, 1, {.threads = 2});
  EXPECT_TRUE(added) << added.status().message();
  return std::move(live).take();
}

TEST(FlatVoxels, EveryVoxelOfTheCellHoldsWhatTheTwinSays) {
  const runtime::CellConfig cell = flat_cell();
  EXPECT_EQ(cell.voxel_size_m.sides_m(), kSides_m);
  const workspace::Workspace voxels = activated(cell);
  ASSERT_EQ(voxels.grid().size_vox, (std::array<std::int32_t, 3>{140, 140, 40}));
  std::map<float, std::size_t> counts;
  workspace::VoxelBox::of(voxels.grid()).for_each([&](workspace::Index3 v) {
    const float mu = voxels.mu(v);
    const Vector3d centre_m = kCorner_m + kSides_m.cwiseProduct(Vector3d(v.x + 0.5, v.y + 0.5, v.z + 0.5));
    ASSERT_EQ(static_cast<double>(mu), mu_at(centre_m)) << v.x << ' ' << v.y << ' ' << v.z;
    ++counts[mu];
  });
  for (const float mu : {5.0F, 8.0F, 13.0F, 20.0F, 30.0F, 32.0F, 90.0F, 100.0F})
    EXPECT_GT(counts[mu], 100U) << mu;
  const TwinBox piston = twin_boxes().back();
  for (const double gamma : piston.mu) EXPECT_GT(counts[static_cast<float>(gamma)], 100U) << gamma;
}

// Where the survey's bound lets the object stand, along any axis, no voxel that it touches is without guard.
TEST(FlatVoxels, TheGuardOfASurveyCoversWhatItsBoundAllowsAlongEveryAxis) {
  constexpr double kHigher_m = 0.013;  // so that its top is just below the border of two voxels
  for (const double off_m : {0.004, 0.0101, 0.0195, 0.0225}) {
    runtime::CellConfig cell = flat_cell();
    runtime::ObjectConfig& block = cell.objects.at(0);
    block.X_WO.translation_m.z() += kHigher_m;
    block.profile.guard_vox = survey::guard_voxels(off_m, cell.voxel_size_m);
    cell.objects.resize(1);
    const workspace::Workspace voxels = activated(cell);
    TwinBox model = twin_boxes()[0];
    model.low_m.z() += kHigher_m, model.high_m.z() += kHigher_m;
    for (int axis = 0; axis < 3; ++axis)
      for (const double way : {-off_m, off_m}) {
        TwinBox real = model;
        real.low_m[axis] += way, real.high_m[axis] += way;
        int touched = 0;
        workspace::VoxelBox::of(voxels.grid()).for_each([&](workspace::Index3 v) {
          if (mu_of(real, {v.x, v.y, v.z}) != real.mu_skin) return;
          ++touched;
          // Guard, boundary or interior; layer 1 has the guard's μ, too.
          ASSERT_GE(voxels.order(v), workspace::kOrderGuard)
              << off_m << " along " << axis << " at " << v.x << ' ' << v.y << ' ' << v.z;
        });
        EXPECT_GT(touched, 1000);
      }
  }
}

TEST(FlatVoxels, TheArmFeelsWhatTheTwinSays) {
  const runtime::CellConfig cell = flat_cell();
  const workspace::Workspace voxels = activated(cell);
  const robot::SerialArm arm = runtime::load_arm(cell.arm());
  const std::vector<robot::LinkSkin> parts = runtime::load_skin(cell.arm(), arm);
  const auto skin = robot::lay_out_skin(arm, parts, {.voxel_size_m = cell.voxel_size_m});
  ASSERT_TRUE(skin) << skin.status().message();
  ASSERT_EQ(skin->clusters, (std::vector<robot::ClusterSpec>{{3, robot::ClusterShape::kSphere}}));
  robot::SkinSensing sensing(*skin, {});
  std::mt19937 random(8);
  int felt = 0, felt_by_spheres = 0;
  for (int trial = 0; trial < 60; ++trial) {
    core::JointArray q{};
    for (std::size_t j = 0; j < arm.joint_count(); ++j)
      q[j] = std::uniform_real_distribution(arm.joints()[j].lower, arm.joints()[j].upper)(random);
    robot::LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    sensing.sense(X_WL, arm.joint_count(), voxels);
    double worst = 0.0;
    for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
      double sum = 0.0;
      Vector3d moment = Vector3d::Zero();
      for (std::size_t s = skin->first[link]; s < skin->first[link + 1]; ++s) {
        const Vector3d d_m = X_WL[link].rotation * skin->position(s);
        // The product's rule for places within a billionth of a voxel below a border is not the twin's
        // matter.
        const Vector3d p_m = X_WL[link].translation_m + d_m + 1e-11 * Vector3d::Ones();
        const Met met = skin->cluster_kind[s] == 0 ? Met{mu_at(p_m), mu_at(p_m)} : mu_around(p_m, 0.03);
        const double mu = met.mean;
        worst = std::max(worst, met.greatest);
        felt_by_spheres += skin->cluster_kind[s] != 0 && mu > 0.0 ? 1 : 0;
        sum += skin->weight[s] * mu;
        moment += skin->weight[s] * mu * d_m;
      }
      EXPECT_NEAR(sensing.sums()[link].mu, sum, 1e-9 * sum) << "link " << link << " of trial " << trial;
      EXPECT_LT((sensing.sums()[link].mu_d - moment).norm(), 1e-9 * sum + 1e-15);
      felt += sum > 0.0 ? 1 : 0;
    }
    EXPECT_EQ(sensing.worst().found, worst > 0.0);
    if (worst > 0.0) {
      EXPECT_EQ(static_cast<double>(sensing.worst().mu), worst);
    }
  }
  EXPECT_GT(felt, 30);
  EXPECT_GT(felt_by_spheres, 10);
}

}  // namespace
}  // namespace phantom
