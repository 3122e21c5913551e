// The phantom's tick: the rows of rows/sensing.json.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>

#include "common/percept/closeness.hpp"
#include "common/robot/sensing/sensing_kernel.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "tests/bench/bare_gather.hpp"
#include "tests/bench/sensing_rig.hpp"

namespace phantom::bench {
namespace {

using benchmark::RegisterBenchmark;
using benchmark::State;

void count_sensors(State& state, std::size_t sensors) {
  state.counters["sensors"] = static_cast<double>(sensors);
  state.counters["sensors_per_s"] =
      benchmark::Counter(static_cast<double>(sensors), benchmark::Counter::kIsIterationInvariantRate);
}

/// Kinematics, all sensors, coefficients of all joints, in a slowly changing pose.
struct Tick {
  Tick(const robot::SerialArm& arm_in, const robot::SkinLayout& skin, const robot::SensingOptions& options)
      : arm(arm_in), sensing(skin, options), law{.enabled = options.gradient} {
    std::fill_n(v.begin(), arm.joint_count(), 0.1);
  }

  void run(const workspace::Workspace& world) {
    arm.link_poses(pose(arm.joint_count(), ++step), X_WL);
    sensing.sense(X_WL, arm.joint_count(), world);
    robot::drag_coefficients(arm, X_WL, sensing.sums(), law, v, drag);
    benchmark::DoNotOptimize(drag.coupled[0]);
  }

