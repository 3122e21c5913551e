#include "common/percept/mpc.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace phantom::percept {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Five pipes, wide gaps outside and narrow ones near the object.
MpcDesign design() {
  return {0.05,
          0.2,
          {{0.012, 0.10, 0.005},
           {0.010, 0.10, 0.005},
           {0.008, 0.12, 0.010},
           {0.012, 0.20, 0.015},
           {0.015, 0.15, 0.020}}};
}

/// The force on the piston from first principles: flow in, pressure over each open pipe, flow shared by
/// conductance.
double literal_force_N(const MpcDesign& design, std::size_t open, double speed_m_s) {
  const double area_m2 = std::numbers::pi * std::pow(design.cylinder_diameter_m / 2, 2);
  const double flow_m3_s = speed_m_s * area_m2;
  // The pressure at which the open pipes carry just that flow, found by bisection on the sum of their flows.
  double low = 0.0, high = 1e12;
  for (int i = 0; i < 200; ++i) {
    const double pressure_Pa = 0.5 * (low + high);
    double carried = 0.0;
    for (std::size_t p = 0; p < open; ++p) {
      const MpcPipe& pipe = design.pipes[p];
      carried += pressure_Pa * std::numbers::pi * std::pow(pipe.diameter_m, 4) /
                 (128 * design.fluid_viscosity_Pa_s * pipe.length_m);
    }
    (carried < flow_m3_s ? low : high) = pressure_Pa;
  }
  return low * area_m2;
}

std::string refusal(const MpcDesign& wrong, double voxel_size_m = 0.005) {
  const auto layers = mpc_layers(wrong, voxel_size_m, MpcTransition::kStepped);
  EXPECT_FALSE(layers);
  return layers.status().message();
}

TEST(Mpc, ForceIsThatOfThePipesInParallel) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.2, 1.0);
  for (int i = 0; i < 50; ++i) {
    MpcDesign one = design();
    for (MpcPipe& pipe : one.pipes) {
      pipe.diameter_m *= share(random);
      pipe.length_m *= share(random);
    }
    const auto gamma = mpc_gamma_N_s_per_m(one);
    ASSERT_EQ(gamma.size(), 5U);
    for (std::size_t open = 1; open <= 5; ++open) {
      for (const double speed : {0.01, 0.1, 0.7})
        EXPECT_NEAR(speed * gamma[open - 1], literal_force_N(one, open, speed),
                    1e-6 * speed * gamma[open - 1]);
    }
  }
}

TEST(Mpc, OnePipeIsTheSingleBypassCylinder) {
  // F = v·A²·128 μ l / (π d⁴), worked by hand: A = π 0.0025 / 4, ρ = 128·0.1·0.1 / (π·1e-8).
  const MpcDesign single{0.05, 0.1, {{0.01, 0.1, 0.02}}};
  EXPECT_NEAR(pipe_resistance_Pa_s_per_m3(single.pipes[0], 0.1), 4.0744e7, 1e3);
  EXPECT_NEAR(mpc_gamma_N_s_per_m(single)[0], 157.08, 0.01);
}

TEST(Mpc, EqualPipesShareTheFlow) {
  // With n equal pipes γ_n = γ_1 / n: the hyperbola that the thesis's nonlinear sets follow.
  MpcDesign equal{0.05, 0.1, std::vector<MpcPipe>(6, {0.01, 0.1, 0.02})};
  const auto gamma = mpc_gamma_N_s_per_m(equal);
  for (std::size_t n = 1; n <= 6; ++n)
    EXPECT_NEAR(gamma[n - 1], gamma[0] / static_cast<double>(n), 1e-9 * gamma[0]);
}

