// A range image that a real sensor measured, with the points that other software made of it: Debian's
// mrpt-common. 640 × 480 pixels of a structured-light camera, 1.6 to 2.6 m away.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "common/fusion/depth_noise.hpp"
#include "common/fusion/fusion.hpp"
#include "common/fusion/tests/scenes.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::fusion {
namespace {

constexpr const char* kFile = "/usr/share/mrpt/datasets/tests_rgbd.rawlog";
/// The camera's calibration, as the file has it.
const PinholeCamera kCamera{640, 480, 572.88275, 542.73997, 314.64917, 240.16026, 0.4, 5.0};

/// What the file holds: an object of class CObservation3DRangeScan, version 9, gzipped.
struct RangeScan {
  std::vector<float> x_m, y_m, z_m;  // points: x ahead, y left, z up
  std::vector<std::uint16_t> column, row;
  std::vector<std::uint16_t> depth_mm;
};

class Octets {
 public:
  explicit Octets(std::vector<char> octets) : octets_(std::move(octets)) {}
  template <class Value>
  Value one() {
    return many<Value>(1)[0];
  }
  template <class Value>
  std::vector<Value> many(std::size_t count) {
    std::vector<Value> values(count);
    if (octets_.size() - at_ < count * sizeof(Value)) throw std::runtime_error("the file ends too early");
    std::memcpy(values.data(), octets_.data() + at_, count * sizeof(Value));
    at_ += count * sizeof(Value);
    return values;
  }
  /// Reads an object's class and version.
  void expect(const std::string& name, std::uint8_t version) {
    const auto length = static_cast<std::size_t>(one<std::uint8_t>() & 0x7F);
    const auto found = many<char>(length);
    if (std::string(found.begin(), found.end()) != name || one<std::uint8_t>() != version)
      throw std::runtime_error("the file has another object than " + name);
  }

 private:
  std::vector<char> octets_;
  std::size_t at_ = 0;
};

std::vector<char> unzipped() {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(kFile, "rb"), gzclose);
  if (!file) throw std::runtime_error("mrpt-common is missing; scripts/setup --data installs it");
  std::vector<char> octets(8'000'000);
  const int read = gzread(file.get(), octets.data(), static_cast<unsigned>(octets.size()));
  if (read < 0) throw std::runtime_error("the file is no gzip");
  octets.resize(static_cast<std::size_t>(read));
  return octets;
}

RangeScan load() {
  Octets octets(unzipped());
  RangeScan scan;
  octets.expect("mrpt::obs::CObservation3DRangeScan", 9);
  octets.one<float>();  // greatest range
  octets.expect("mrpt::poses::CPose3D", 3);
  octets.many<double>(12);
  octets.one<std::uint8_t>();  // end of the pose
  if (octets.one<std::uint8_t>() != 1) throw std::runtime_error("the file has no points");
  const auto count = octets.one<std::uint32_t>();
  scan.x_m = octets.many<float>(count);
  scan.y_m = octets.many<float>(count);
  scan.z_m = octets.many<float>(count);
  scan.column = octets.many<std::uint16_t>(count);
  scan.row = octets.many<std::uint16_t>(count);
  if (octets.one<std::uint8_t>() != 1 || octets.one<float>() != 1e-3F)
    throw std::runtime_error("the file has no range image in mm");
  const auto rows = octets.one<std::uint32_t>(), columns = octets.one<std::uint32_t>();
  if (rows != 480 || columns != 640) throw std::runtime_error("the range image has another size");
  scan.depth_mm = octets.many<std::uint16_t>(std::size_t{rows} * columns);
  return scan;
}

class RangeImage : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(image_.load_mm({kCamera, {}, 1.0}, scan_.depth_mm));
    ASSERT_EQ(image_.valid_pixels(), scan_.x_m.size());
  }
  const RangeScan scan_ = load();
  DepthImage image_;
};

TEST_F(RangeImage, ItsPointsAreThoseThatOtherSoftwareMakesOfIt) {
  double most_m = 0.0;
  for (std::size_t i = 0; i < scan_.x_m.size(); ++i) {
    const int u = scan_.column[i], v = scan_.row[i];
    const Eigen::Vector3d p = static_cast<double>(image_.depth_m(u, v)) * kCamera.direction(u, v);
    const Eigen::Vector3d theirs(-static_cast<double>(scan_.y_m[i]), -static_cast<double>(scan_.z_m[i]),
                                 static_cast<double>(scan_.x_m[i]));
    most_m = std::max(most_m, (p - theirs).norm());
  }
  EXPECT_LT(most_m, 1e-5);
}

/// Returns the sensor's step between two depths, as it would be at 1 m: it grows with the square.
double quantum_at_1m_m(std::vector<std::uint16_t> depth_mm) {
  std::ranges::sort(depth_mm);
  const auto doubles = std::ranges::unique(depth_mm);
  depth_mm.erase(doubles.begin(), depth_mm.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < depth_mm.size(); ++i) {
    if (depth_mm[i - 1] == 0) continue;
    const double middle_m = 5e-4 * (depth_mm[i] + depth_mm[i - 1]);
    steps.push_back(1e-3 * (depth_mm[i] - depth_mm[i - 1]) / (middle_m * middle_m));
  }
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return steps[steps.size() / 2];
}

