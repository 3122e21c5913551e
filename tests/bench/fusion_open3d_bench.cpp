// The peer: Open3D's VoxelBlockGrid, which integrates the same frame on the CPU at the same resolution and
// truncation.

#include <benchmark/benchmark.h>
#include <open3d/core/Tensor.h>
#include <open3d/t/geometry/Image.h>
#include <open3d/t/geometry/VoxelBlockGrid.h>

#include "common/fusion/tests/scenes.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

namespace o3d = open3d::core;

o3d::Tensor tensor_of(const Eigen::Matrix3d& m) {
  std::vector<double> values;
  for (Eigen::Index row = 0; row < 3; ++row)
    for (Eigen::Index column = 0; column < 3; ++column) values.push_back(m(row, column));
  return o3d::Tensor(values, {3, 3}, o3d::Float64);
}

o3d::Tensor tensor_of(const geometry::Pose& X) {
  std::vector<double> values;
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) values.push_back(X.rotation(row, column));
    values.push_back(X.translation_m[row]);
  }
  values.insert(values.end(), {0.0, 0.0, 0.0, 1.0});
  return o3d::Tensor(values, {4, 4}, o3d::Float64);
}

void open3d_integrate(benchmark::State& state) {
  fusion::scenes::Simulated camera(fusion::scenes::cell_objects(), fusion::scenes::depth_camera(),
                                   fusion::scenes::cell_camera());
  const fusion::DepthImage& image = camera.frame(0);
  const fusion::PinholeCamera& pinhole = image.camera();
  const auto truncation_vox = static_cast<float>(fusion::FusionParameters().truncation_vox);
  Eigen::Matrix3d lens;
  lens << pinhole.fx_px, 0.0, pinhole.cx_px, 0.0, pinhole.fy_px, pinhole.cy_px, 0.0, 0.0, 1.0;
  const o3d::Tensor intrinsic = tensor_of(lens), extrinsic = tensor_of(image.X_WC().inverse());
  const open3d::t::geometry::Image depth(
      o3d::Tensor(std::vector<float>(image.depth_m().begin(), image.depth_m().end()),
                  {pinhole.height_px, pinhole.width_px, 1}, o3d::Float32));
  open3d::t::geometry::VoxelBlockGrid grid({"tsdf", "weight"}, {o3d::Float32, o3d::Float32}, {{1}, {1}},
                                           0.005F, 8, 20'000);
  const auto integrate = [&] {
    const o3d::Tensor blocks =
        grid.GetUniqueBlockCoordinates(depth, intrinsic, extrinsic, 1.0F, 6.0F, truncation_vox);
    grid.Integrate(blocks, depth, intrinsic, extrinsic, 1.0F, 6.0F, truncation_vox);
  };
  for (int i = 0; i < 3; ++i) integrate();  // the blocks exist, as ours do
  for (auto _ : state) integrate();
}

const bool kOpen3dRegistered = [] {
  benchmark::RegisterBenchmark("open3d/640x480/5mm", open3d_integrate)
      ->MeasureProcessCPUTime()  // of all its threads
      ->Iterations(10)
      ->Repetitions(repetitions(3))
      ->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
