// From the exposure of a depth image to the percept, through the real processes workspace_camera, wva_server
// and phantom_sensing: a thing that is put beside the hand is felt, and one that is taken away is not any
// more. The rows of rows/live_path.json.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "tests/bench/repetitions.hpp"
#include "tests/end_to_end/live_rig.hpp"

namespace phantom::bench {
namespace {

constexpr int kImagesBetween = 30;

/// Voxels of 5 mm, and 320 × 240 pixels 30 times a second.
class LivePath : end_to_end::LiveRig {
 public:
  LivePath()
      : LiveRig({.voxel_m = 0.005, .layer_vox = 8, .divisor = 2, .period = std::chrono::milliseconds(33)}) {
    if (!start()) throw std::runtime_error("the processes did not start: " + logs());
  }

  /// Returns how long after the exposure of the first image that shows it the percept follows, in ms.
  double put_ms(bool there) {
    settle();
    camera_->put_box(there);
    const auto follows = [&] {
      const msg::Percept percept = observer_->percept();
      return percept.valid() && messages::is_live(percept.object()) == there && camera_->shown_ns() != 0;
    };
    if (!test::eventually(follows)) throw std::runtime_error("the percept does not follow: " + logs());
    return 1e3 * core::seconds(core::monotonic_ns() - camera_->shown_ns());
  }

 private:
  void settle() {
    const int taken = camera_->taken();
    test::eventually([&] { return camera_->taken() > taken + kImagesBetween; });
  }
};

double quantile(std::vector<double>& values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void live_path(benchmark::State& state) {
  std::vector<double> felt_ms, free_ms;
  for (auto _ : state) {
    LivePath path;
    for (int i = 0; i < repetitions(20); ++i) {
      felt_ms.push_back(path.put_ms(true));
      free_ms.push_back(path.put_ms(false));
    }
  }
  state.counters["felt_ms"] = quantile(felt_ms, 0.5);
  state.counters["felt_p90_ms"] = quantile(felt_ms, 0.9);
  state.counters["free_ms"] = quantile(free_ms, 0.5);
  state.counters["free_p90_ms"] = quantile(free_ms, 0.9);
}

const bool registered = [] {
  benchmark::RegisterBenchmark("live_path", live_path)->Iterations(1);
  return true;
}();

}  // namespace
}  // namespace phantom::bench
