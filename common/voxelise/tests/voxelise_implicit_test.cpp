#include "common/voxelise/voxelise_implicit.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <random>

#include "common/geometry/implicit/polygonise.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/activation.hpp"

namespace phantom::voxelise {
namespace {

using Eigen::Vector3d;
using geometry::ImplicitPtr;
using geometry::Pose;
using geometry::Region;

const Pose kTilted{geometry::rotation_from_rpy(0.4, -0.7, 1.1), {0.013, -0.021, 0.034}};

workspace::GridSpec lattice(const workspace::VoxelSize& voxel_size_m) {
  return {Vector3d::Zero(), voxel_size_m, {0, 0, 0}};
}

SolidVoxels voxels_of(const ImplicitPtr& solid, const workspace::GridSpec& grid) {
  auto voxels = voxelise(*solid, grid, voxel_bounds(*solid, grid));
  EXPECT_TRUE(voxels) << voxels.status().message();
  return *std::move(voxels);
}

ImplicitPtr formula_solid(const std::string& text, double reach) {
  auto f = geometry::Formula::parse(text, {"x", "y", "z"});
  EXPECT_TRUE(f) << f.status().message();
  return geometry::implicit_formula(*std::move(f), {Vector3d::Constant(-reach), Vector3d::Constant(reach)});
}

/// All kinds, small enough for the literal twin.
std::vector<ImplicitPtr> small_solids() {
  const auto block = geometry::implicit_box({0.07, 0.05, 0.06});
  const auto drill = geometry::implicit_placed(geometry::implicit_cylinder(0.015, 0.2), kTilted);
  return {geometry::implicit_sphere(0.03),
          geometry::implicit_placed(geometry::implicit_torus(0.03, 0.01), kTilted),
          geometry::implicit_placed(geometry::implicit_cone(0.03, 0.0, 0.05), kTilted),
          geometry::implicit_difference({block, drill}),
          geometry::implicit_placed(geometry::implicit_union({block, geometry::implicit_sphere(0.04)}),
                                    kTilted, 0.7),
          geometry::implicit_placed(geometry::implicit_box({0.06, 0.05, 0.001}), kTilted),
          formula_solid("x^2 + y^2 + z^2 - 0.0009", 0.04),
          formula_solid("sin(90*x)*cos(90*y) + sin(90*y)*cos(90*z) + sin(90*z)*cos(90*x)", 0.03),
          formula_solid("sqrt(x) + y - 0.15", 0.03)};
}

/// The statement of voxelise() word for word: every voxel on its own, all of its 16³ parts.
bool literally_boundary(const geometry::ImplicitSolid& solid, const Vector3d& low_m,
                        const Vector3d& voxel_m) {
  const Vector3d part_m = voxel_m / 16;
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 16; ++y) {
      for (int z = 0; z < 16; ++z) {
        const Vector3d centre = low_m + part_m.cwiseProduct(Vector3d(x + 0.5, y + 0.5, z + 0.5));
        const auto bounds = solid.bounds(Region::box(centre, 0.5 * part_m));
        if (bounds.lo <= 0.0 && bounds.hi >= 0.0) return true;
      }
    }
  }
  return false;
}

template <class Visit>
void for_each_voxel(const SolidVoxels& voxels, const workspace::GridSpec& grid, const Visit& visit) {
  const auto& box = voxels.box;
  for (std::int32_t z = 0; z < box.size[2]; ++z) {
    for (std::int32_t y = 0; y < box.size[1]; ++y) {
      for (std::int32_t x = 0; x < box.size[0]; ++x) {
        const workspace::Index3 v{box.min.x + x, box.min.y + y, box.min.z + z};
        visit(grid.centre_of(v), voxels.inside.get(x, y, z), voxels.boundary.get(x, y, z),
              voxels.is_interior(x, y, z));
      }
    }
  }
}

