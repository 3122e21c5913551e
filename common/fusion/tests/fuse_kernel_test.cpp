// The vector kernels against literal statements of what they compute.
#include "common/fusion/fuse_kernel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <set>

#include "common/geometry/pose.hpp"

namespace phantom::fusion::detail {
namespace {

constexpr int kWidth = 90, kHeight = 70;
constexpr double kFocal = 80.0;

struct Twin {
  double distance = 0.0;
  int weight = 0;
  bool observed = false, in_front = false, occupied = false, behind = false, saturated = false;
  bool doubtful = false;  ///< a decision is so close that rounding may turn it
};

bool close(double a, double b) { return std::abs(a - b) < 4e-3; }

/// One voxel, word for word.
Twin fused_by_twin(const FrameView& f, double u, double v, double z, double held, int weight) {
  const FuseRules& r = f.rules;
  Twin twin{held, weight};
  const double column = u / z, row = v / z;
  const auto on_border = [](double pixel) { return std::abs(pixel - std::floor(pixel) - 0.5) < 1e-3; };
  if (on_border(column) || on_border(row)) twin.doubtful = true;
  const long x = std::lround(column), y = std::lround(row);
  if (z <= static_cast<double>(f.min_z) || x < 0 || x >= f.width || y < 0 || y >= f.height) return twin;
  const auto given = static_cast<double>(f.depth[y * f.width + x]);
  const double depth = std::abs(given), raw = depth - z, tau = static_cast<double>(r.truncation),
               sigma = static_cast<double>(r.sigma) * z * z;
  // Before the arm (below 0) only what is free is measured.
  const double least = given < 0.0 ? tau : -tau - 3.0 * sigma;
  if (close(raw, least)) twin.doubtful = true;
  if (depth == 0.0 || raw < least) return twin;
  twin.observed = true;
  const double measured = std::clamp(raw, -tau, tau);
  const bool was_saturated = held >= 0.95 * tau;
  if (close(held, 0.95 * tau)) twin.doubtful = true;
  const double deviation = std::abs((was_saturated ? measured : raw) - held);
  double limit = static_cast<double>(r.surprise_sigmas * r.sigma) * depth * depth;
  if (was_saturated) limit = std::min(limit, 0.75 * tau);
  limit = std::max(limit, static_cast<double>(r.surprise));
  if (close(deviation, limit)) twin.doubtful = true;
  const bool reset = deviation > limit;
  twin.weight = reset ? 1 : std::min(weight + 1, static_cast<int>(r.max_weight));
  twin.distance = reset || weight == 0 ? measured : held + (measured - held) / twin.weight;
  const double enough = std::min(std::pow(sigma / static_cast<double>(r.decision_sigma), 2),
                                 static_cast<double>(r.max_weight) - 3.0);
  if (close(twin.weight, enough) || close(twin.weight, enough + 3.0)) twin.doubtful = true;
  const double band =
      twin.weight >= enough && twin.weight < enough + 3.0 ? 0.0 : static_cast<double>(r.hysteresis);
  const double d = twin.distance, shell = static_cast<double>(r.shell);
  for (const double limit_of_vote : {band, -band, -shell + band, -shell - band, 0.95 * tau})
    twin.doubtful = twin.doubtful || close(d, limit_of_vote);
  twin.in_front = d > band;
  twin.occupied = d < -band && d > -shell + band;
  twin.behind = d < -shell - band;
  twin.saturated = d >= 0.95 * tau;
  return twin;
}

struct Case {
  std::vector<float> depth;
  std::unique_ptr<FrameView> view = std::make_unique<FrameView>();
  std::unique_ptr<FusedBlock> block = std::make_unique<FusedBlock>();
  float u = 0.0F, v = 0.0F, z = 0.0F;
};

/// A block somewhere near a noisy surface, with any content.
Case random_case(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Case c;
  const double distance = 200.0 + 100.0 * unit(random);
  c.depth.push_back(0.0F);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const auto depth = static_cast<float>(distance + 6.0 * unit(random));
    const auto kind = random() % 9;
    c.depth.push_back(kind == 0 ? 0.0F : kind == 1 ? -depth : depth);
  }
  c.view->depth = c.depth.data() + 1;
  c.view->width = kWidth;
  c.view->height = kHeight;
  c.view->min_z = 5.0F;
  c.view->rules.sigma = 0.0015F * 0.005F;
  const Eigen::Matrix3d R = geometry::rotation_from_rpy(3 * unit(random), 3 * unit(random), 3 * unit(random));
  std::size_t i = 0;
  voxels_of({}).for_each([&](workspace::Index3 voxel) {
    const Eigen::Vector3d p = R * workspace::vector(voxel);
    c.view->du[i] = static_cast<float>(kFocal * p.x() + 44.5 * p.z());
    c.view->dv[i] = static_cast<float>(kFocal * p.y() + 34.5 * p.z());
    c.view->dz[i++] = static_cast<float>(p.z());
  });
  const double z = distance + 9.0 * unit(random);
  c.u = static_cast<float>(z * (45.0 + 52.0 * unit(random)));  // also beyond the image
  c.v = static_cast<float>(z * (35.0 + 42.0 * unit(random)));
  c.z = static_cast<float>(z);
  for (i = 0; i < kBlockVoxels; ++i) {
    const bool known = random() % 4 != 0;
    const double held = std::clamp(distance - z + 5.0 * unit(random), -4.0, 4.0);
    c.block->distance[i] = static_cast<std::int16_t>(known ? kDistanceSteps * held : 0.0);
    c.block->weight[i] = static_cast<std::uint8_t>(known ? 1 + random() % 128 : 0);
  }
  return c;
}

bool has(const BlockBits& bits, std::size_t i) { return (bits[i / 64] >> (i % 64) & 1) != 0; }

TEST(FuseKernel, EqualsItsTwinToTwoSteps) {
  std::mt19937 random(1);
  std::size_t doubtful = 0, all = 0, resets = 0;
  std::array<std::size_t, 5> votes_seen{};
  for (int n = 0; n < 200; ++n) {
    const Case c = random_case(random);
    FusedBlock fused = *c.block;
    BlockVotes votes;
    fuse_block(*c.view, c.u, c.v, c.z, fused, votes);
    for (std::size_t i = 0; i < kBlockVoxels; ++i) {
      const Twin twin = fused_by_twin(*c.view, static_cast<double>(c.u) + static_cast<double>(c.view->du[i]),
                                      static_cast<double>(c.v) + static_cast<double>(c.view->dv[i]),
                                      static_cast<double>(c.z) + static_cast<double>(c.view->dz[i]),
                                      c.block->distance[i] / kDistanceSteps, c.block->weight[i]);
      ++all;
      doubtful += twin.doubtful ? 1 : 0;
      if (twin.doubtful) continue;
      ASSERT_EQ(has(votes.observed, i), twin.observed) << n << ' ' << i;
      ASSERT_EQ(int{fused.weight[i]}, twin.weight) << n << ' ' << i;
      ASSERT_NEAR(fused.distance[i], kDistanceSteps * twin.distance, 2.0) << n << ' ' << i;
      const std::pair<const BlockBits*, bool> expected[] = {{&votes.observed, twin.observed},
                                                            {&votes.in_front, twin.in_front},
                                                            {&votes.occupied, twin.occupied},
                                                            {&votes.behind, twin.behind},
                                                            {&votes.saturated, twin.saturated}};
      for (std::size_t k = 0; k < std::size(expected); ++k) {
        ASSERT_EQ(has(*expected[k].first, i), expected[k].second) << n << ' ' << i << ' ' << k;
        votes_seen[k] += expected[k].second ? 1 : 0;
      }
      resets += twin.observed && c.block->weight[i] > 1 && twin.weight == 1 ? 1 : 0;
    }
  }
  EXPECT_LT(doubtful, all / 10);
  for (const std::size_t seen : votes_seen) EXPECT_GT(seen, 200U);
  EXPECT_GT(resets, 200U);
}

TEST(FuseKernel, FindsEveryBlockOfTheBandThatHasNoContent) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::size_t found_in_all = 0;
  for (int n = 0; n < 100; ++n) {
    RayView rays;
    rays.size = {20, 17, 13};
    std::vector<std::int32_t> directory(20 * 17 * 13);
    for (std::int32_t& slot : directory) slot = random() % 3 == 0 ? 5 : BlockPool::kNoSlot;
    rays.directory = directory.data();
    rays.inverse_fx = rays.inverse_fy = static_cast<float>(1.0 / kFocal);
    rays.cx = 44.5F;
    rays.cy = 34.5F;
    const Eigen::Matrix3d R =
        geometry::rotation_from_rpy(3 * unit(random), 3 * unit(random), 3 * unit(random));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<std::size_t>(axis);
      rays.eye[at] = static_cast<float>(9.0 + 5.0 * unit(random));
      rays.along_x[at] = static_cast<float>(R(axis, 0));
      rays.along_y[at] = static_cast<float>(R(axis, 1));
      rays.along_z[at] = static_cast<float>(R(axis, 2));
    }
    std::vector<float> row;
    for (int u = 0; u < kWidth; ++u)
      row.push_back(static_cast<float>(40.0 + 25.0 * unit(random)) * (random() % 5 == 0   ? 0.0F
                                                                      : random() % 5 == 0 ? -1.0F
                                                                                          : 1.0F));
    std::vector<std::int32_t> missing(max_missing(kWidth));
    const int v = static_cast<int>(random() % kHeight);
    missing.resize(find_missing(rays, row.data(), kWidth, v, missing.data()));
    std::set<std::int32_t> expected, perhaps;
    for (int u = 0; u < kWidth; ++u) {
      for (const double offset : {-4.0, 0.0, 4.0}) {
        if (row[static_cast<std::size_t>(u)] <= 0.0F) continue;
        const Eigen::Vector3d direction{(u - 44.5) / kFocal, (v - 34.5) / kFocal, 1.0};
        const Eigen::Vector3d p =
            Eigen::Vector3d(static_cast<double>(rays.eye[0]), static_cast<double>(rays.eye[1]),
                            static_cast<double>(rays.eye[2])) +
            R * direction * (static_cast<double>(row[static_cast<std::size_t>(u)]) + offset) / 8.0;
        const Eigen::Vector3d whole = p.array().floor();
        if ((p.array() < 0.0).any() || whole.x() >= 20 || whole.y() >= 17 || whole.z() >= 13) continue;
        const auto place = static_cast<std::int32_t>(whole.x() + 20.0 * (whole.y() + 17.0 * whole.z()));
        const bool on_border = ((p - whole).array() < 1e-4).any() || ((p - whole).array() > 1.0 - 1e-4).any();
        if (directory[static_cast<std::size_t>(place)] == BlockPool::kNoSlot)
          (on_border ? perhaps : expected).insert(place);
      }
    }
    const std::set<std::int32_t> found(missing.begin(), missing.end());
    found_in_all += found.size();
    for (const std::int32_t place : expected) EXPECT_TRUE(found.contains(place));
    for (const std::int32_t place : found) {
      EXPECT_EQ(directory[static_cast<std::size_t>(place)], BlockPool::kNoSlot);
      EXPECT_TRUE(expected.contains(place) || perhaps.contains(place));
    }
  }
  EXPECT_GT(found_in_all, 500U);
}

}  // namespace
}  // namespace phantom::fusion::detail
