#include <gtest/gtest.h>

#include "common/runtime/cell/cell_bodies.hpp"

namespace phantom {
namespace {

// What deploy/cells/formula_bench promises: every object is there, solid where its formula says so.

const runtime::CellConfig& cell() {
  static const auto loaded = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/formula_bench/cell.yaml");
  return loaded;
}

TEST(FormulaBench, HoldsAllKindsOfShapesAndProfiles) {
  EXPECT_GE(cell().objects.size(), 7U);
  bool dilation = false, surface = false, inside = false;
  for (const auto& object : cell().objects) {
    EXPECT_TRUE(object.solid_O) << object.name;
    dilation = dilation || object.profile.method == workspace::LayerMethod::kDilation;
    surface = surface || object.profile.method == workspace::LayerMethod::kSurface;
    inside = inside || !object.profile.inside_thickness_vox.empty();
  }
  EXPECT_TRUE(dilation && surface && inside);
}

TEST(FormulaBench, EveryObjectIsActivatedWhereItsFormulaHasIt) {
  const workspace::GridSpec grid = runtime::grid_of(cell());
  for (const runtime::CellBody& loaded : runtime::load_bodies(cell())) {
    SCOPED_TRACE(loaded.body.name);
    EXPECT_TRUE(loaded.notes.empty());
    const auto activated = layers::activate_object(loaded.body, grid);
    ASSERT_TRUE(activated) << activated.status().message();
    int solid = 0, wrong = 0;
    for (const workspace::BrickKey key : activated->bricks.keys()) {
      const std::int8_t* orders = activated->bricks.orders(key);
      for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i) {
        const std::uint32_t x = i & 31, y = i >> 5 & 31, z = i >> 10;
        const workspace::Index3 v{key.x * 32 + static_cast<std::int32_t>(x),
                                  key.y * 32 + static_cast<std::int32_t>(y),
                                  key.z * 32 + static_cast<std::int32_t>(z)};
        if (!grid.contains(v)) continue;
        const std::int8_t order = orders[workspace::brick_offset(x, y, z)];
        const bool is_solid = order < 0 || order >= workspace::kOrderBoundary;
        solid += is_solid;
        // A voxel whose centre is inside is solid, and one that is not touches the surface at least.
        const bool inside = loaded.body.implicit_W->value(grid.centre_of(v)) < 0.0;
        wrong += (inside && !is_solid) || (!inside && is_solid && order != workspace::kOrderBoundary);
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(solid, 500);
  }
}

TEST(FormulaBench, TheSheetIsWholeAlthoughItIsThinnerThanAVoxel) {
  const auto bodies = runtime::load_bodies(cell());
  const auto sheet =
      std::find_if(bodies.begin(), bodies.end(), [](const auto& b) { return b.body.name == "sheet"; });
  ASSERT_NE(sheet, bodies.end());
  const workspace::GridSpec grid = runtime::grid_of(cell());
  const auto activated = layers::activate_object(sheet->body, grid);
  ASSERT_TRUE(activated);
  const geometry::Pose& X_WO = cell().objects[sheet->body.id - 1U].X_WO;
  for (double x = -0.149; x < 0.15; x += 0.002) {
    for (double y = -0.099; y < 0.1; y += 0.002) {
      const workspace::Index3 v = grid.index_of(X_WO * Eigen::Vector3d(x, y, 0));
      const std::int8_t* orders = activated->bricks.orders({v.x >> 5, v.y >> 5, v.z >> 5});
      ASSERT_NE(orders, nullptr);
      ASSERT_EQ(orders[workspace::brick_offset(v.x & 31U, v.y & 31U, v.z & 31U)], workspace::kOrderBoundary);
    }
  }
}

}  // namespace
}  // namespace phantom