TEST_F(RangeImage, ASimulatedSensorHasStepsLikeIt) {
  const double real_m = quantum_at_1m_m(scan_.depth_mm);
  DepthNoise noise;
  noise.sigma.at_1m_m = 0.0;
  noise.quantum_at_1m_m = real_m;
  scenes::Simulated camera({scenes::placed(geometry::make_box({0.02, 9.0, 9.0}), {0.0, 0.0, 0.0})}, kCamera,
                           scenes::looking_at({1.5, 1.5, 0.1}, {0.0, 0.0, 0.0}), noise);
  std::vector<std::uint16_t> made;
  for (const float depth_m : camera.frame(1).depth_m())
    made.push_back(static_cast<std::uint16_t>(std::lround(1e3F * depth_m)));
  std::cout << "the sensor's steps are " << 1e3 * real_m << " mm at 1 m\n";
  EXPECT_NEAR(quantum_at_1m_m(made), real_m, 0.1 * real_m);
}

TEST_F(RangeImage, WhatIsPublishedIsWhatWasMeasured) {
  FusionParameters parameters;
  parameters.grid = {{-1.4, -1.1, 1.5}, 0.005, {560, 440, 240}};
  parameters.max_blocks = 20'000;
  Fusion fusion = Fusion::create(parameters).value();
  for (int i = 0; i < 60; ++i) fusion.integrate(image_);

  // A voxel is at a surface, or at most a shell behind it, by the nearest and the farthest pixel around.
  const auto column_of = [](double at) { return static_cast<int>(std::lround(at)); };
  std::size_t published = 0, before = 0, behind = 0;
  workspace::VoxelBox::of(parameters.grid).for_each([&](workspace::Index3 voxel) {
    if (!fusion.occupied().get(voxel)) return;
    ++published;
    const Eigen::Vector3d p = parameters.grid.centre_of(voxel);
    const int u = column_of(kCamera.fx_px * p.x() / p.z() + kCamera.cx_px),
              v = column_of(kCamera.fy_px * p.y() / p.z() + kCamera.cy_px);
    double least_m = 1e9, most_m = 0.0;
    for (int dv = -2; dv <= 2; ++dv) {
      for (int du = -2; du <= 2; ++du) {
        if (u + du < 0 || v + dv < 0 || u + du >= kCamera.width_px || v + dv >= kCamera.height_px) continue;
        const auto depth_m = static_cast<double>(image_.depth_m(u + du, v + dv));
        if (depth_m == 0.0) continue;
        least_m = std::min(least_m, depth_m);
        most_m = std::max(most_m, depth_m);
      }
    }
    before += p.z() < least_m - 0.01 ? 1 : 0;
    behind += p.z() > most_m + 0.005 * (parameters.shell_vox + 2.0) ? 1 : 0;
  });
  std::size_t points = 0, found = 0;
  for (std::size_t i = 0; i < scan_.x_m.size(); i += 7) {
    const int u = scan_.column[i], v = scan_.row[i];
    const Eigen::Vector3d p = static_cast<double>(image_.depth_m(u, v)) * kCamera.direction(u, v);
    const workspace::Index3 at = parameters.grid.index_of(p);
    if (!workspace::VoxelBox::of(parameters.grid).grown(-3).contains(at)) continue;
    ++points;
    bool near = false;
    workspace::VoxelBox{at, {1, 1, 1}}.grown(2).for_each(
        [&](workspace::Index3 n) { near = near || fusion.occupied().get(n); });
    found += near ? 1 : 0;
  }
  std::cout << published << " voxels are published, " << before << " of them before what was measured, "
            << behind << " behind it; of " << points << " measured points " << found
            << " have one within 2 voxels\n";
  ASSERT_GT(published, 50'000U);
  EXPECT_EQ(before, 0U);
  EXPECT_EQ(behind, 0U);
  EXPECT_GT(static_cast<double>(found), 0.98 * static_cast<double>(points));
}

/// A still scene, seen with steps as coarse as the sensor's.
TEST_F(RangeImage, StepsAsCoarseAsItsOwnDoNotMakeAStillSceneFlicker) {
  DepthNoise noise;
  noise.quantum_at_1m_m = quantum_at_1m_m(scan_.depth_mm);
  noise.steel_mirrored = 0.0;
  FusionParameters parameters;
  parameters.grid = scenes::cell_grid();
  parameters.max_blocks = 20'000;
  Fusion fusion = Fusion::create(parameters).value();
  scenes::Simulated camera(scenes::cell_objects(), scenes::depth_camera(), scenes::cell_camera(), noise);
  std::size_t bricks = 0;
  constexpr std::uint64_t kImages = 300, kSettled = 100;
  for (std::uint64_t i = 0; i < kImages; ++i) {
    fusion.integrate(camera.frame(i));
    std::vector<workspace::Index3> changed;
    for (const workspace::Index3 block : fusion.changed_blocks())
      changed.push_back(workspace::brick_of(kBlockEdge * block));
    std::ranges::sort(changed);
    const auto doubles = std::ranges::unique(changed);
    if (i >= kSettled) bricks += static_cast<std::size_t>(doubles.begin() - changed.begin());
    fusion.clear_changes();
  }
  const double bricks_an_image = static_cast<double>(bricks) / (kImages - kSettled);
  std::cout << bricks_an_image << " bricks changed an image\n";
  EXPECT_LE(bricks_an_image, 5.0);
}

}  // namespace
}  // namespace phantom::fusion
