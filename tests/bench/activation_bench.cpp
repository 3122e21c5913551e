// Mesh → solid → layers → workspace: the rows of rows/activation.json.

#include <benchmark/benchmark.h>
#include <malloc.h>
#include <sys/mman.h>

#include <cstring>
#include <new>

#include "common/geometry/mesh/stl.hpp"
#include "common/workspace/large_pages.hpp"
#include "tests/bench/bodies.hpp"
#include "tests/bench/counting_heap.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

using benchmark::RegisterBenchmark;
using benchmark::State;
using layers::Body;
using workspace::GridSpec;

constexpr std::uint32_t kRings200k = 317, kRings2M = 1001;
const GridSpec kCellGrid{Eigen::Vector3d::Zero(), 0.005, {400, 400, 300}};

Eigen::Vector3d extent_m(const GridSpec& grid) { return grid.extent_m(); }

/// The floor: memory that is there already, plain pages from the system, written once.
void warm_memset(State& state, std::size_t bytes) {
  void* const block = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (block == MAP_FAILED) throw std::bad_alloc();
  std::memset(block, 1, bytes);
  char value = 0;
  for (auto _ : state) {
    std::memset(block, ++value, bytes);
    benchmark::DoNotOptimize(block);
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));  // limits go by it
  ::munmap(block, bytes);
}

layers::ActivatedObject activated(const Body& body, const GridSpec& grid, int threads = 1) {
  layers::ActivationOptions options;
  options.threads = threads;
  auto object = layers::activate_object(body, grid, options);
  if (!object) throw std::runtime_error(object.status().message());
  return std::move(object).value();
}

void activate_sphere(State& state, int edge_vox, std::uint32_t rings, int threads,
                     workspace::LayerMethod method = workspace::LayerMethod::kDistance) {
  Body body = sphere_in_box(edge_vox, rings);
  body.profile.method = method;
  body.profile.element = workspace::ShapingElement::kSphere;
  const GridSpec grid = sphere_grid(edge_vox);
  for (auto _ : state) {
    const auto object = activated(body, grid, threads);
    benchmark::DoNotOptimize(object.bricks.keys().data());
  }
}

/// From the bytes of an STL file.
void activate_stl(State& state, int edge_vox, std::uint32_t rings, int threads) {
  Body body = sphere_in_box(edge_vox, rings);
  const std::vector<std::uint8_t> stl = geometry::binary_stl(body.mesh_W);
  const GridSpec grid = sphere_grid(edge_vox);
  for (auto _ : state) {
    body.mesh_W = geometry::read_binary_stl(stl);
    const auto object = activated(body, grid, threads);
    benchmark::DoNotOptimize(object.bricks.keys().data());
  }
}

void layers_of_sphere(State& state, int edge_vox, std::uint32_t rings, int threads) {
  const Body body = sphere_in_box(edge_vox, rings);
  const GridSpec grid = sphere_grid(edge_vox);
  const auto solid = voxelise::voxelise(body.mesh_W, grid, layers::voxelise_clip(grid, body.profile));
  for (auto _ : state) {
    const auto bricks =
        layers::distance_bricks(*solid, body.profile, workspace::VoxelBox::of(grid), {threads, {}});
    benchmark::DoNotOptimize(bricks.keys().data());
  }
}

void whole_cell(State& state, int threads) {
  const std::vector<Body> bodies = cell_of(20, extent_m(kCellGrid));
  for (auto _ : state) {
    const Activated cell = activate_all(bodies, kCellGrid, threads);
    benchmark::DoNotOptimize(cell.workspace.codes());
  }
}

/// An object of middling size of the cell.
constexpr std::size_t kMoved = 5;

void activate_one_of_the_cell(State& state) {
  const std::vector<Body> bodies = cell_of(20, extent_m(kCellGrid));
  for (auto _ : state) {
    const auto object = activated(bodies[kMoved], kCellGrid);
    benchmark::DoNotOptimize(object.bricks.keys().data());
  }
}

void move_one_of_the_cell(State& state) {
  std::vector<Body> bodies = cell_of(20, extent_m(kCellGrid));
  Activated cell = activate_all(bodies, kCellGrid, 1);
  const std::vector<layers::MergeEntry> entries = cell.entries(bodies);
  double step_m = 0.05;
  for (auto _ : state) {
    for (auto& vertex : bodies[kMoved].mesh_W.vertices_m) vertex.x() += static_cast<float>(step_m);
    step_m = -step_m;
    const layers::MergeEntry before{&cell.bricks[kMoved], bodies[kMoved].id, &cell.codes[kMoved]};
    std::vector<workspace::BrickKey> keys = before.bricks->keys();
    workspace::ObjectBricks moved = activated(bodies[kMoved], kCellGrid).bricks;
    const layers::MergeEntry after{&moved, before.id, before.codes};
    keys = layers::keys_of(std::array{before, after});
    cell.bricks[kMoved] = std::move(moved);
    layers::merge_bricks(layers::MergeLaw::kHighestViscosity, entries, keys, cell.workspace);
    benchmark::DoNotOptimize(cell.workspace.codes());
  }
}

