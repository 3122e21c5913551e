// The peer: OctoMap's insertion of the same frame as a point cloud, with rays, at the same resolution.

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>

#include "common/fusion/tests/scenes.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

void octomap_insert(benchmark::State& state) {
  fusion::scenes::Simulated camera(fusion::scenes::cell_objects(), fusion::scenes::depth_camera(),
                                   fusion::scenes::cell_camera());
  const fusion::DepthImage& image = camera.frame(0);
  const auto point = [](const Eigen::Vector3d& p_m) {
    return octomap::point3d(static_cast<float>(p_m.x()), static_cast<float>(p_m.y()),
                            static_cast<float>(p_m.z()));
  };
  octomap::Pointcloud cloud;
  for (int v = 0; v < image.camera().height_px; ++v) {
    for (int u = 0; u < image.camera().width_px; ++u) {
      const auto depth_m = static_cast<double>(image.depth_m(u, v));
      if (depth_m > 0.0) cloud.push_back(point(image.X_WC() * (depth_m * image.camera().direction(u, v))));
    }
  }
  octomap::OcTree tree(0.005);
  tree.insertPointCloud(cloud, point(image.X_WC().translation_m));  // the tree exists, as ours does
  for (auto _ : state) tree.insertPointCloud(cloud, point(image.X_WC().translation_m));
}

const bool kOctomapRegistered = [] {
  benchmark::RegisterBenchmark("octomap/640x480/5mm", octomap_insert)
      ->Iterations(1)
      ->Repetitions(repetitions(2))
      ->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
