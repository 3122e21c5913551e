// The peer: nanoflann's tree of the same frame's points, built anew and asked for the nearest point.

#include <benchmark/benchmark.h>

#include <nanoflann.hpp>

#include "tests/bench/fusion_places.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

/// Points as nanoflann reads them.
struct PointSet {
  std::vector<Eigen::Vector3f> points_m;

  std::size_t kdtree_get_point_count() const { return points_m.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points_m[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSet>, PointSet, 3>;

void nanoflann_frame(benchmark::State& state) {
  fusion::scenes::Simulated camera(fusion::scenes::cell_objects(), fusion::scenes::depth_camera(),
                                   fusion::scenes::cell_camera());
  const fusion::DepthImage& image = camera.frame(0);
  PointSet set;
  for (int v = 0; v < image.camera().height_px; ++v) {
    for (int u = 0; u < image.camera().width_px; ++u) {
      const auto depth_m = static_cast<double>(image.depth_m(u, v));
      if (depth_m > 0.0)
        set.points_m.push_back((image.X_WC() * (depth_m * image.camera().direction(u, v))).cast<float>());
    }
  }
  const std::vector<Eigen::Vector3d> places_m = looked_up_places();
  for (auto _ : state) {
    const Tree tree(3, set);  // builds itself
    float sum_m2 = 0.0F;
    for (const Eigen::Vector3d& place_m : places_m) {
      const Eigen::Vector3f at_m = place_m.cast<float>();
      std::uint32_t nearest = 0;
      float distance_m2 = 0.0F;
      tree.knnSearch(at_m.data(), 1, &nearest, &distance_m2);
      sum_m2 += distance_m2;
    }
    benchmark::DoNotOptimize(sum_m2);
  }
}

const bool kNanoflannRegistered = [] {
  benchmark::RegisterBenchmark("nanoflann/640x480/100k", nanoflann_frame)
      ->Iterations(1)
      ->Repetitions(repetitions(3))
      ->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
