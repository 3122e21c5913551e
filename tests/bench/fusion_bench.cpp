// Depth images to occupancy and layers, in the cell of the targets: 640 × 480 pixels, 5 mm, 2 × 2 × 1.5 m.
// The rows of rows/fusion.json.

#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <set>
#include <vector>

#include "common/fusion/fusion.hpp"
#include "common/fusion/incremental_layers.hpp"
#include "common/fusion/tests/scenes.hpp"
#include "common/layers/merge.hpp"
#include "tests/bench/fusion_places.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

using fusion::Fusion;
using workspace::Index3;

constexpr std::size_t kRecorded = 24, kSettling = 96;
const workspace::LayerProfile kBand{
    {4, 4, 4, 4, 4, 4}, {60.0F, 50.0F, 40.0F, 30.0F, 20.0F, 10.0F}, 100.0F};  // 24 voxels

double processor_time_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::vector<fusion::DepthImage> recorded(const std::vector<fusion::CameraScene::Object>& objects,
                                         std::size_t count, const fusion::DepthNoise& noise = {}) {
  fusion::scenes::Simulated camera(objects, fusion::scenes::depth_camera(), fusion::scenes::cell_camera(),
                                   noise);
  std::vector<fusion::DepthImage> images;
  for (std::size_t i = 0; i < count; ++i) images.push_back(camera.frame(i));
  return images;
}

/// The cell without reflections of steel: the errors that the target states.
const std::vector<fusion::DepthImage>& still_cell() {
  static const std::vector<fusion::DepthImage> kImages = [] {
    fusion::DepthNoise noise;
    noise.steel_mirrored = 0.0;
    return recorded(fusion::scenes::cell_objects(), kRecorded, noise);
  }();
  return kImages;
}

/// A hand of 10 cm that passes over the table in steps of 2 cm.
const std::vector<fusion::DepthImage>& moving_hand() {
  static const std::vector<fusion::DepthImage> kImages = [] {
    std::vector<fusion::DepthImage> images;
    for (int i = 0; i < 24; ++i) {
      auto objects = fusion::scenes::cell_objects();
      const double along = i < 12 ? i : 23 - i;
      objects.push_back(
          fusion::scenes::placed(geometry::make_box({0.1, 0.08, 0.06}), {-0.1 + 0.02 * along, -0.05, 0.8}));
      images.push_back(recorded(objects, 1).front());
    }
    return images;
  }();
  return kImages;
}

Fusion cell_fusion() {
  fusion::FusionParameters parameters;
  parameters.grid = fusion::scenes::cell_grid();
  return Fusion::create(parameters).value();
}

std::size_t changed_bricks(const Fusion& fusion) {
  std::set<Index3> bricks;
  for (const Index3 block : fusion.changed_blocks())
    bricks.insert(workspace::brick_of(fusion::kBlockEdge * block));
  return bricks.size();
}

/// The layers of what a camera sees, published: merged into a workspace of their own.
class PublishedLayers {
 public:
  explicit PublishedLayers(const workspace::GridSpec& grid)
      : layers_(fusion::IncrementalLayers::create(grid, kBand).value()),
        workspace_(grid, workspace::make_palette({kBand}).value()),
        codes_(workspace::code_table(kBand, workspace_.palette())) {}

  void update(const Fusion& fusion) {
    const fusion::LayersChange& change = layers_.update(fusion.occupied(), fusion.changed_blocks());
    std::vector<workspace::BrickKey> keys = change.changed;
    keys.insert(keys.end(), change.removed.begin(), change.removed.end());
    if (keys.empty()) return;
    const workspace::ObjectBricks bricks = layers_.bricks();
    const layers::MergeEntry entry{&bricks, 1, &codes_};
    layers::merge_bricks(layers::MergeLaw::kHighestViscosity, {&entry, 1}, keys, workspace_);
  }

  float mu(const Eigen::Vector3d& place_m) const {
    return workspace_.mu(workspace_.grid().index_of(place_m));
  }

 private:
  fusion::IncrementalLayers layers_;
  workspace::Workspace workspace_;
  workspace::CodeTable codes_;
};

/// Median and 99th percentile of the processor time of a frame, and how many bricks changed in it.
class FrameTimes {
 public:
  void add(double ms, std::size_t bricks) {
    ms_.push_back(ms);
    bricks_.push_back(bricks);
  }
  void report(benchmark::State& state) {
    std::sort(ms_.begin(), ms_.end());
    double sum = 0.0;
    for (const std::size_t bricks : bricks_) sum += static_cast<double>(bricks);
    state.counters["median_ms"] = ms_[ms_.size() / 2];
    state.counters["p99_ms"] = ms_[ms_.size() * 99 / 100];
    state.counters["bricks"] = sum / static_cast<double>(bricks_.size());
    state.counters["most_bricks"] = static_cast<double>(*std::max_element(bricks_.begin(), bricks_.end()));
  }

