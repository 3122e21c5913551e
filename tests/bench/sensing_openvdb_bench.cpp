// The same tick by the means of OpenVDB: a tree of floats, read through an accessor; all else as ours.

#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>

#include "common/robot/drag/drag.hpp"
#include "tests/bench/sensing_rig.hpp"

namespace phantom::bench {
namespace {

openvdb::FloatGrid::Ptr tree_of(const workspace::Workspace& world) {
  auto grid = openvdb::FloatGrid::create(0.0F);
  auto accessor = grid->getAccessor();
  for (const workspace::BrickKey key : world.bricks()) {
    for (std::int32_t i = 0; i < 32 * 32 * 32; ++i) {
      const workspace::Index3 v{key.x * 32 + i % 32, key.y * 32 + i / 32 % 32, key.z * 32 + i / 1024};
      if (const float mu = world.mu(v); mu > 0.0F) accessor.setValue(openvdb::Coord(v.x, v.y, v.z), mu);
    }
  }
  return grid;
}

void openvdb_tick(benchmark::State& state, std::size_t sensors) {
  openvdb::initialize();
  const robot::SerialArm arm = tube_arm(7);
  const robot::SkinLayout skin = tube_skin(arm, sensors);
  const workspace::Workspace& world = balls(400);
  const auto grid = tree_of(world);
  const double s = world.grid().voxel_size_m.reference_m();
  robot::LinkPoses X_WL;
  robot::DragCoefficients drag;
  int step = 0;
  for (auto _ : state) {
    arm.link_poses(pose(7, ++step), X_WL);
    const auto accessor = grid->getConstAccessor();
    robot::LinkSums sums{};
    for (std::size_t link = 1; link <= 7; ++link) {
      const Eigen::Matrix3d r = X_WL[link].rotation / s;
      const Eigen::Vector3d t = (X_WL[link].translation_m - world.grid().origin_m) / s;
      double m[10] = {};
      for (std::size_t i = skin.first[link]; i < skin.first[link + 1]; ++i) {
        const double x = skin.x_m[i], y = skin.y_m[i], z = skin.z_m[i];
        const auto index = [&](int row) {
          return static_cast<std::int32_t>(
              std::floor(r(row, 0) * x + r(row, 1) * y + r(row, 2) * z + t[row]));
        };
        const double w = skin.weight[i] *
                         static_cast<double>(accessor.getValue(openvdb::Coord(index(0), index(1), index(2))));
        m[0] += w, m[1] += w * x, m[2] += w * y, m[3] += w * z;
        m[4] += w * x * x, m[5] += w * x * y, m[6] += w * x * z, m[7] += w * y * y, m[8] += w * y * z,
            m[9] += w * z * z;
      }
      sums[link].mu = m[0];
      sums[link].mu_d = X_WL[link].rotation * Eigen::Vector3d(m[1], m[2], m[3]);
      Eigen::Matrix3d second;
      second << m[4], m[5], m[6], m[5], m[7], m[8], m[6], m[8], m[9];
      sums[link].mu_dd = X_WL[link].rotation * second * X_WL[link].rotation.transpose();
    }
    robot::drag_coefficients(arm, X_WL, sums, {}, {}, drag);
    benchmark::DoNotOptimize(drag.coupled[0]);
  }
}

const bool kOpenvdbRegistered = [] {
  for (const std::size_t sensors : {std::size_t{1000}, std::size_t{10'000}, std::size_t{100'000}})
    benchmark::RegisterBenchmark(("openvdb_tick/" + std::to_string(sensors / 1000) + "k/400").c_str(),
                                 openvdb_tick, sensors);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