TEST(VoxeliseImplicit, EqualsItsLiteralTwin) {
  for (const Vector3d& sides_m : {Vector3d(0.011, 0.011, 0.011), Vector3d(0.009, 0.013, 0.005)}) {
    const workspace::GridSpec grid = lattice(workspace::VoxelSize(sides_m));
    for (const ImplicitPtr& solid : small_solids()) {
      int wrong = 0, marked = 0;
      for_each_voxel(voxels_of(solid, grid), grid,
                     [&](const Vector3d& c, bool inside, bool boundary, bool interior) {
                       const Vector3d low = c - (0.5 + 1.0 / 32768) * sides_m;
                       marked += boundary;
                       wrong += inside != (solid->value(c) < 0.0);
                       wrong += boundary != literally_boundary(*solid, low, sides_m);
                       wrong += interior != (inside && !boundary);
                     });
      EXPECT_EQ(wrong, 0);
      EXPECT_GT(marked, 20);
    }
  }
}

/// Distance from a point to the nearest and to the farthest point of a voxel.
std::pair<double, double> reach_of_voxel(const Vector3d& centre, double voxel_m, const Vector3d& p) {
  const Vector3d away = (p - centre).cwiseAbs();
  const Vector3d half = Vector3d::Constant(0.5 * voxel_m);
  return {(away - half).cwiseMax(0.0).norm(), (away + half).norm()};
}

TEST(VoxeliseImplicit, ASphereMarksTheVoxelsThatItsSurfaceCuts) {
  const workspace::GridSpec grid = lattice(0.005);
  const Vector3d middle(0.0012, -0.0031, 0.0007);
  constexpr double kRadius = 0.1, kBand = 0.005 / 16 * 1.75;
  const auto sphere =
      geometry::implicit_placed(geometry::implicit_sphere(kRadius), {Eigen::Matrix3d::Identity(), middle});
  int cut = 0, band = 0;
  for_each_voxel(voxels_of(sphere, grid), grid, [&](const Vector3d& c, bool inside, bool boundary, bool) {
    const auto [nearest, farthest] = reach_of_voxel(c, 0.005, middle);
    EXPECT_EQ(inside, (c - middle).norm() < kRadius);
    const bool is_cut = nearest < kRadius - 1e-6 && farthest > kRadius + 1e-6;
    if (is_cut) {
      EXPECT_TRUE(boundary);
    }
    if (nearest > kRadius + kBand || farthest < kRadius - kBand) {
      EXPECT_FALSE(boundary);
    }
    cut += is_cut;
    band += boundary && !is_cut;
  });
  EXPECT_GT(cut, 5000);
  EXPECT_LT(band, cut / 50) << "voxels that are taken for touched without proof";
}

/// Voxels in which two solids differ, and how far from the surface the farthest of them lies.
struct Difference {
  int voxels = 0;
  int boundary = 0;
  double farthest_m = 0.0;
};

Difference compare(const SolidVoxels& a, const SolidVoxels& b, const workspace::GridSpec& grid,
                   const geometry::ImplicitSolid& solid) {
  Difference difference;
  const auto bit = [](const SolidVoxels& s, const workspace::BitVolume& bits, workspace::Index3 v) {
    const std::int32_t x = v.x - s.box.min.x, y = v.y - s.box.min.y, z = v.z - s.box.min.z;
    return x >= 0 && y >= 0 && z >= 0 && x < s.box.size[0] && y < s.box.size[1] && z < s.box.size[2] &&
           bits.get(x, y, z);
  };
  for (std::int32_t z = a.box.min.z - 2; z < a.box.min.z + a.box.size[2] + 2; ++z) {
    for (std::int32_t y = a.box.min.y - 2; y < a.box.min.y + a.box.size[1] + 2; ++y) {
      for (std::int32_t x = a.box.min.x - 2; x < a.box.min.x + a.box.size[0] + 2; ++x) {
        const workspace::Index3 v{x, y, z};
        difference.boundary += bit(a, a.boundary, v);
        if (bit(a, a.inside, v) != bit(b, b.inside, v))
          difference.farthest_m = std::max(difference.farthest_m, std::abs(solid.value(grid.centre_of(v))));
        difference.voxels +=
            bit(a, a.boundary, v) != bit(b, b.boundary, v) || bit(a, a.inside, v) != bit(b, b.inside, v);
      }
    }
  }
  return difference;
}