 private:
  std::vector<double> ms_;
  std::vector<std::size_t> bricks_;
};

/// Frames of a settled scene. `with_layers`: to published layers, otherwise to occupancy.
void frames(benchmark::State& state, const std::vector<fusion::DepthImage>& images, bool with_layers) {
  Fusion fusion = cell_fusion();
  PublishedLayers published(fusion.grid());
  const std::vector<fusion::DepthImage>& still = still_cell();
  for (std::size_t i = 0; i < kSettling; ++i) fusion.integrate(still[i % still.size()]);
  if (with_layers) published.update(fusion);
  // A round of images, so that the memory that changes take is there as in a system that runs.
  for (std::size_t i = 0; with_layers && i < images.size(); ++i) {
    fusion.clear_changes();
    fusion.integrate(images[i]);
    published.update(fusion);
  }
  FrameTimes times;
  for (auto _ : state) {
    for (std::size_t i = 0; i < 100; ++i) {
      fusion.clear_changes();
      const double from_ms = processor_time_ms();
      benchmark::DoNotOptimize(fusion.integrate(images[i % images.size()]));
      if (with_layers) published.update(fusion);
      times.add(processor_time_ms() - from_ms, changed_bricks(fusion));
    }
  }
  times.report(state);
  state.counters["MB"] = 1e-6 * static_cast<double>(fusion.bytes());
}

/// All that is published of the cell, at once, where its space was unknown and free: once to have the memory,
/// as a system that runs has it, and once more.
void everything(benchmark::State& state) {
  double most_ms = 0.0;
  for (auto _ : state) {
    fusion::FusionParameters parameters;
    parameters.grid = fusion::scenes::cell_grid();
    parameters.unknown = fusion::UnknownPolicy::kFree;
    Fusion fusion = Fusion::create(parameters).value();
    PublishedLayers published(fusion.grid());
    for (int turn = 0; turn < 2; ++turn) {
      fusion.forget(workspace::VoxelBox::of(fusion.grid()));
      published.update(fusion);
      fusion.integrate(still_cell()[0]);
      fusion.clear_changes();
      const double from_ms = processor_time_ms();
      fusion.integrate(still_cell()[1]);
      published.update(fusion);
      if (turn > 0) most_ms = std::max(most_ms, processor_time_ms() - from_ms);
    }
  }
  state.counters["most_ms"] = most_ms;
}

/// One frame as OctoMap's peer sees it.
void one_frame(benchmark::State& state) {
  Fusion fusion = cell_fusion();
  const std::vector<fusion::DepthImage>& images = still_cell();
  for (std::size_t i = 0; i < kSettling; ++i) fusion.integrate(images[i % images.size()]);
  std::size_t next = 0;
  for (auto _ : state) {
    fusion.clear_changes();
    benchmark::DoNotOptimize(fusion.integrate(images[next++ % images.size()]));
  }
}

/// One frame while a hand passes, to published layers, and what 10⁵ places have of them.
void frame_and_look_ups(benchmark::State& state) {
  Fusion fusion = cell_fusion();
  PublishedLayers published(fusion.grid());
  for (std::size_t i = 0; i < kSettling; ++i) fusion.integrate(still_cell()[i % still_cell().size()]);
  published.update(fusion);
  const std::vector<Eigen::Vector3d> places_m = looked_up_places();
  const std::vector<fusion::DepthImage>& images = moving_hand();
  std::size_t next = 0;
  for (auto _ : state) {
    fusion.clear_changes();
    benchmark::DoNotOptimize(fusion.integrate(images[next++ % images.size()]));
    published.update(fusion);
    float sum = 0.0F;
    for (const Eigen::Vector3d& place_m : places_m) sum += published.mu(place_m);
    benchmark::DoNotOptimize(sum);
  }
}

const bool kFusionRegistered = [] {
  const auto once = [](auto* made) { made->Iterations(1)->Repetitions(repetitions(3)); };
  once(benchmark::RegisterBenchmark("fuse/640x480/5mm",
                                    [](auto& state) { frames(state, still_cell(), false); }));
  once(benchmark::RegisterBenchmark("layers/still", [](auto& state) { frames(state, still_cell(), true); }));
  once(benchmark::RegisterBenchmark("layers/hand", [](auto& state) { frames(state, moving_hand(), true); }));
  once(benchmark::RegisterBenchmark("layers/everything", everything));
  benchmark::RegisterBenchmark("frame/640x480/5mm", one_frame)->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("frame/100k", frame_and_look_ups)->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
