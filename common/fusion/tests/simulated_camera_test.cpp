// The simulated depth camera measures what it sees, with the errors that its model states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/fusion/tests/scenes.hpp"

namespace phantom::fusion {
namespace {

using scenes::placed;

/// A camera at the origin of W that looks along z.
const geometry::Pose kAhead{};

DepthNoise no_noise() {
  DepthNoise noise;
  noise.sigma.at_1m_m = noise.quantum_at_1m_m = noise.dropout = noise.edge_dropout = noise.flying = 0.0;
  noise.steel_dropout = noise.steel_mirrored = noise.grazing_cos = 0.0;
  noise.glare_cos = 1.0;
  return noise;
}

scenes::Simulated wall_at(double z_m, const DepthNoise& noise, std::uint64_t seed = 1, bool steel = false) {
  return {{placed(geometry::make_box({9.0, 9.0, 0.2}), {0.0, 0.0, z_m + 0.1}, steel)},
          scenes::depth_camera(8),
          kAhead,
          noise,
          seed};
}

double share_without_depth(const DepthImage& image) {
  return 1.0 - static_cast<double>(image.valid_pixels()) / static_cast<double>(image.camera().pixels());
}

TEST(SimulatedCamera, SeesTheExactDepthOfAWall) {
  scenes::Simulated camera = wall_at(1.5, no_noise());
  for (const SeenPixel& pixel : camera.seen()) EXPECT_NEAR(pixel.depth_m, 1.5, 1e-5);
  for (const float depth_m : camera.frame(0).depth_m()) EXPECT_NEAR(depth_m, 1.5, 5.1e-4);
}

TEST(SimulatedCamera, IsDeterminedBySeedAndFrame) {
  scenes::Simulated a = wall_at(1.5, {}, 7), same = wall_at(1.5, {}, 7), other = wall_at(1.5, {}, 8);
  const auto pixels = [](const DepthImage& image) {
    return std::vector<float>(image.depth_m().begin(), image.depth_m().end());
  };
  const std::vector<float> third = pixels(a.frame(3));
  EXPECT_EQ(pixels(same.frame(3)), third);
  EXPECT_NE(pixels(same.frame(4)), third);
  EXPECT_NE(pixels(other.frame(3)), third);
}

TEST(SimulatedCamera, ErrorsGrowWithTheSquareOfTheDepth) {
  for (const double z_m : {0.8, 1.6, 2.4}) {
    scenes::Simulated camera = wall_at(z_m, {});
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (std::uint64_t i = 0; i < 4; ++i) {
      for (const float depth_m : camera.frame(i).depth_m()) {
        if (depth_m == 0.0F) continue;
        const double error_m = static_cast<double>(depth_m) - z_m;
        sum += error_m;
        squares += error_m * error_m;
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, 0.0, 2e-4 * z_m * z_m);
    const double sigma_m =
        std::hypot(0.0015 * z_m * z_m, 0.00035);  // with rounding to millimetres and disparities
    EXPECT_NEAR(std::sqrt(squares / count), sigma_m, 0.05 * sigma_m) << z_m;
  }
}

TEST(SimulatedCamera, RoundsTheDisparity) {
  DepthNoise noise = no_noise();
  noise.quantum_at_1m_m = 0.01;
  scenes::Simulated camera = wall_at(2.0, noise);
  EXPECT_NEAR(camera.frame(0).depth_m(9, 9), 2.0, 1e-3);  // 50 steps
  scenes::Simulated between = wall_at(2.015, noise);      // 49.6 steps
  EXPECT_NEAR(between.frame(0).depth_m(9, 9), 2.0, 1e-3);
}

TEST(SimulatedCamera, DropsPixels) {
  DepthNoise noise = no_noise();
  noise.dropout = 0.1;
  EXPECT_NEAR(share_without_depth(wall_at(1.0, noise).frame(0)), 0.1, 0.02);
}

TEST(SimulatedCamera, PixelsFlyBetweenTwoSurfacesAtAnEdgeAlone) {
  DepthNoise noise = no_noise();
  noise.flying = 0.5;
  scenes::Simulated camera({placed(geometry::make_box({9, 9, 0.2}), {0, 0, 2.1}),
                            placed(geometry::make_box({9, 9, 0.2}), {4.5, 0, 1.1})},
                           scenes::depth_camera(8), kAhead, noise);
  const DepthImage& image = camera.frame(0);
  int between = 0;
  for (int v = 0; v < image.camera().height_px; ++v) {
    for (int u = 0; u < image.camera().width_px; ++u) {
      const float depth_m = image.depth_m(u, v);
      if (depth_m < 1.02F || depth_m > 1.98F) continue;
      ++between;
      EXPECT_TRUE(u == 39 || u == 40) << u;
    }
  }
  EXPECT_GT(between, 20);
}

TEST(SimulatedCamera, SteelDropsPatchesAndBlindsWhereItIsSeenStraight) {
  DepthNoise noise = no_noise();
  noise.steel_dropout = 0.4;
  scenes::Simulated steel = wall_at(1.0, noise, 1, true), paint = wall_at(1.0, noise);
  EXPECT_NEAR(share_without_depth(steel.frame(0)), 0.4, 0.08);
  EXPECT_EQ(share_without_depth(paint.frame(0)), 0.0);
  noise.steel_dropout = 0.0;
  noise.glare_cos = 0.98;
  scenes::Simulated glaring = wall_at(1.0, noise, 1, true);
  const DepthImage& image = glaring.frame(0);
  EXPECT_EQ(image.depth_m(40, 30), 0.0F);
  EXPECT_GT(image.depth_m(0, 0), 0.9F);
}

TEST(SimulatedCamera, SteelShowsWhatItMirrors) {
  DepthNoise noise = no_noise();
  noise.steel_mirrored = 1.0;
  // A mirror at 1 m, tilted by 45°, that shows a wall 0.5 m beside it.
  const geometry::Pose tilted{geometry::rotation_from_rpy(0.0, -M_PI / 4, 0.0), {0.0, 0.0, 1.0}};
  scenes::Simulated camera({{geometry::make_box({0.4, 0.4, 0.0001}).transformed(tilted), true},
                            placed(geometry::make_box({0.02, 9, 9}), {0.51, 0, 0}),
                            placed(geometry::make_box({0.02, 9, 9}), {-0.51, 0, 0})},
                           scenes::depth_camera(8), kAhead, noise);
  EXPECT_NEAR(camera.frame(0).depth_m(40, 30), 1.5, 0.02);
}

TEST(SimulatedCamera, RefusesAnAbsurdModel) {
  DepthNoise noise;
  noise.dropout = 1.5;
  EXPECT_THAT(check_noise(noise).message(), testing::HasSubstr("dropout is 1.5; allowed: 0 to 1"));
  noise = {};
  noise.flying = NAN;
  EXPECT_FALSE(check_noise(noise));
  noise = {};
  noise.steel_patch_px = 0;
  EXPECT_FALSE(check_noise(noise));
  EXPECT_TRUE(check_noise({}));
}

}  // namespace
}  // namespace phantom::fusion
