// What wva_server computes for a change that depth cameras see, in the shipped hot cell: from the blocks of
// an occupancy_change to a version whose bricks are packed. The row of rows/fusion.json.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <stdexcept>

#include "common/runtime/cell/cell_names.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/wva_server/wva_server.hpp"
#include "tests/bench/repetitions.hpp"

namespace phantom::bench {
namespace {

using workspace::Index3;

double living_time_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

wva_server::LiveCell hot_cell() {
  const auto cell = runtime::load_checked_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml",
                                               runtime::CellArms::kOptional);
  wva_server::LiveCell live(cell, {});
  const auto change = live.activate(runtime::load_bodies(cell, {}), 1, {}, [](const auto&...) {});
  if (!change) throw std::runtime_error(change.status().message());
  return live;
}

/// The surface of a hand of 10 × 8 × 6 cm, in blocks; `step`: 2 cm along x each.
std::vector<messages::OccupancyBlock> hand(int step) {
  std::map<std::array<std::uint16_t, 3>, messages::OccupancyBlock> blocks;
  const std::int32_t first = 150 + 4 * (step % 20);
  const auto box = workspace::VoxelBox::between({first, 130, 150}, {first + 20, 146, 162});
  box.for_each([&](Index3 v) {
    if (box.grown(-1).contains(v)) return;
    const std::array place{static_cast<std::uint16_t>(v.x >> 3), static_cast<std::uint16_t>(v.y >> 3),
                           static_cast<std::uint16_t>(v.z >> 3)};
    auto& block =
        blocks.try_emplace(place, messages::OccupancyBlock{place[0], place[1], place[2], {}}).first->second;
    block.bits[static_cast<std::size_t>(v.z & 7)] |= std::uint64_t{1} << (8 * (v.y & 7) + (v.x & 7));
  });
  std::vector<messages::OccupancyBlock> all;
  for (const auto& [place, block] : blocks) all.push_back(block);
  return all;
}

void passing_hand(benchmark::State& state) {
  wva_server::LiveCell cell = hot_cell();
  wva_server::LiveRules rules;
  rules.source = "workspace_camera";
  rules.profile = cell.cell().profile;
  auto matter = wva_server::LiveMatter::create(cell.workspace().grid(), rules).value();
  std::uint64_t version = 2;
  if (!cell.begin_live(rules.profile, version)) throw std::runtime_error("no room for live matter");
  matter.set_model(cell.solid());
  std::vector<double> ms;
  std::size_t bricks = 0;
  for (auto _ : state) {
    for (int step = 0; step < 100; ++step) {
      const wva_server::LiveIntake::Taken seen{true, hand(step), {}};
      const double from_ms = living_time_ms();
      matter.take(seen);
      const auto change = cell.put_live(matter.update(step * core::kNsPerSecond / 30), ++version, 1);
      if (!change) throw std::runtime_error(change.status().message());
      for (const workspace::BrickKey key : change->changed)
        benchmark::DoNotOptimize(workspace::encode_brick(cell.workspace().brick(key)));
      ms.push_back(living_time_ms() - from_ms);
      bricks = std::max(bricks, change->changed.size() + change->removed.size());
    }
  }
  std::sort(ms.begin(), ms.end());
  state.counters["median_ms"] = ms[ms.size() / 2];
  state.counters["p99_ms"] = ms[ms.size() * 99 / 100];
  state.counters["most_bricks"] = static_cast<double>(bricks);
}

const bool kLivingRegistered = [] {
  benchmark::RegisterBenchmark("living/hand", passing_hand)->Iterations(1)->Repetitions(repetitions(3));
  return true;
}();

}  // namespace
}  // namespace phantom::bench
