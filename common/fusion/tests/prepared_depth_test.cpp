// Masks of edges and of the arm against a literal twin, and by rows that a person can follow.
#include "common/fusion/prepared_depth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace phantom::fusion {
namespace {
namespace prepared_depth_tests {

/// Depths of the middle row of an image of 3 rows, in voxels of 5 mm, after the masks. `beside_m`: the row
/// above and that below.
std::vector<float> masked_row(const std::vector<float>& row_m, const std::vector<float>& beside_m) {
  const auto width = static_cast<int>(row_m.size());
  std::vector<float> pixels = beside_m;
  pixels.insert(pixels.end(), row_m.begin(), row_m.end());
  pixels.insert(pixels.end(), beside_m.begin(), beside_m.end());
  DepthImage image;
  EXPECT_TRUE(image.load_m({{width, 3, 500.0, 500.0, 0.5 * width, 1.0, 0.1, 9.0}, {}, 0.0}, pixels));
  PreparedDepth depth;
  depth.prepare(image, {}, {}, {}, 0.005);
  std::vector<float> masked;
  for (std::size_t u = 0; u < row_m.size(); ++u)
    masked.push_back(0.005F * depth.fused_vox()[row_m.size() + u]);
  return masked;
}

/// Of an image with the same rows.
std::vector<float> masked_row(const std::vector<float>& row_m) { return masked_row(row_m, row_m); }

TEST(PreparedDepth, PixelsBehindAnEdgeAndAloneInFrontAreNotFused) {
  using testing::FloatNear;
  using testing::Pointwise;
  const auto is = [](const std::vector<float>& expected) { return Pointwise(FloatNear(1e-5F), expected); };
  EXPECT_THAT(masked_row({1, 1, 1, 2, 2, 2}), is({1, 1, 1, 0, 2, 2}));
  EXPECT_THAT(masked_row({1, 1, 1.4F, 1.7F, 2, 2}), is({1, 1, 0, 0, 0, 2}));  // flying pixels
  EXPECT_THAT(masked_row({2, 2, 1, 1, 2, 2}), is({2, 1, 1, 1, 1, 2}));        // a thin rod becomes wider
  EXPECT_THAT(masked_row({2, 2, 1, 2, 2, 2}), is({2, 1, 1, 1, 2, 2}));        // one that is a pixel wide
  const std::vector<float> wall(6, 2.0F);
  EXPECT_THAT(masked_row({2, 2, 1, 2, 2, 2}, wall), is({2, 0, 0, 0, 2, 2}));  // a single pixel in front
  EXPECT_THAT(masked_row({2, 1.4F, 1.42F, 2, 2, 2}, wall), is({0, 0, 0, 0, 2, 2}));  // two flying pixels
  EXPECT_THAT(masked_row({2, 0, 1, 0, 2, 2}), is({2, 1, 1, 1, 2, 2}));  // nothing measured is no edge
  EXPECT_THAT(masked_row({1, 1.028F, 1, 1.028F, 1, 1}), is({1, 1.028F, 1, 1.028F, 1, 1}));
  std::vector<float> wide, expected;  // longer than a vector
  for (int i = 0; i < 70; ++i) wide.push_back(i / 10 % 2 == 0 ? 1.0F : 2.0F);
  for (int i = 0; i < 70; ++i)
    expected.push_back(i / 10 % 2 == 1 && (i % 10 == 0 || i % 10 == 9) ? 0.0F
                       : i / 10 % 2 == 0                               ? 1.0F
                                                                       : 2.0F);
  EXPECT_THAT(masked_row(wide), is(expected));
}

/// An image as rows of metres; 0 outside.
struct Rows {
  int width, height;
  std::vector<float> depth_m;
  float at(int u, int v) const {
    const bool inside = u >= 0 && u < width && v >= 0 && v < height;
    return inside ? depth_m[static_cast<std::size_t>(v * width + u)] : 0.0F;
  }
};

constexpr int kSides[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
constexpr float kEdge_m = 0.02F, kEdgeSigma = 6.0F * 0.0015F;
float limit_m(float depth_m) { return kEdge_m + kEdgeSigma * depth_m * depth_m; }

/// Literal: what is left without edges. Depths below 0 are the arm's: they are left out behind an edge alone.
Rows without_edges(const Rows& seen) {
  Rows kept = seen;
  for (int v = 0; v < seen.height; ++v) {
    for (int u = 0; u < seen.width; ++u) {
      const float given = seen.at(u, v), here = std::abs(given);
      bool nearer = false, farther = false;
      int alike = 0;
      for (const auto& side : kSides) {
        const float other = seen.at(u + side[0], v + side[1]);
        if (other <= 0.0F) continue;
        nearer = nearer || here - other > limit_m(here);
        farther = farther || other - here > limit_m(here);
        alike += std::abs(other - here) <= 0.5F * limit_m(here) ? 1 : 0;
      }
      if (nearer || (given > 0.0F && farther && alike < 2))
        kept.depth_m[static_cast<std::size_t>(v * seen.width + u)] = 0.0F;
    }
  }
  return kept;
}

/// Literal: what is at most four pixels wide becomes wider by one.
Rows widened(const Rows& seen, const Rows& kept) {
  Rows wide = kept;
  for (int v = 0; v < seen.height; ++v) {
    for (int u = 0; u < seen.width; ++u) {
      if (kept.at(u, v) != 0.0F || seen.at(u, v) < 0.0F) continue;
      float least = 1e9F;
      for (const auto& side : kSides) {
        const float beside = kept.at(u + side[0], v + side[1]);
        bool ends = false;
        for (int k = 2; k <= 5; ++k)
          ends = ends || seen.at(u + k * side[0], v + k * side[1]) > beside + limit_m(beside);
        if (beside > 0.0F && ends) least = std::min(least, beside);
      }
      if (least < 1e9F) wide.depth_m[static_cast<std::size_t>(v * seen.width + u)] = least;
    }
  }
  return wide;
}

TEST(PreparedDepth, EqualsItsLiteralTwin) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> share(0.0F, 1.0F);
  int filled = 0, of_arm = 0, of_arm_left_out = 0;
  for (const int width : {3, 17, 64, 101}) {
    Rows seen{width, 40, {}};
    std::vector<float> arm_m;
    for (int v = 0; v < seen.height; ++v) {
      for (int u = 0; u < width; ++u) {
        const bool rod = u % 13 < 3 || v % 11 < 2, hole = share(random) < 0.1F;
        seen.depth_m.push_back(hole ? 0.0F : (rod ? 1.0F : 2.0F) + 0.004F * share(random));
        arm_m.push_back(u > 50 && v > 20 ? 1.5F : 0.0F);
      }
    }
    DepthImage image;
    ASSERT_TRUE(image.load_m({{width, seen.height, 500.0, 500.0, 0.5 * width, 20.0, 0.1, 9.0}, {}, 0.0},
                             seen.depth_m));
    PreparedDepth depth;
    depth.prepare(image, arm_m, {.at_1m_m = 0.0015}, {.arm_margin_px = 0}, 1.0);
    for (std::size_t i = 0; i < arm_m.size(); ++i)
      if (arm_m[i] > 0.0F && seen.depth_m[i] >= arm_m[i] - 0.03F) seen.depth_m[i] = -(arm_m[i] - 0.03F);
    const Rows kept = without_edges(seen), expected = widened(seen, kept);
    for (std::size_t i = 0; i < expected.depth_m.size(); ++i) {
      ASSERT_FLOAT_EQ(depth.fused_vox()[i], expected.depth_m[i])
          << width << ": " << i % static_cast<std::size_t>(width) << ", "
          << i / static_cast<std::size_t>(width);
      filled += expected.depth_m[i] != kept.depth_m[i] ? 1 : 0;
      of_arm += expected.depth_m[i] < 0.0F ? 1 : 0;
      of_arm_left_out += seen.depth_m[i] < 0.0F && expected.depth_m[i] == 0.0F ? 1 : 0;
    }
  }
  EXPECT_GT(filled, 100);
  EXPECT_GT(of_arm, 100);
  EXPECT_GT(of_arm_left_out, 100);
}

}  // namespace prepared_depth_tests
}  // namespace
}  // namespace phantom::fusion