TEST(VoxeliseImplicit, AgreesWithTheMeshPathOnSolidsThatBothKnow) {
  struct Case {
    ImplicitPtr solid_O;
    geometry::TriangleMesh mesh_O;
    double chord_m;      // by which the mesh misses the solid
    double most_differ;  // share of the boundary's voxels: those that one of the two just grazes
  };
  const Case cases[] = {
      {geometry::implicit_box({0.11, 0.16, 0.07}), geometry::make_box({0.11, 0.16, 0.07}), 1e-6, 0.02},
      {geometry::implicit_sphere(0.08), geometry::make_sphere(0.08, 6), 1e-5, 0.03},
      {geometry::implicit_torus(0.07, 0.025), geometry::make_torus(0.07, 0.025, 400, 160), 1e-5, 0.03},
      {geometry::implicit_cylinder(0.05, 0.12), geometry::make_cylinder(0.05, 0.12, 400), 1e-5, 0.03}};
  const workspace::GridSpec grid = lattice(0.004);
  for (const Case& one : cases) {
    for (const Pose& pose : {kTilted, Pose{geometry::rotation_from_rpy(1.0, 0.3, -0.2), {0.1, 0, 0}}}) {
      const auto solid = geometry::implicit_placed(one.solid_O, pose);
      const auto mesh = one.mesh_O.transformed(pose);
      const auto by_mesh = voxelise(mesh, grid, voxel_bounds(mesh.bounding_box(), grid));
      ASSERT_TRUE(by_mesh);
      const Difference found = compare(voxels_of(solid, grid), *by_mesh, grid, *solid);
      EXPECT_LT(found.farthest_m, one.chord_m);
      EXPECT_LT(found.voxels, one.most_differ * found.boundary);
      EXPECT_GT(found.boundary, 1000);
    }
  }
}

TEST(VoxeliseImplicit, ABoxOnVoxelBordersIsTheMeshPathsInEveryVoxel) {
  const auto solid = geometry::implicit_placed(geometry::implicit_box({0.1, 0.06, 0.04}),
                                               {Eigen::Matrix3d::Identity(), {0.2, -0.03, 0.5}});
  const auto mesh =
      geometry::make_box({0.1, 0.06, 0.04}).transformed({Eigen::Matrix3d::Identity(), {0.2, -0.03, 0.5}});
  const workspace::GridSpec grid = lattice(0.005);
  const auto by_mesh = voxelise(mesh, grid, voxel_bounds(mesh.bounding_box(), grid));
  ASSERT_TRUE(by_mesh);
  EXPECT_EQ(compare(voxels_of(solid, grid), *by_mesh, grid, *solid).voxels, 0);
}

