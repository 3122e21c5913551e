// The SIMD loops, on every instruction set of this machine, against their twin in plain C++.
#include "common/robot/sensing/sensing_kernel.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <random>
#include <set>
#include <string>

#include "common/robot/tests/sensing_kernel_twin.hpp"
#include "common/robot/tests/test_worlds.hpp"
#include "common/workspace/aligned.hpp"

namespace phantom::robot::kernel {
namespace {

/// Calls check() under each instruction set, then under the best.
void on_every_target(const std::function<void()>& check) {
  std::set<std::string> names;
  std::size_t targets = 0;
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1, ++targets) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    SCOPED_TRACE(target_name());
    names.insert(target_name());
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_EQ(names.size(), targets) << "a target was not chosen when asked for";
}

/// Points scattered over the world and beyond it, in a turned frame.
struct Case {
  explicit Case(std::size_t count = 1600) : world(test_worlds::balls()), field(field_of(world)) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-1.3, 1.3), positive(0.1, 3.0);
    for (auto* values : {&x, &y, &z}) {
      for (std::size_t i = 0; i < count; ++i) values->push_back(place(random));
    }
    for (std::size_t i = 0; i < count; ++i)
      weight.push_back(positive(random)), mu.push_back(positive(random));
    points = {x.data(), y.data(), z.data(), weight.data(), count};
    const Eigen::Matrix3d turn = geometry::rotation_from_rpy(0.4, -0.7, 1.1) / 0.01;
    for (Eigen::Index k = 0; k < 9; ++k) to.r[k] = turn(k / 3, k % 3);
    to.t[0] = 118.3, to.t[1] = 121.7, to.t[2] = 122.2;
    palette.resize(256, 0.0F);
    std::copy(world.palette().begin(), world.palette().end(), palette.begin());
    measure();
  }
  void measure() {
    blocks.resize((points.count + kBlock - 1) / kBlock);
    for (auto* steps : {&x_steps, &y_steps, &z_steps}) steps->resize(points.count);
    measure_blocks(points, points.count, blocks.data(), x_steps.data(), y_steps.data(), z_steps.data());
    offsets = {blocks.data(), x_steps.data(), y_steps.data(), z_steps.data()};
  }

  workspace::Workspace world;
  Field field;
  workspace::AlignedVector<double> x, y, z, weight, mu;
  Points points;
  std::vector<Block> blocks;
  workspace::AlignedVector<std::int32_t> x_steps, y_steps, z_steps;
  Offsets offsets{};
  ToVoxels to;
  std::vector<float> palette;
};

void expect_close(const double* actual, const double* expected, std::size_t n, double scale) {
  for (std::size_t k = 0; k < n; ++k) EXPECT_NEAR(actual[k], expected[k], 1e-12 * scale) << "sum " << k;
}

TEST(SensingKernel, LooksUpWhatItsTwinDoes) {
  Case c;
  std::vector<std::uint8_t> expected(c.points.count);
  std::vector<std::uint32_t> expected_voxels(c.points.count);
  scalar::look_up(c.field, c.to, c.points, expected.data(), expected_voxels.data());
  EXPECT_GT(scalar::figures_of(expected.data(), expected.size()).active, 20U);
  on_every_target([&] {
    std::vector<std::uint8_t> codes(c.points.count);
    std::vector<std::uint32_t> voxels(c.points.count);
    look_up(c.field, c.to, c.points, codes.data(), voxels.data());
    EXPECT_EQ(codes, expected);
    EXPECT_EQ(voxels, expected_voxels);
  });
}

TEST(SensingKernel, ItsTwinLooksUpWhatTheWorkspaceHolds) {
  Case c;
  std::vector<std::uint8_t> codes(c.points.count);
  scalar::look_up(c.field, c.to, c.points, codes.data(), nullptr);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(c.to.r);
    const Eigen::Vector3d v =
        r * Eigen::Vector3d(c.x[i], c.y[i], c.z[i]) + Eigen::Vector3d(c.to.t[0], c.to.t[1], c.to.t[2]);
    EXPECT_EQ(codes[i], c.world.mu_code({static_cast<std::int32_t>(std::floor(v.x())),
                                         static_cast<std::int32_t>(std::floor(v.y())),
                                         static_cast<std::int32_t>(std::floor(v.z()))}));
  }
}

TEST(SensingKernel, SensorsExactlyOnBordersAreBeyondThemOnEveryTarget) {
  Case c;
  for (std::size_t i = 0; i < c.points.count; ++i) {
    c.x[i] = 0.01 * static_cast<double>(i % 40), c.y[i] = 0.01 * static_cast<double>(i / 40), c.z[i] = 0.3;
  }
  const ToVoxels straight{{1 / 0.01, 0, 0, 0, 1 / 0.01, 0, 0, 0, 1 / 0.01}, {80, 75, 0}};
  on_every_target([&] {
    std::vector<std::uint8_t> codes(c.points.count);
    look_up(c.field, straight, c.points, codes.data(), nullptr);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const auto x = static_cast<std::int32_t>(i % 40), y = static_cast<std::int32_t>(i / 40);
      ASSERT_EQ(codes[i], c.world.mu_code({80 + x, 75 + y, 30})) << i;
    }
  });
}

