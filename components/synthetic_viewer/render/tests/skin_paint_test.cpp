// The arm's paint, from what the skin's patches feel.
#include "components/synthetic_viewer/render/skin_paint.hpp"

#include <gtest/gtest.h>

namespace phantom::synthetic_viewer::skin_paint_test {
namespace {

geometry::BoundingBox box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  geometry::BoundingBox made;
  made.extend(low);
  made.extend(high);
  return made;
}
/// The closeness of the cube that contains a point; 0 outside.
int closeness_at(const PaintVolume& volume, const Eigen::Vector3f& p_L_m) {
  const Eigen::Array3i cube = ((p_L_m - volume.corner_m) / volume.edge_m).array().floor().cast<int>();
  const Eigen::Array3i size(volume.size[0], volume.size[1], volume.size[2]);
  if ((cube < 0).any() || (cube >= size).any()) return 0;
  return volume.closeness[static_cast<std::size_t>(cube[0] + size[0] * (cube[1] + size[1] * cube[2]))];
}
const geometry::BoundingBox kLink = box({-0.05F, -0.05F, 0.0F}, {0.05F, 0.05F, 0.4F});

TEST(SkinPaint, ColoursWhereAPatchFeelsAndFadesOut) {
  const PaintVolume volume = paint_link(kLink, 0.02, {{2, {0.05F, 0.0F, 0.1F}, 1.0F}}, 2);
  EXPECT_GT(closeness_at(volume, {0.05F, 0.0F, 0.1F}), 240);
  EXPECT_GT(closeness_at(volume, {0.05F, 0.01F, 0.11F}), 200);
  EXPECT_EQ(closeness_at(volume, {0.05F, 0.0F, 0.2F}), 0);
  EXPECT_EQ(closeness_at(volume, {-0.05F, 0.0F, 0.1F}), 0) << "the far side of the link stays plain";
  int last = 256;
  for (float z = 0.1F; z < 0.16F; z += 0.005F) {
    const int now = closeness_at(volume, {0.05F, 0.0F, z});
    EXPECT_LE(now, last);
    last = now;
  }
}

TEST(SkinPaint, TheCloserPatchWinsAndOtherLinksDoNotCount) {
  const std::vector<SkinPatchSample> patches{
      {2, {0.05F, 0.0F, 0.10F}, 0.3F}, {2, {0.05F, 0.0F, 0.11F}, 0.9F}, {3, {0.05F, 0.0F, 0.3F}, 1.0F}};
  const PaintVolume volume = paint_link(kLink, 0.02, patches, 2);
  EXPECT_NEAR(closeness_at(volume, {0.05F, 0.0F, 0.11F}), 0.9 * 255, 12);
  EXPECT_EQ(closeness_at(volume, {0.05F, 0.0F, 0.3F}), 0);
}

TEST(SkinPaint, ALongLinkIsPaintedMoreCoarselyWithinItsBound) {
  const PaintVolume volume = paint_link(box({0, 0, 0}, {0.1F, 0.1F, 8.0F}), 0.02, {}, 1);
  for (const int size : volume.size) EXPECT_LE(size, 65);
  EXPECT_EQ(volume.closeness.size(),
            static_cast<std::size_t>(volume.size[0] * volume.size[1] * volume.size[2]));
}

TEST(SkinPaint, ALinkWithoutABodyHasNone) {
  EXPECT_EQ(paint_link({}, 0.02, {{1, {0, 0, 0}, 1.0F}}, 1).size[0], 0);
  EXPECT_EQ(paint_link(kLink, 0.0, {}, 1).size[0], 0);
}

// Places that no link can have must not be written anywhere.
TEST(SkinPaint, PatchesFarFromTheirLinkAreLeftOut) {
  const PaintVolume volume =
      paint_link(kLink, 0.02, {{1, {1e6F, -1e6F, 1e6F}, 1.0F}, {1, {5.0F, 0, 0}, 1.0F}}, 1);
  for (const std::uint8_t byte : volume.closeness) EXPECT_EQ(byte, 0);
}

}  // namespace
}  // namespace phantom::synthetic_viewer::skin_paint_test
