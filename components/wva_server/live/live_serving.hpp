#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "components/wva_server/dds_adapter.hpp"
#include "components/wva_server/live/live_matter.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {

/// What the serving of live matter has done.
struct LiveFigures {
  std::size_t versions = 0;                              ///< published for live matter
  std::size_t voxels = 0, most = 0;                      ///< of it, now and at most
  std::uint32_t changed_bricks = 0, removed_bricks = 0;  ///< of the newest version
  std::vector<float> latency_ms;      ///< from the exposure of an image to the version that it changed
  std::vector<std::uint32_t> bricks;  ///< that each version changed or removed
  std::vector<float> update_ms;       ///< what each version took here
};

/// Returns the figures as the report has them.
nlohmann::json report_of(const LiveFigures& live);
/// Returns the rules of live matter, with the cell's profile unless they have their own.
LiveRules live_rules(const LiveRules& configured, const runtime::CellConfig& cell);

/// Serves live matter: merges what depth cameras see into the workspace, one version for all that came since
/// the last. The thread that serves the cell calls it while no command is being carried out.
class LiveServing {
 public:
  /// Begins to hear the source. Throws core::ConfigError, dds::DdsError.
  LiveServing(const LiveRules& rules, LiveCell& cell, DdsAdapter& adapter, int threads);

  /// Makes room for live matter in the workspace, as a version of its own, which need not be published.
  /// Throws core::ConfigError.
  void begin(std::uint64_t version);
  /// The model's objects have changed.
  void model_changed() { model_changed_ = true; }
  /// Returns whether there is something to do.
  bool is_due(core::Nanoseconds now_ns);
  /// Does it, and publishes. Returns whether there is a new version.
  bool step(core::Nanoseconds now_ns, std::uint64_t version);

  /// Returns the id of live matter that a command is about; nothing: it is about an object of the model. 0:
  /// about live matter that is not there.
  std::optional<std::uint16_t> subject(const WorkspaceCommand& command) const;
  /// Carries out what a person decides about live matter. Returns it in words, or why it is refused and what
  /// is allowed. The next step() publishes it.
  core::Expected<std::string> decide(const WorkspaceCommand& command, std::uint16_t id,
                                     core::Nanoseconds now_ns);

  /// Returns `health` with what is to be said of live matter: degraded while its source, or a camera, is
  /// late or lost, or a second source is there.
  core::Health told(core::Health health, core::Nanoseconds now_ns) const;
  const LiveFigures& figures() const { return figures_; }

 private:
  bool is_silent(const LiveInput& input, core::Nanoseconds now_ns) const;
  void give_way_in_names();
  void show_markers(core::Nanoseconds now_ns);
  void tell(std::uint16_t id);
  void show_marker(std::uint16_t id, core::Nanoseconds now_ns);

  const LiveRules rules_;
  LiveCell& cell_;
  DdsAdapter& adapter_;
  const int threads_;
  LiveMatter matter_;
  struct Marker {
    bool shown = false;
    std::string name;
    core::Nanoseconds next_ns = 0;
    messages::LiveObject told{.standing = messages::LiveStanding::kLost};
  };
  ServedObject marker_;
  std::map<std::uint16_t, Marker> markers_;  // by the ids of live matter
  bool model_changed_ = true, ended_ = false, decided_ = false;
  core::Nanoseconds begun_ns_, next_look_ns_ = 0;
  LiveFigures figures_;
};

}  // namespace phantom::wva_server