TEST(SensingKernel, SumsAgreeWithItsTwin) {
  Case c;
  Moments expected{}, expected_given{};
  std::vector<std::uint8_t> codes(c.points.count);
  scalar::sense(c.field, c.to, c.points, c.palette.data(), codes.data(), expected);
  scalar::add_moments(c.points, c.mu.data(), expected_given);
  on_every_target([&] {
    // Every way to hold a palette: in one, two or four registers, or in memory.
    for (const std::size_t palette_size :
         {std::size_t{7}, std::size_t{12}, std::size_t{24}, std::size_t{50}, std::size_t{256}}) {
      Moments moments{};
      std::vector<std::uint8_t> got(c.points.count);
      sense(c.field, c.to, c.points, c.offsets, c.palette.data(), palette_size, got.data(), moments);
      EXPECT_EQ(got, codes);
      expect_close(moments.sum, expected.sum, 10, expected.sum[0]);
    }
    Moments given{};
    add_moments(c.points, c.mu.data(), given);
    expect_close(given.sum, expected_given.sum, 10, expected_given.sum[0]);
  });
}

/// A tube of points a third of a voxel apart, as a skin has them, carried to `place`; with `straight`, the
/// points of whole lines lie on borders of voxels, or so near to one that floats cannot tell the side.
void lay_tube(Case& c, const Eigen::Vector3d& place, bool straight, bool alike) {
  std::mt19937 random(4);
  std::uniform_int_distribution<int> nudge(-3, 3);
  for (std::size_t i = 0; i < c.points.count; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i % 40) / 40.0,
                 along = 0.0033 * static_cast<double>(i / 40);
    c.x[i] = straight ? 0.01 * static_cast<double>(i % 13) + 1e-10 * std::pow(10.0, i % 5) * nudge(random)
                      : 0.03 * std::cos(angle);
    c.y[i] = straight ? 0.0025 * static_cast<double>(i % 40) : 0.03 * std::sin(angle);
    c.z[i] = along;
    if (alike) c.weight[i] = 0.7;
  }
  const Eigen::Matrix3d turn =
      straight ? Eigen::Matrix3d::Identity() : geometry::rotation_from_rpy(0.4, -0.7, 1.1);
  for (Eigen::Index k = 0; k < 9; ++k) c.to.r[k] = turn(k / 3, k % 3) / 0.01;
  const Eigen::Vector3d origin = (place - c.world.grid().origin_m) / 0.01;
  for (Eigen::Index k = 0; k < 3; ++k) c.to.t[k] = origin[k];
  c.measure();
}

TEST(SensingKernel, NeighboursFoundInFloatsAreWhereDoublesFindThem) {
  Case c;
  int in_fluid = 0;
  for (const bool straight : {false, true}) {
    for (const bool alike : {false, true}) {
      // Amid the balls, at borders of bricks, on the grid's last voxels, beyond them.
      for (const Eigen::Vector3d& place : {Eigen::Vector3d(0.25, 0.15, 0.85),
                                           {-0.24, 0.08, 0.6},
                                           {0.08, 0.08, 0.44},
                                           {0.0, -0.4, 0.9},
                                           {1.15, 0.1, 1.0},
                                           {0.1, 0.1, -0.23},
                                           {3.0, 0.0, 1.0}}) {
        lay_tube(c, place, straight, alike);
        Moments expected{};
        std::vector<std::uint8_t> codes(c.points.count);
        scalar::sense(c.field, c.to, c.points, c.palette.data(), codes.data(), expected);
        in_fluid += scalar::figures_of(codes.data(), codes.size()).active > 100 ? 1 : 0;
        on_every_target([&] {
          Moments moments{};
          std::vector<std::uint8_t> got(c.points.count);
          sense(c.field, c.to, c.points, c.offsets, c.palette.data(), c.world.palette().size(), got.data(),
                moments);
          EXPECT_EQ(got, codes);
          for (int k = 0; k < 10; ++k)
            EXPECT_NEAR(moments.sum[k], expected.sum[k], 1e-11 * expected.sum[0]) << "sum " << k;
        });
      }
    }
  }
  EXPECT_GE(in_fluid, 8);
}

TEST(SensingKernel, LargePalettesAreLookedUpRight) {
  Case c;
  // A μ of its own for every code, and codes all over the range.
  for (std::size_t code = 0; code < 256; ++code) c.palette[code] = static_cast<float>(code * code) * 0.37F;
  std::mt19937 random(2);
  for (const std::size_t palette_size :
       {std::size_t{16}, std::size_t{32}, std::size_t{64}, std::size_t{256}}) {
    for (const workspace::BrickKey key : c.world.bricks()) {
      auto brick = c.world.edit_brick(key);
      for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
        brick.mu_code[i] = static_cast<std::uint8_t>(random() % palette_size);
    }
    std::vector<std::uint8_t> codes(c.points.count);
    Moments expected{};
    scalar::sense(field_of(c.world), c.to, c.points, c.palette.data(), codes.data(), expected);
    on_every_target([&] {
      Moments moments{};
      sense(field_of(c.world), c.to, c.points, c.offsets, c.palette.data(), palette_size, codes.data(),
            moments);
      expect_close(moments.sum, expected.sum, 10, expected.sum[0]);
    });
  }
}

