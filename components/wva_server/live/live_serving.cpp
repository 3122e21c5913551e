#include "components/wva_server/live/live_serving.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/core/errors.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/geometry/implicit/primitives.hpp"

namespace phantom::wva_server {
namespace {

constexpr core::Nanoseconds kMarkerPeriod_ns = core::kNsPerSecond / 2;
constexpr std::size_t kMaxKept = 200'000;  // figures of versions: two hours at 30 a second
constexpr int kMarker_vox = 4;

/// What viewers show of live matter besides its voxels: a small cube in its middle. Its mesh is one for all
/// time, since a published mesh stays published.
ServedObject marker_of(const workspace::GridSpec& grid) {
  ServedObject marker{.id = kLiveId, .config = {}, .mesh_O = {}, .report = {}};
  marker.config.id = kLiveId;
  marker.config.name = kLiveName;
  marker.config.colour = {0.9F, 0.25F, 0.05F};
  const double edge_m = kMarker_vox * grid.voxel_size_m.reference_m();
  marker.mesh_O = geometry::make_box({edge_m, edge_m, edge_m});
  marker.mesh_hash = marker.mesh_O.content_hash();
  return marker;
}

LiveMatter matter_or_throw(const workspace::GridSpec& grid, const LiveRules& rules) {
  auto made = LiveMatter::create(grid, rules);
  if (!made) throw core::ConfigError("live: " + made.status().message());
  return std::move(made).value();
}

void degrade(core::Health& health, const std::string& why) {
  if (health.state == core::ComponentState::kRunning) health.state = core::ComponentState::kDegraded;
  health.message = why + (health.message.empty() ? "" : "; ") + health.message;
}

}  // namespace

LiveServing::LiveServing(const LiveRules& rules, LiveCell& cell, DdsAdapter& adapter, int threads)
    : rules_(rules),
      cell_(cell),
      adapter_(adapter),
      threads_(threads),
      matter_(matter_or_throw(cell.workspace().grid(), rules)),
      marker_(marker_of(cell.workspace().grid())),
      begun_ns_(core::monotonic_ns()) {
  adapter_.follow_occupancy(rules.source, cell.cell().name, cell.workspace().grid());
}

void LiveServing::begin(std::uint64_t version) {
  const auto change = cell_.begin_live(matter_.profile(), version);
  if (!change) throw core::ConfigError("live: " + change.status().message());
  begun_ns_ = core::monotonic_ns();
}

bool LiveServing::is_silent(const LiveInput& input, core::Nanoseconds now_ns) const {
  return now_ns - std::max(input.received_ns, begun_ns_) > core::from_seconds(rules_.silence_s);
}

bool LiveServing::is_due(core::Nanoseconds now_ns) {
  const LiveInput input = adapter_.occupancy();
  const bool ends =
      rules_.on_loss == OnLoss::kEnd && !ended_ && input.received_ns != 0 && is_silent(input, now_ns);
  return input.waiting || model_changed_ || ends;
}

bool LiveServing::step(core::Nanoseconds now_ns, std::uint64_t version) {
  const LiveInput input = adapter_.occupancy();
  std::optional<core::Nanoseconds> exposed_ns;
  if (const auto seen = adapter_.take_occupancy()) {
    matter_.take(*seen);
    exposed_ns = seen->exposed_ns;
    ended_ = false;
  } else if (rules_.on_loss == OnLoss::kEnd && !ended_ && input.received_ns != 0 &&
             is_silent(input, now_ns)) {
    // What comes next must be whole: nothing is left that it could change.
    adapter_.restart_occupancy();
    matter_.take({.whole = true, .blocks = {}, .exposed_ns = {}});
    ended_ = true;
    spdlog::warn("live matter has ended: nothing was heard of {} for {:.1f} s", rules_.source,
                 rules_.silence_s);
  }
  if (model_changed_) matter_.set_model(cell_.solid());
  model_changed_ = false;
  LiveMatter::Update update = matter_.update();
  if (update.touched.empty()) return false;
  const auto change = cell_.put_live(std::move(update.bricks), matter_.profile(), std::move(update.touched),
                                     version, threads_);
  if (!change) {
    spdlog::error("live matter could not be merged: {}", change.status().message());
    return false;
  }
  adapter_.publish_change(cell_, *change, threads_);
  const core::Nanoseconds done_ns = core::monotonic_ns();
  ++figures_.versions;
  figures_.voxels = matter_.voxels();
  figures_.most = std::max(figures_.most, figures_.voxels);
  if (figures_.bricks.size() < kMaxKept) {
    figures_.bricks.push_back(static_cast<std::uint32_t>(change->changed.size() + change->removed.size()));
    figures_.update_ms.push_back(static_cast<float>(1e3 * core::seconds(done_ns - now_ns)));
    if (exposed_ns)
      figures_.latency_ms.push_back(static_cast<float>(1e3 * core::seconds(done_ns - *exposed_ns)));
  }
  show_marker(done_ns);
  return true;
}

/// Shows where live matter is, now and then; at once where there is none any more.
void LiveServing::show_marker(core::Nanoseconds now_ns) {
  const auto middle_m = matter_.middle_m();
  if (!middle_m) {
    if (marker_shown_) adapter_.withdraw_object(kLiveId);
    marker_shown_ = false;
    return;
  }
  if (marker_shown_ && now_ns < next_marker_ns_) return;
  marker_.config.X_WO.translation_m = *middle_m;
  adapter_.publish_object(marker_, 256 * 1024);
  marker_shown_ = true;
  next_marker_ns_ = now_ns + kMarkerPeriod_ns;
}

core::Health LiveServing::told(core::Health health, core::Nanoseconds now_ns) const {
  const LiveInput input = adapter_.occupancy();
  const bool silent = is_silent(input, now_ns);
  for (const messages::DepthCameraHealth& camera : input.cameras) {
    if (silent || camera.state == messages::DepthCameraState::kLive) continue;
    degrade(health, fmt::format("live matter: camera '{}' is {}", camera.name, name_of(camera.state)));
  }
  if (input.received_ns == 0 && silent) {
    degrade(health, fmt::format("live matter: {} has not been heard yet", rules_.source));
  } else if (silent) {
    degrade(health, fmt::format("live matter: nothing is heard of {} for {:.1f} s; what it saw {}",
                                rules_.source, core::seconds(now_ns - input.received_ns),
                                rules_.on_loss == OnLoss::kEnd ? "has ended" : "is kept as it was"));
  }
  if (input.has_rival) health = dds::with_rival(std::move(health), "occupancy_change");
  const auto figure = [&](const char* name, auto value, const char* unit) {
    health.figures.push_back({name, static_cast<double>(value), unit});
  };
  figure("live_voxels", figures_.voxels, "");
  figure("live_versions", figures_.versions, "");
  if (input.received_ns != 0) figure("live_silence", core::seconds(now_ns - input.received_ns), "s");
  if (!figures_.latency_ms.empty()) figure("live_latency", figures_.latency_ms.back(), "ms");
  return health;
}

}  // namespace phantom::wva_server