void memory_of_sphere(State& state) {
  const Body body = sphere_in_box(512, kRings200k);
  for (auto _ : state) {
    reset_peak();
    const std::size_t before = heap_bytes();
    const auto object = activated(body, sphere_grid(512));
    state.counters["peak_bytes_per_voxel"] =
        static_cast<double>(peak_heap_bytes() - before) / (512.0 * 512.0 * 512.0);
  }
}

void memory_of_cell(State& state) {
  const std::vector<Body> bodies = cell_of(20, extent_m(kCellGrid));
  for (auto _ : state) {
    const std::size_t before = heap_bytes();
    Activated cell = activate_all(bodies, kCellGrid, 1);
    cell.bricks.clear();
    const double stored = static_cast<double>(cell.workspace.brick_count()) * workspace::kBrickVoxels * 4;
    state.counters["kept_per_stored"] = static_cast<double>(heap_bytes() - before) / stored;
  }
}

/// A cell of 5 m × 4 m × 4 m whose objects make up 5 % of its bricks at 1 mm, with layers of 4 mm.
/// In memory that the process has already: clearing gigabytes anew is the system's work, and on a virtual
/// machine, whose host may have to find them first, most of the time.
void huge_cell(State& state, double voxel_size_m) {
  ::mallopt(M_TRIM_THRESHOLD, -1);
  const Eigen::Vector3d size_m(5, 4, 4);
  const GridSpec grid = layers::grid_over(Eigen::Vector3d::Zero(), size_m, voxel_size_m);
  const std::vector<Body> bodies = large_cell();
  for (auto _ : state) {
    reset_peak();
    const std::size_t before = heap_bytes();
    const Activated cell = activate_all(bodies, grid, 2);
    const auto& bricks = cell.workspace.size_bricks();
    const double active = static_cast<double>(cell.workspace.brick_count());
    state.counters["peak_GiB"] = static_cast<double>(peak_heap_bytes() - before) / 1073741824.0;
    state.counters["share_of_bricks"] = active / bricks[0] / bricks[1] / bricks[2];
    state.counters["s_per_voxel"] = benchmark::Counter(
        active * workspace::kBrickVoxels, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  }
}

const bool kRegistered = [] {
  workspace::keep_freed_memory(256 << 20);  // as wva_server does
  const auto fast = benchmark::kMillisecond;
  RegisterBenchmark("memset/512", warm_memset, std::size_t{512} * 512 * 512)->Unit(fast);
  RegisterBenchmark("memset/400x400x300", warm_memset, std::size_t{400} * 400 * 300)->Unit(fast);
  for (const int threads : {1, 2}) {
    const std::string suffix = "/threads:" + std::to_string(threads);
    RegisterBenchmark(("activate/512/200k" + suffix).c_str(), activate_sphere, 512, kRings200k, threads,
                      workspace::LayerMethod::kDistance)
        ->Unit(fast);
    RegisterBenchmark(("stl/512/200k" + suffix).c_str(), activate_stl, 512, kRings200k, threads)->Unit(fast);
    RegisterBenchmark(("layers/512/200k" + suffix).c_str(), layers_of_sphere, 512, kRings200k, threads)
        ->Unit(fast);
    RegisterBenchmark(("cell/20/400x400x300" + suffix).c_str(), whole_cell, threads)->Unit(fast);
  }
  RegisterBenchmark("activate/512/2M/threads:1", activate_sphere, 512, kRings2M, 1,
                    workspace::LayerMethod::kDistance)
      ->Unit(fast);
  RegisterBenchmark("activate/256/200k/threads:1", activate_sphere, 256, kRings200k, 1,
                    workspace::LayerMethod::kDistance)
      ->Unit(fast);
  RegisterBenchmark("dilation/512/200k", activate_sphere, 512, kRings200k, 1,
                    workspace::LayerMethod::kDilation)
      ->Iterations(1)
      ->Repetitions(repetitions(4))
      ->Unit(fast);
  RegisterBenchmark("activate/1_of_20", activate_one_of_the_cell)->Unit(fast);
  RegisterBenchmark("move/1_of_20", move_one_of_the_cell)->Unit(fast);
  RegisterBenchmark("memory/512/200k", memory_of_sphere)
      ->Iterations(1)
      ->Repetitions(repetitions(2))
      ->Unit(fast);
  RegisterBenchmark("memory/cell/20", memory_of_cell)->Iterations(1)->Repetitions(repetitions(2))->Unit(fast);
  RegisterBenchmark("huge/1mm", huge_cell, 0.001)
      ->Iterations(1)
      ->Repetitions(repetitions(3))
      ->Unit(benchmark::kSecond);
  RegisterBenchmark("huge/2mm", huge_cell, 0.002)
      ->Iterations(1)
      ->Repetitions(repetitions(3))
      ->Unit(benchmark::kSecond);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
