#include "common/layers/fidelity.hpp"

#include <gtest/gtest.h>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/activation.hpp"

namespace phantom::layers {
namespace {

constexpr double kVoxel_m = 0.01;

std::vector<LayerFidelity> fidelity_of(const geometry::TriangleMesh& mesh, workspace::LayerMethod method,
                                       workspace::ShapingElement element, int m, int guard = 0) {
  workspace::LayerProfile profile{{m, m, m}, {30.0F, 20.0F, 10.0F}, 100.0F, guard, method, element};
  const auto activated = activate_alone({"body", 1, mesh, profile}, kVoxel_m);
  EXPECT_TRUE(activated);
  return measure_fidelity(mesh, profile, activated->first, 2);
}

// A cube whose faces lie on borders between voxels is the solid of its own voxels but for one layer of them
// at the upper sides, where a face on a border belongs to the voxel above.
TEST(Fidelity, OfACubeOnTheLatticeIsKnownInEveryDirection) {
  const auto cube = geometry::make_box({0.2, 0.2, 0.2});
  const auto layers =
      fidelity_of(cube, workspace::LayerMethod::kDistance, workspace::ShapingElement::kCube, 4);
  ASSERT_EQ(layers.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(layers[i].order, static_cast<int>(i) + 1);
    EXPECT_EQ(layers[i].offset_vox, 4.0 * static_cast<double>(i + 1));
    const auto of = [&](Side side) { return layers[i].by_side[static_cast<std::size_t>(side)]; };
    for (const Side side : {Side::kMinusX, Side::kMinusY, Side::kMinusZ}) {
      EXPECT_GE(of(side).faces, 400U) << name_of(side);
      EXPECT_NEAR(of(side).max_vox, 0.0, 0.5) << name_of(side);
    }
    for (const Side side : {Side::kPlusX, Side::kPlusY, Side::kPlusZ})
      EXPECT_NEAR(of(side).max_vox, 1.0, 0.5) << name_of(side);
    EXPECT_GT(of(Side::kEdge).faces, 100U);
    EXPECT_GT(of(Side::kCorner).faces, 10U);
  }
}

TEST(Fidelity, TellsACubeElementFromASphere) {
  const auto sphere =
      geometry::make_sphere(0.15, 5).transformed({Eigen::Matrix3d::Identity(), {0.003, 0.004, 0.001}});
  const auto cube =
      fidelity_of(sphere, workspace::LayerMethod::kDilation, workspace::ShapingElement::kCube, 3);
  const auto ball =
      fidelity_of(sphere, workspace::LayerMethod::kDilation, workspace::ShapingElement::kSphere, 3);
  const auto exact =
      fidelity_of(sphere, workspace::LayerMethod::kSurface, workspace::ShapingElement::kSphere, 3);
  const auto corner = static_cast<std::size_t>(Side::kCorner);
  // Three cubes of three voxels reach 9·√3 along the diagonal of space instead of 9.
  EXPECT_GT(cube.back().by_side[corner].max_vox, 5.0);
  EXPECT_LT(ball.back().by_side[corner].max_vox, 2.0);
  for (const LayerFidelity& layer : exact) {
    EXPECT_LT(std::abs(layer.whole.mean_vox), 0.05);
    EXPECT_LT(layer.whole.rms_vox, 0.5);
    // A face is half a voxel from two centres, on either side of the true offset: at most half a voxel away.
    EXPECT_LE(layer.whole.max_vox, 0.5 + 1e-3);
    EXPECT_GE(layer.whole.min_vox, -0.5 - 1e-3);
  }
}

TEST(Fidelity, SumsUpItsDirectionsAndCountsTheGuard) {
  const auto layers = fidelity_of(geometry::make_torus(0.12, 0.04), workspace::LayerMethod::kDistance,
                                  workspace::ShapingElement::kSphere, 2, 3);
  ASSERT_EQ(layers.size(), 4U);
  EXPECT_EQ(layers[0].order, workspace::kOrderGuard);
  EXPECT_EQ(layers[0].offset_vox, 3.0);
  EXPECT_EQ(layers[1].offset_vox, 5.0);
  for (const LayerFidelity& layer : layers) {
    std::size_t faces = 0;
    double sum = 0.0, most = -1e30;
    for (const Deviation& side : layer.by_side) {
      faces += side.faces;
      sum += static_cast<double>(side.faces) * side.mean_vox;
      if (side.faces > 0) most = std::max(most, side.max_vox);
    }
    EXPECT_EQ(layer.whole.faces, faces);
    EXPECT_NEAR(layer.whole.mean_vox, sum / static_cast<double>(faces), 1e-9);
    EXPECT_EQ(layer.whole.max_vox, most);
  }
}

TEST(Fidelity, OfNothingIsNothing) {
  EXPECT_TRUE(measure_fidelity({}, {{1}, {1.0F}}, workspace::Workspace{}).empty());
}

}  // namespace
}  // namespace phantom::layers