TEST(Mpc, GapsBecomeWholeVoxels) {
  const auto layers = mpc_layers(design(), 0.005, MpcTransition::kStepped);
  ASSERT_TRUE(layers) << layers.status().message();
  EXPECT_THAT(layers->thickness_vox, ElementsAre(1, 1, 2, 3, 4));
  EXPECT_EQ(layers->gamma_N_s_per_m, mpc_gamma_N_s_per_m(design()));
  // The array of section 3.1.5b: γ along the stroke, a value per voxel.
  std::vector<double> along;
  for (double x = 0.0025; x < 0.055; x += 0.005)
    along.push_back(mpc_gamma_at(design(), x, MpcTransition::kStepped));
  const auto& g = layers->gamma_N_s_per_m;
  EXPECT_THAT(along, ElementsAre(g[0], g[1], g[2], g[2], g[3], g[3], g[3], g[4], g[4], g[4], g[4]));
}

TEST(Mpc, InterpolationMeetsEveryStepInItsMiddleAndFallsInBetween) {
  const MpcDesign one = design();
  const auto gamma = mpc_gamma_N_s_per_m(one);
  double from = 0.0;
  for (std::size_t i = 0; i < 5; from += one.pipes[i++].gap_m) {
    EXPECT_NEAR(mpc_gamma_at(one, from + 0.5 * one.pipes[i].gap_m, MpcTransition::kInterpolated), gamma[i],
                1e-9 * gamma[i]);
  }
  double before = 1e300;
  for (double x = 0.0; x < 0.055; x += 1e-5) {
    const double now = mpc_gamma_at(one, x, MpcTransition::kInterpolated);
    EXPECT_LE(now, before * (1 + 1e-12));
    before = now;
  }
  EXPECT_EQ(mpc_gamma_at(one, 0.056, MpcTransition::kInterpolated), 0.0);
  EXPECT_EQ(mpc_gamma_at(one, 0.056, MpcTransition::kStepped), 0.0);
}

TEST(Mpc, InterpolatedLayersAreFinerAndFall) {
  const auto layers = mpc_layers(design(), 0.001, MpcTransition::kInterpolated);
  ASSERT_TRUE(layers) << layers.status().message();
  int reach = 0;
  for (std::size_t i = 0; i < layers->thickness_vox.size(); ++i) {
    const double middle_m = (reach + 0.5 * layers->thickness_vox[i]) * 0.001;
    EXPECT_NEAR(layers->gamma_N_s_per_m[i], mpc_gamma_at(design(), middle_m, MpcTransition::kInterpolated),
                1e-9 * layers->gamma_N_s_per_m[i]);
    if (i > 0) {
      EXPECT_LT(layers->gamma_N_s_per_m[i], layers->gamma_N_s_per_m[i - 1]);
    }
    reach += layers->thickness_vox[i];
  }
  EXPECT_EQ(reach, 55);
  EXPECT_GT(layers->thickness_vox.size(), 35U);
}

TEST(Mpc, EachFaultIsNamed) {
  MpcDesign wrong = design();
  wrong.cylinder_diameter_m = 0;
  EXPECT_THAT(refusal(wrong), HasSubstr("a cylinder of diameter 0 m"));
  wrong = design();
  wrong.fluid_viscosity_Pa_s = -1;
  EXPECT_THAT(refusal(wrong), HasSubstr("a fluid of -1 Pa·s"));
  wrong = design();
  wrong.pipes.clear();
  EXPECT_THAT(refusal(wrong), HasSubstr("no pipes"));
  wrong = design();
  wrong.pipes[2].diameter_m = 0.06;
  EXPECT_THAT(refusal(wrong),
              HasSubstr("pipe 3 of diameter 0.06 m; allowed: above 0, up to the cylinder's 0.05 m"));
  wrong = design();
  wrong.pipes[1].length_m = std::nan("");
  EXPECT_THAT(refusal(wrong), HasSubstr("pipe 2 of length"));
  EXPECT_THAT(refusal(design(), 0.02), HasSubstr("the gap of pipe 1, 0.005 m, is less than half a voxel"));
}

}  // namespace
}  // namespace phantom::percept
