#include "components/wva_server/live/live_serving.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/runtime/process/spread_json.hpp"

namespace phantom::wva_server {
namespace {

constexpr core::Nanoseconds kMarkerPeriod_ns = core::kNsPerSecond / 2;
/// How often is looked whether something is to be forgotten.
constexpr core::Nanoseconds kLookPeriod_ns = core::kNsPerSecond / 2;
constexpr std::size_t kMaxKept = 200'000;  // figures of versions: two hours at 30 a second
constexpr int kMarker_vox = 4;

/// What viewers show of an object of live matter besides its voxels: a small cube in its middle. Its mesh is
/// one for all, and for all time, since a published mesh stays published.
ServedObject marker_of(const workspace::GridSpec& grid) {
  ServedObject marker{.id = kLiveId, .config = {}, .mesh_O = {}, .report = {}};
  marker.config.colour = {0.9F, 0.25F, 0.05F};
  const double edge_m = kMarker_vox * grid.voxel_size_m.reference_m();
  marker.mesh_O = geometry::make_box({edge_m, edge_m, edge_m});
  marker.mesh_hash = marker.mesh_O.content_hash();
  return marker;
}

bool is_decision(WorkspaceOperation operation) {
  using enum WorkspaceOperation;
  return operation == kName || operation == kFreeze || operation == kDiscard || operation == kRestore;
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

LiveRules live_rules(const LiveRules& configured, const runtime::CellConfig& cell) {
  LiveRules rules = configured;
  if (!rules.profile.thickness_vox.empty()) return rules;
  rules.profile = cell.profile;
  rules.profile.method = workspace::LayerMethod::kDistance;
  rules.profile.inside_thickness_vox.clear();
  rules.profile.mu_inside_Pa_s_per_m.clear();
  rules.profile.stiffness_inside_Pa_per_m.clear();
  return rules;
}

nlohmann::json report_of(const LiveFigures& live) {
  return {{"versions", live.versions},
          {"voxels", live.voxels},
          {"most_voxels", live.most},
          {"image_to_version_ms", runtime::spread_json(live.latency_ms)},
          {"update_ms", runtime::spread_json(live.update_ms)},
          {"bricks_changed", runtime::spread_json(live.bricks)}};
}

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
  // A predecessor that was killed may have told of things, and of what was decided about them: that ended
  // with it.
  for (std::uint16_t id = messages::kFirstLiveObjectId; id < kLiveId; ++id)
    adapter_.publish_live({id, messages::LiveStanding::kLost, messages::live_name(id)});
}

bool LiveServing::is_silent(const LiveInput& input, core::Nanoseconds now_ns) const {
  return now_ns - std::max(input.received_ns, begun_ns_) > core::from_seconds(rules_.silence_s);
}

bool LiveServing::is_due(core::Nanoseconds now_ns) {
  const LiveInput input = adapter_.occupancy();
  const bool ends =
      rules_.on_loss == OnLoss::kEnd && !ended_ && input.received_ns != 0 && is_silent(input, now_ns);
  const bool looks = matter_.expires() && now_ns >= next_look_ns_;
  return input.waiting || model_changed_ || decided_ || ends || looks;
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
  if (model_changed_) {
    matter_.set_model(cell_.solid());
    give_way_in_names();
  }
  model_changed_ = decided_ = false;
  next_look_ns_ = now_ns + kLookPeriod_ns;
  std::vector<layers::ComputedObject> changed = matter_.update(now_ns);
  show_markers(now_ns);
  if (changed.empty()) return false;
  const auto change = cell_.put_live(std::move(changed), version, threads_);
  if (!change) {
    spdlog::error("live matter could not be merged: {}", change.status().message());
    return false;
  }
  adapter_.publish_change(cell_, *change, threads_);
  const core::Nanoseconds done_ns = core::monotonic_ns();
  ++figures_.versions;
  figures_.changed_bricks = static_cast<std::uint32_t>(change->changed.size());
  figures_.removed_bricks = static_cast<std::uint32_t>(change->removed.size());
  figures_.voxels = matter_.voxels();
  figures_.most = std::max(figures_.most, figures_.voxels);
  if (figures_.bricks.size() < kMaxKept) {
    figures_.bricks.push_back(figures_.changed_bricks + figures_.removed_bricks);
    figures_.update_ms.push_back(static_cast<float>(1e3 * core::seconds(done_ns - now_ns)));
    if (exposed_ns)
      figures_.latency_ms.push_back(static_cast<float>(1e3 * core::seconds(done_ns - *exposed_ns)));
  }
  return true;
}

/// An object of the model that was added has its name, whatever a person had called a thing that cameras see.
void LiveServing::give_way_in_names() {
  std::vector<std::uint16_t> taken;
  for (const auto& [id, object] : matter_.objects().all())
    if (cell_.has(object.name)) taken.push_back(id);
  for (const std::uint16_t id : taken) matter_.drop_name(id);
}

void LiveServing::show_markers(core::Nanoseconds now_ns) {
  for (std::uint16_t id = messages::kFirstLiveObjectId; id <= kLiveId; ++id) {
    if (id != kLiveId) tell(id);
    show_marker(id, now_ns);
  }
}

/// Tells what became of a thing, if that is not known.
void LiveServing::tell(std::uint16_t id) {
  const auto found = matter_.objects().all().find(id);
  messages::LiveObject& told = markers_[id].told;
  const bool is_known = found != matter_.objects().all().end();
  const auto standing = is_known ? found->second.standing : messages::LiveStanding::kLost;
  const std::string name = is_known ? found->second.name : messages::live_name(id);
  if (standing == told.standing && (name == told.name || standing == messages::LiveStanding::kLost)) return;
  told = {id, standing, name};
  adapter_.publish_live(told);
}

/// Shows where an object of live matter is, now and then; at once where it is called otherwise, or is not
/// there any more.
void LiveServing::show_marker(std::uint16_t id, core::Nanoseconds now_ns) {
  const auto middle_m = matter_.middle_m(id);
  Marker& marker = markers_[id];
  if (!middle_m) {
    if (marker.shown) adapter_.withdraw_object(id);
    marker.shown = false;
    return;
  }
  const auto object = matter_.objects().all().find(id);
  const std::string name =
      object == matter_.objects().all().end() ? messages::live_name(id) : object->second.name;
  if (marker.shown && marker.name == name && now_ns < marker.next_ns) return;
  marker_.id = marker_.config.id = id;
  marker_.config.name = name;
  marker_.config.X_WO.translation_m = *middle_m;
  adapter_.publish_object(marker_, 256 * 1024);
  marker.shown = true;
  marker.name = name;
  marker.next_ns = now_ns + kMarkerPeriod_ns;
}

std::optional<std::uint16_t> LiveServing::subject(const WorkspaceCommand& command) const {
  if (command.operation == WorkspaceOperation::kAdd) return std::nullopt;
  if (command.object.empty()) return messages::is_live(command.id) ? std::optional(command.id) : std::nullopt;
  if (const std::uint16_t id = matter_.objects().find(command.object); id != 0) return id;
  if (command.object == kLiveName) return kLiveId;
  // Only what cameras see can be decided about.
  if (is_decision(command.operation) && !cell_.has(command.object)) return std::uint16_t{0};
  return messages::is_live_name(command.object) ? std::optional<std::uint16_t>(0) : std::nullopt;
}

core::Expected<std::string> LiveServing::decide(const WorkspaceCommand& command, std::uint16_t id,
                                                core::Nanoseconds now_ns) {
  const auto& all = matter_.objects().all();
  if (id == 0) {
    const std::string seen = core::listed(all, [](const auto& entry) { return entry.second.name; });
    return core::Status::not_found(fmt::format("cameras see no '{}'; they see {}", command.object,
                                               seen.empty() ? "nothing now" : "these: " + seen));
  }
  const auto found = all.find(id);
  const std::string before = "'" + (found != all.end() ? found->second.name : messages::live_name(id)) + "'";
  const auto answer = [&](const core::Status& done, const std::string& words) -> core::Expected<std::string> {
    if (!done) return done;
    decided_ = true;
    return before + words;
  };
  switch (command.operation) {
    case WorkspaceOperation::kName:
      if (cell_.has(command.description))
        return core::Status::invalid_argument("an object of the model is called '" + command.description +
                                              "'; give it another name");
      return answer(matter_.rename(id, command.description), " is called '" + command.description + "' now");
    case WorkspaceOperation::kFreeze:
      return answer(matter_.freeze(id),
                    " stays as it is, whatever cameras see there, until it is restored or wva_server ends");
    case WorkspaceOperation::kDiscard:
      return answer(
          matter_.discard(id, now_ns),
          fmt::format(" is not felt any more, until it is restored or cameras see nothing there for "
                      "{:.0f} s",
                      LiveObjects::kForgotten_s));
    case WorkspaceOperation::kRestore:
      return answer(matter_.restore(id, now_ns), " is what cameras see of it again");
    default:
      return core::Status::invalid_argument(
          before + " is what depth cameras see; allowed: name, freeze, discard, restore");
  }
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
  for (const auto& [id, object] : matter_.objects().all())
    if (object.is_fixed())
      health.message += fmt::format(
          "; live matter: '{}' is {}", object.name,
          object.standing == LiveStanding::kFrozen ? "frozen: kept as it was" : "discarded: not felt");
  const auto figure = [&](const char* name, auto value, const char* unit) {
    health.figures.push_back({name, static_cast<double>(value), unit});
  };
  figure("live_voxels", figures_.voxels, "");
  figure("live_objects",
         std::ranges::count_if(matter_.objects().all(),
                               [](const auto& entry) { return entry.second.is_there(); }),
         "");
  figure("live_versions", figures_.versions, "");
  if (input.received_ns != 0) figure("live_silence", core::seconds(now_ns - input.received_ns), "s");
  if (!figures_.latency_ms.empty()) figure("live_latency", figures_.latency_ms.back(), "ms");
  return health;
}

}  // namespace phantom::wva_server
