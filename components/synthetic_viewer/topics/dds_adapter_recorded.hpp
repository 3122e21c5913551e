#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/recording/mcap_records.hpp"
#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_intake.hpp"

namespace phantom::synthetic_viewer {

/// What a viewer knows at one moment of a recording, and what decides which of the samples after it are
/// heeded. A plain value: a copy goes on by itself.
struct RecordedMoment {
  explicit RecordedMoment(messages::ArmBounds arm, const std::vector<OtherArmSource>& other_arms = {});

  SampleFilter intake;
  StopStatus stops;
  struct Other {
    SampleFilter intake;
    StopStatus stops;  ///< of that arm's session: not shown
  };
  std::vector<Other> others;  ///< as state.others
  /// With what comes over topics; cameras, video recording and graphics stay as they are at first.
  ViewerState state;
  /// When the participants that announced objects were heard last by their component_status; 0: never.
  std::map<dds::GuidPrefix, core::Nanoseconds> servers;

  /// Returns about how much memory it takes.
  std::size_t bytes() const;
};

/// Hears what a recording says while it is read; each may be empty.
struct RecordedListener {
  std::function<void(const ArmSample&)> arm;
  std::function<void(const MasterSample&)> master;
  std::function<void(const PerceptSample&)> percept;
  std::function<void(const HitSample&)> hit;
  std::function<void(MeshChunkSample)> mesh;  ///< they are no part of a moment: a hash stands for one content
};

/// Reads the messages of a recording as the viewer's readers take samples from the network: by the same
/// codecs, checks and rules. Log times stand for the time of receipt. That a wva_server has ended, which live
/// readers are told by discovery, shows by its component_status, which no longer comes. Not thread-safe.
class RecordedTopics {
 public:
  /// A participant whose component_status has not come for so long has ended.
  static constexpr core::Nanoseconds kGone_ns = 3 * core::kNsPerSecond;

  /// `others`: arms in partitions of their own, of which slave_state is read.
  explicit RecordedTopics(std::vector<OtherArmSource> others = {});
  ~RecordedTopics();
  RecordedTopics(RecordedTopics&&) noexcept;

  enum class Topic {
    kNone,
    kSlaveState,
    kMasterState,
    kGripperState,
    kPercept,
    kSkinPercept,
    kHitAlert,
    kModelDoubt,
    kObjectUncertainty,
    kPoseFinding,
    kLiveObject,
    kComponentStatus,
    kWorkspaceObject,
    kWorkspaceVersion,
    kMeshChunk,
    kOperatorCommand,
    kOtherSlaveState
  };
  /// A channel as far as it matters here.
  struct Source {
    Topic topic = Topic::kNone;  ///< kNone: not one of the viewer's topics
    dds::GuidPrefix writer{};    ///< participant that wrote it
    std::size_t other = 0;       ///< of kOtherSlaveState: which arm
  };
  /// Returns what a channel is: of another arm's partition slave_state counts alone.
  Source source_of(const recording::Channel& channel) const;

  /// Takes a message into the moment. Returns false if it is refused: it is damaged, of another arm, of a
  /// process that is not followed, out of order.
  bool take(const Source& source, const recording::Message& message, RecordedMoment& moment,
            const RecordedListener& listener = {});

 private:
  struct Impl;
  std::vector<OtherArmSource> others_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::synthetic_viewer