/// With voxels that are as many times longer along each axis.
void stretch(Case& c, const Eigen::Vector3d& stretch) {
  for (std::size_t k = 0; k < 9; ++k) c.to.r[k] /= stretch[static_cast<Eigen::Index>(k / 3)];
  Eigen::Map<Eigen::Vector3d>(c.to.stretch) = stretch;
}

TEST(SensingKernel, SumsAgreeWithItsTwinInVoxelsThatAreNoCubes) {
  for (const Eigen::Vector3d& sides :
       {Eigen::Vector3d(1.0, 1.0, 2.0), Eigen::Vector3d(3.7, 1.0, 1.3), Eigen::Vector3d(1.0, 8.0, 1.0)}) {
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.4, 0.31, 0.2)}) {
      Case c;
      lay_tube(c, place, false, false);
      stretch(c, sides);
      Moments expected{};
      std::vector<std::uint8_t> codes(c.points.count);
      scalar::sense(c.field, c.to, c.points, c.palette.data(), codes.data(), expected);
      on_every_target([&] {
        Moments moments{};
        std::vector<std::uint8_t> got(c.points.count);
        sense(c.field, c.to, c.points, c.offsets, c.palette.data(), 7, got.data(), moments);
        EXPECT_EQ(got, codes);
        expect_close(moments.sum, expected.sum, 10, expected.sum[0]);
      });
    }
  }
}

TEST(SensingKernel, GradientsAgreeWithItsTwin) {
  Case c;
  stretch(c, {1.0, 1.3, 2.0});
  std::vector<std::uint8_t> codes(c.points.count);
  scalar::look_up(c.field, c.to, c.points, codes.data(), nullptr);
  for (const int reach : {1, 4, 7}) {
    for (const double* mu : {static_cast<const double*>(nullptr), static_cast<const double*>(c.mu.data())}) {
      GradientSums expected{};
      scalar::add_gradients(c.field, c.to, c.points, c.palette.data(), codes.data(), mu, reach, expected);
      EXPECT_GT(expected.sum[6], 0.0);
      on_every_target([&] {
        GradientSums sums{};
        add_gradients(c.field, c.to, c.points, c.palette.data(), c.world.palette().size(), codes.data(), mu,
                      reach, sums);
        for (int k = 0; k < 7; ++k) {
          const double scale = std::abs(expected.sum[6]) + (k >= 3 && k < 6 ? 1e3 : 10.0);
          EXPECT_NEAR(sums.sum[k], expected.sum[k], 1e-10 * scale) << "sum " << k;
        }
      });
    }
  }
}

TEST(SensingKernel, CountsCodesOfAnyLength) {
  std::mt19937_64 random(3);
  for (const std::size_t n : {std::size_t{1}, std::size_t{63}, std::size_t{64}, std::size_t{1000}}) {
    std::vector<std::uint8_t> bytes(n);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() % 9);
    CodeFigures expected;
    for (const std::uint8_t byte : bytes) {
      expected.active += byte != 0 ? 1U : 0U;
      expected.greatest = std::max(expected.greatest, byte);
    }
    on_every_target([&] {
      EXPECT_EQ(figures_of(bytes.data(), n).active, expected.active);
      EXPECT_EQ(figures_of(bytes.data(), n).greatest, expected.greatest);
    });
  }
}

TEST(SensingKernel, CountsCodesOfMaskedTiles) {
  std::mt19937_64 random(5);
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{27}}) {
    std::vector<std::uint8_t> bytes(64 * n);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() % 9);
    std::vector<const std::uint8_t*> tiles;
    std::vector<std::uint64_t> masks;
    std::array<std::uint32_t, 9> expected{};
    for (std::size_t t = 0; t < n; ++t) {
      tiles.push_back(&bytes[64 * t]);
      masks.push_back(t == 0 ? ~std::uint64_t{0} : random());
      for (std::size_t i = 0; i < 64; ++i)
        expected[tiles[t][i]] += (masks[t] >> i & 1U) != 0 && tiles[t][i] != 0 ? 1U : 0U;
    }
    masks.push_back(~std::uint64_t{0});  // not to be counted
    const auto check = [&](auto count) {
      std::array<std::uint32_t, 9> counts{};
      count(tiles.data(), masks.data(), n, 9, counts.data());
      EXPECT_EQ(counts, expected);
    };
    check(scalar::count_codes);
    on_every_target([&] { check(count_codes); });
  }
}

}  // namespace
}  // namespace phantom::robot::kernel