TEST(VoxeliseImplicit, TheBoundaryHasNoGap) {
  // Face neighbours of which neither is boundary are on the same side: nothing leaks through the surface.
  const workspace::GridSpec grid = lattice(0.006);
  for (const ImplicitPtr& solid : small_solids()) {
    const SolidVoxels voxels = voxels_of(solid, grid);
    const auto& size = voxels.box.size;
    int leaks = 0;
    for (std::int32_t z = 0; z + 1 < size[2]; ++z) {
      for (std::int32_t y = 0; y + 1 < size[1]; ++y) {
        for (std::int32_t x = 0; x + 1 < size[0]; ++x) {
          for (const auto& [dx, dy, dz] : {std::array{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
            leaks += !voxels.boundary.get(x, y, z) && !voxels.boundary.get(x + dx, y + dy, z + dz) &&
                     voxels.inside.get(x, y, z) != voxels.inside.get(x + dx, y + dy, z + dz);
          }
        }
      }
    }
    EXPECT_EQ(leaks, 0);
  }
}

TEST(VoxeliseImplicit, AFoilFarThinnerThanAVoxelIsKeptWhole) {
  const workspace::GridSpec grid = lattice(0.005);
  const auto foil = geometry::implicit_placed(geometry::implicit_box({0.2, 0.15, 2e-5}), kTilted);
  const SolidVoxels voxels = voxels_of(foil, grid);
  const auto is_boundary = [&](const Vector3d& p) {
    const workspace::Index3 v = grid.index_of(p);
    return voxels.boundary.get(v.x - voxels.box.min.x, v.y - voxels.box.min.y, v.z - voxels.box.min.z);
  };
  for (double x = -0.099; x < 0.099; x += 0.001) {
    for (double y = -0.074; y < 0.074; y += 0.001) ASSERT_TRUE(is_boundary(kTilted * Vector3d(x, y, 0)));
  }
}

TEST(VoxeliseImplicit, ClipsToWhatIsAskedFor) {
  const workspace::GridSpec grid = lattice(0.005);
  const auto sphere = geometry::implicit_sphere(0.1);
  const SolidVoxels whole = voxels_of(sphere, grid);
  const workspace::VoxelBox clip{{-3, 2, -40}, {37, 9, 70}};
  const auto part = voxelise(*sphere, grid, clip);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->box.intersection(clip).voxel_count(), part->box.voxel_count());
  for (std::int32_t z = 0; z < part->box.size[2]; ++z) {
    for (std::int32_t y = 0; y < part->box.size[1]; ++y) {
      for (std::int32_t x = 0; x < part->box.size[0]; ++x) {
        const workspace::Index3 v{x + part->box.min.x - whole.box.min.x,
                                  y + part->box.min.y - whole.box.min.y,
                                  z + part->box.min.z - whole.box.min.z};
        ASSERT_EQ(part->boundary.get(x, y, z), whole.boundary.get(v.x, v.y, v.z));
        ASSERT_EQ(part->inside.get(x, y, z), whole.inside.get(v.x, v.y, v.z));
      }
    }
  }
  EXPECT_TRUE(voxelise(*sphere, grid, {{1000, 0, 0}, {5, 5, 5}})->box.empty());
}

TEST(VoxeliseImplicit, IsTheSameWithManyThreads) {
  std::vector<ImplicitPtr> solids = small_solids();
  solids.push_back(geometry::implicit_placed(geometry::implicit_torus(0.5, 0.2), kTilted));
  for (const ImplicitPtr& solid : solids) {
    const workspace::GridSpec grid = lattice(0.008);
    const SolidVoxels one = voxels_of(solid, grid);
    const auto many = voxelise(*solid, grid, voxel_bounds(*solid, grid), {3, nullptr});
    ASSERT_TRUE(many);
    EXPECT_EQ(one.boundary.words(), many->boundary.words());
    EXPECT_EQ(one.inside.words(), many->inside.words());
  }
}

TEST(VoxeliseImplicit, TellsHowFarItIsAndEndsWhenToldTo) {
  const auto ring = geometry::implicit_torus(0.5, 0.2);
  const workspace::GridSpec grid = lattice(0.008);
  std::vector<double> shares;
  // Of two threads the one that is asked may do little.
  ASSERT_TRUE(voxelise(*ring, grid, voxel_bounds(*ring, grid), {1, [&](double share) {
                                                                  shares.push_back(share);
                                                                  return true;
                                                                }}));
  EXPECT_GT(shares.size(), 5U);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0.0);
  EXPECT_LT(shares.back(), 1.0);
  int asked = 0;
  const auto stopped =
      voxelise(*ring, grid, voxel_bounds(*ring, grid), {1, [&](double) { return ++asked < 3; }});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.status().code(), core::ErrorCode::kUnavailable);
  EXPECT_EQ(asked, 3);
}

TEST(VoxeliseImplicit, RefusesWhatReachesTooFar) {
  const auto far =
      geometry::implicit_placed(geometry::implicit_sphere(1.0), {Eigen::Matrix3d::Identity(), {2e6, 0, 0}});
  EXPECT_FALSE(voxelise(*far, lattice(0.005), {{0, 0, 0}, {10, 10, 10}}));
}

