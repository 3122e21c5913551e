// The peer: OpenVDB's mesh to signed distance, in a band as wide as the layers reach.

#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include "tests/bench/bodies.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

openvdb::FloatGrid::Ptr band_of(const layers::Body& body, double voxel_size_m) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& v : body.mesh_W.vertices_m) points.emplace_back(v.x(), v.y(), v.z());
  for (const auto& t : body.mesh_W.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size_m);
  return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, points, triangles,
                                                            static_cast<float>(body.profile.reach_vox()));
}

void openvdb_sphere(benchmark::State& state, int edge_vox) {
  openvdb::initialize();
  const layers::Body body = sphere_in_box(edge_vox, 317);
  for (auto _ : state)
    benchmark::DoNotOptimize(band_of(body, sphere_grid(edge_vox).voxel_size_m.reference_m()));
}

void openvdb_cell(benchmark::State& state) {
  openvdb::initialize();
  const std::vector<layers::Body> bodies = cell_of(20, {2.0, 2.0, 1.5});
  for (auto _ : state) {
    for (const layers::Body& body : bodies) benchmark::DoNotOptimize(band_of(body, 0.005));
  }
}

const bool kOpenvdbRegistered = [] {
  // TBB spreads over all cores: the CPU time of the whole process counts.
  benchmark::RegisterBenchmark("openvdb/256/200k", openvdb_sphere, 256)
      ->Iterations(1)
      ->Repetitions(repetitions(2))
      ->MeasureProcessCPUTime();
  benchmark::RegisterBenchmark("openvdb_cell/20/400x400x300", openvdb_cell)
      ->Iterations(1)
      ->Repetitions(repetitions(2))
      ->MeasureProcessCPUTime();
  return true;
}();

}  // namespace
}  // namespace phantom::bench