  const robot::SerialArm& arm;
  robot::SkinSensing sensing;
  robot::DirectionalLaw law;
  core::JointArray v{};
  robot::LinkPoses X_WL;
  robot::DragCoefficients drag;
  int step = 0;
};

void tick_in(State& state, const workspace::Workspace& world, std::size_t sensors, std::size_t joints,
             const robot::SensingOptions& options) {
  const robot::SerialArm arm = tube_arm(joints);
  const robot::SkinLayout skin = tube_skin(arm, sensors);
  Tick work(arm, skin, options);
  for (auto _ : state) work.run(world);
  count_sensors(state, skin.size());
  state.counters["ns_per_sensor"] =
      benchmark::Counter(1e-9 * static_cast<double>(skin.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["in_fluid"] = static_cast<double>(work.sensing.active()) / static_cast<double>(skin.size());
  state.SetLabel(robot::kernel::target_name());
}

void tick(State& state, std::size_t sensors, int edge_vox, std::size_t joints,
          const robot::SensingOptions& options = {}) {
  tick_in(state, balls(edge_vox), sensors, joints, options);
}

/// The whole step of phantom_sensing at the same poses: with the percept, the threats of each link and
/// object, and what the arm feels held against the model.
void step_of(State& state, std::size_t sensors, int edge_vox) {
  const workspace::Workspace& world = balls(edge_vox);
  robot::SerialArm arm = tube_arm(7);
  robot::SkinLayout skin = tube_skin(arm, sensors);
  const phantom_sensing::PhantomModel model{std::move(arm), std::move(skin)};
  phantom_sensing::PerceptSettings settings;
  settings.threads = 1;
  phantom_sensing::PhantomSensing sensing(model, settings);
  phantom_sensing::StepOutputs outputs;
  phantom_sensing::StepInputs inputs;
  inputs.dt_s = 0.001;
  inputs.state_valid = true;
  inputs.workspace = {&world, percept::greatest_neighbour_mu(world)};
  inputs.force.known = true;
  std::fill_n(inputs.velocity.begin(), model.arm.joint_count(), 0.1);
  int step = 0;
  for (auto _ : state) {
    inputs.position = pose(model.arm.joint_count(), ++step);
    sensing.step(inputs, outputs);
    benchmark::DoNotOptimize(outputs.drag.coupled[0]);
  }
  count_sensors(state, model.skin.size());
}

/// What a tick costs least and most, by what is in the voxels.
enum class Content { kFree, kMixed };

void tick_of(State& state, std::size_t sensors, Content content, const robot::SensingOptions& options) {
  tick_in(state, content == Content::kFree ? free_space(400) : mixed_fluid(400), sensors, 7, options);
}

/// Where the same sensors are in the same pose, found beforehand.
struct Places {
  std::vector<std::int32_t> brick, word, tile_word,
      row_word;  // in the directory, a brick, all bricks, dense rows
  std::vector<std::uint32_t> tile_shift, row_shift;
};

Places places_of(const robot::SerialArm& arm, const robot::SkinLayout& skin,
                 const workspace::Workspace& world) {
  robot::LinkPoses X_WL;
  arm.link_poses(pose(arm.joint_count(), 0), X_WL);
  const auto& size = world.grid().size_vox;
  Places places;
  for (std::size_t i = 0; i < skin.size() / 16 * 16; ++i) {
    workspace::Index3 v = world.grid().index_of(X_WL[skin.link_of(i)] * skin.position(i));
    if (!world.grid().contains(v)) v = {0, 0, 0};
    const std::size_t at = world.directory_index({v.x >> 5, v.y >> 5, v.z >> 5});
    const std::size_t offset =
        workspace::brick_offset(static_cast<std::uint32_t>(v.x) & 31U, static_cast<std::uint32_t>(v.y) & 31U,
                                static_cast<std::uint32_t>(v.z) & 31U);
    const std::int32_t row = (v.z * size[1] + v.y) * size[0] + v.x;
    places.brick.push_back(static_cast<std::int32_t>(at));
    places.word.push_back(static_cast<std::int32_t>(offset / 4));
    places.tile_word.push_back(
        static_cast<std::int32_t>(world.directory()[at] * (workspace::kBrickVoxels / 4) + offset / 4));
    places.tile_shift.push_back(static_cast<std::uint32_t>(offset % 4) * 8);
    places.row_word.push_back(row / 4);
    places.row_shift.push_back(static_cast<std::uint32_t>(row % 4) * 8);
  }
  return places;
}

/// What the gather reads through: directory and bricks, bricks alone, or rows of a dense array.
enum class Through { kDirectory, kTiles, kRows };

void gather(State& state, std::size_t sensors, int edge_vox, Through through) {
  const robot::SerialArm arm = tube_arm(7);
  const robot::SkinLayout skin = tube_skin(arm, sensors);
  const workspace::Workspace& world = balls(edge_vox);
  const Places places = places_of(arm, skin, world);
  const std::size_t n = places.brick.size();
  std::vector<std::uint8_t> dense;
  if (through == Through::kRows) {
    for (std::int32_t z = 0; z < edge_vox; ++z) {
      for (std::int32_t y = 0; y < edge_vox; ++y) {
        for (std::int32_t x = 0; x < edge_vox; ++x) dense.push_back(world.mu_code({x, y, z}));
      }
    }
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        through == Through::kDirectory ? bare_gather(world.directory(), world.codes(), places.brick.data(),
                                                     places.word.data(), places.tile_shift.data(), n)
        : through == Through::kTiles
            ? bare_gather_flat(world.codes(), places.tile_word.data(), places.tile_shift.data(), n)
            : bare_gather_flat(dense.data(), places.row_word.data(), places.row_shift.data(), n));
  }
  count_sensors(state, n);
}

/// Moving sensors to codes, without the sums: every sensor's place is found anew.
void look_up(State& state, std::size_t sensors, int edge_vox) {
  const robot::SerialArm arm = tube_arm(7);
  const robot::SkinLayout skin = tube_skin(arm, sensors);
  const workspace::Workspace& world = balls(edge_vox);
  const double s = world.grid().voxel_size_m.reference_m();
  std::vector<std::uint8_t> codes(skin.size() + 16);
  robot::LinkPoses X_WL;
  int step = 0;
  for (auto _ : state) {
    arm.link_poses(pose(7, ++step), X_WL);
    for (std::size_t link = 1; link <= 7; ++link) {
      robot::kernel::ToVoxels to;
      const Eigen::Vector3d t = (X_WL[link].translation_m - world.grid().origin_m) / s;
      for (Eigen::Index k = 0; k < 9; ++k) to.r[k] = X_WL[link].rotation(k / 3, k % 3) / s;
      for (Eigen::Index k = 0; k < 3; ++k) to.t[k] = t[k];
      const std::size_t first = skin.first[link], n = (skin.first[link + 1] - first) / 16 * 16;
      robot::kernel::look_up(robot::kernel::field_of(world), to,
                             {&skin.x_m[first], &skin.y_m[first], &skin.z_m[first], &skin.weight[first], n},
                             &codes[first], nullptr);
    }
    benchmark::DoNotOptimize(codes.data());
    benchmark::ClobberMemory();
  }
  count_sensors(state, skin.size());
}

/// Spread of the tick: the slowest of many against their median, by the wall clock.
void spread(State& state, std::size_t sensors) {
  const robot::SerialArm arm = tube_arm(7);
  const robot::SkinLayout skin = tube_skin(arm, sensors);
  const workspace::Workspace& world = balls(400);
  Tick work(arm, skin, {});
  std::vector<double> times;
  for (auto _ : state) {
    for (int i = 0; i < 200; ++i) {
      const auto start = std::chrono::steady_clock::now();
      work.run(world);
      times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  }
  std::sort(times.begin(), times.end());
  state.counters["worst_per_median"] = times.back() / times[times.size() / 2];
  state.counters["p99_per_median"] = times[times.size() * 99 / 100] / times[times.size() / 2];
}

void clusters(State& state, robot::ClusterSpec spec) {
  const robot::SerialArm arm = tube_arm(7);
  const robot::SkinLayout skin = cluster_skin(arm, 7 * 100, spec);
  Tick work(arm, skin, {});
  for (auto _ : state) work.run(balls(400));
  count_sensors(state, skin.size());
  state.counters["us_per_sensor"] =
      benchmark::Counter(1e-6 * static_cast<double>(skin.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const bool registered = [] {
  for (const int edge : {400, 512}) {
    for (const std::size_t sensors : {std::size_t{1000}, std::size_t{10'000}, std::size_t{24'000},
                                      std::size_t{100'000}, std::size_t{200'000}}) {
      const std::string size = std::to_string(sensors / 1000) + "k/" + std::to_string(edge);
      RegisterBenchmark(("tick/" + size).c_str(), tick, sensors, edge, 7, robot::SensingOptions{});
      RegisterBenchmark(("look_up/" + size).c_str(), look_up, sensors, edge);
      RegisterBenchmark(("gather/" + size).c_str(), gather, sensors, edge, Through::kDirectory);
      RegisterBenchmark(("gather_tiles/" + size).c_str(), gather, sensors, edge, Through::kTiles);
      RegisterBenchmark(("gather_rows/" + size).c_str(), gather, sensors, edge, Through::kRows);
    }
  }
  RegisterBenchmark("step/100k/400", step_of, 100'000, 400);
  RegisterBenchmark("tick_1_joint/100k/400", tick, 100'000, 400, 1, robot::SensingOptions{});
  RegisterBenchmark("spread/24k", spread, 24'000);
  RegisterBenchmark("tick_free/24k", tick_of, 24'000, Content::kFree, robot::SensingOptions{});
  RegisterBenchmark("tick_mixed/24k", tick_of, 24'000, Content::kMixed, robot::SensingOptions{});
  RegisterBenchmark("tick_mixed_gradient/24k", tick_of, 24'000, Content::kMixed,
                    robot::SensingOptions{.gradient = true});
  for (const std::size_t threads : {std::size_t{1}, std::size_t{2}}) {
    RegisterBenchmark(("tick_threads/1000k/" + std::to_string(threads)).c_str(), tick, 1'000'000, 400, 7,
                      robot::SensingOptions{.threads = threads})
        ->UseRealTime();
  }
  RegisterBenchmark("tick_gradient/24k/400", tick, 24'000, 400, 7, robot::SensingOptions{.gradient = true});
  RegisterBenchmark("tick_memory/24k/400", tick, 24'000, 400, 7,
                    robot::SensingOptions{.memory = {1, 0.9, 0.75, 0.55, 0.3, 0.2, 0.1, 0.05, 0.02}});
  RegisterBenchmark("cluster/cube/m3", clusters, robot::ClusterSpec{3, robot::ClusterShape::kCube});
  RegisterBenchmark("cluster/sphere/m3", clusters, robot::ClusterSpec{3, robot::ClusterShape::kSphere});
  RegisterBenchmark("cluster/fraction/m3", clusters, robot::ClusterSpec{3, robot::ClusterShape::kFraction});
  return true;
}();

}  // namespace
}  // namespace phantom::bench