TEST(VoxeliseImplicit, ABodyByFormulaIsActivatedByIt) {
  workspace::LayerProfile profile;
  profile.thickness_vox = {2, 2};
  profile.mu_Pa_s_per_m = {32, 20};
  // The mesh is a decoy: the formula decides.
  const layers::Body body{"ball", 1, geometry::make_box({0.02, 0.02, 0.02}), profile,
                          geometry::implicit_sphere(0.05)};
  const auto alone = layers::activate_alone(body, 0.005);
  ASSERT_TRUE(alone) << alone.status().message();
  const auto& workspace = alone->first;
  const auto order = [&](double x) {
    return workspace.order(workspace.grid().index_of({x, 0.0001, 0.0001}));
  };
  EXPECT_EQ(order(0.0), workspace::kOrderInterior);
  EXPECT_EQ(order(0.049), workspace::kOrderBoundary);
  EXPECT_EQ(order(0.0575), 1);
  EXPECT_EQ(order(0.0675), 2);
  const workspace::GridSpec grid{Vector3d::Constant(-0.1), 0.005, {40, 40, 40}};
  const auto in_grid = layers::activate_object(body, grid);
  ASSERT_TRUE(in_grid) << in_grid.status().message();
  EXPECT_EQ(in_grid->report.boundary_voxels, alone->second.boundary_voxels);
}

// Interval bounds of these exclude nothing: every voxel of the box would be divided to the end.
const char* const kHopeless[] = {"x*x - x*x + 1e-300", "sin(900*x)*sin(900*y)*sin(900*z)",
                                 "(x-x)*(y-y)*(z-z) + sin(1/x)*sin(1/y)*sin(1/z)"};

TEST(ImplicitBudget, WorkEndsAtItsBoundWhateverTheFormulaAndTheThreads) {
  for (const char* text : kHopeless) {
    const ImplicitPtr solid = formula_solid(text, 0.2);
    for (const int threads : {1, 4}) {
      core::WorkBudget budget(5'000'000);
      const auto grid = lattice(0.002);
      const auto made =
          voxelise(*solid, grid, voxel_bounds(*solid, grid), {.threads = threads, .budget = &budget});
      ASSERT_FALSE(made) << text;
      EXPECT_EQ(made.status().code(), core::ErrorCode::kResourceExhausted);
      EXPECT_NE(made.status().message().find("more than 5 million steps"), std::string::npos);
      EXPECT_LE(budget.spent(), 5'000'000 + 64 * core::WorkMeter::kEvery) << text;
    }
  }
}

TEST(ImplicitBudget, WorkIsTheSameForAnyNumberOfThreads) {
  for (const ImplicitPtr& solid : small_solids()) {
    const auto grid = lattice(0.004);
    core::WorkBudget one, four;
    ASSERT_TRUE(voxelise(*solid, grid, voxel_bounds(*solid, grid), {.threads = 1, .budget = &one}));
    ASSERT_TRUE(voxelise(*solid, grid, voxel_bounds(*solid, grid), {.threads = 4, .budget = &four}));
    EXPECT_EQ(one.spent(), four.spent());
    EXPECT_GT(one.spent(), 0U);
  }
}

TEST(ImplicitBudget, EndsSoonOnceItIsToldTo) {
  const ImplicitPtr solid = formula_solid(kHopeless[0], 0.2);
  std::atomic<int> asked = 0;
  core::WorkBudget budget(UINT64_MAX, [&asked] { return ++asked < 10; });
  const auto grid = lattice(0.002);
  const auto made = voxelise(*solid, grid, voxel_bounds(*solid, grid), {.threads = 2, .budget = &budget});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.status().code(), core::ErrorCode::kUnavailable);
  EXPECT_LE(budget.spent(), 80 * core::WorkMeter::kEvery);
}

}  // namespace
}  // namespace phantom::voxelise
