#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/recording/series_cursor.hpp"
#include "components/synthetic_viewer/review/reduced_series.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_recorded.hpp"

namespace phantom::synthetic_viewer {

/// What the page asks of a review; what is empty stays as it is.
struct ReviewRequest {
  std::optional<double> t_s;   ///< go there; from the recording's beginning
  std::optional<bool> play;    ///< go on by itself, or stand still
  std::optional<double> rate;  ///< seconds of the recording in a second
  static constexpr double kMinRate = 0.1, kMaxRate = 10.0;
};

/// An alert of the recording, as a mark on its time line.
struct AlertMark {
  core::Nanoseconds raised_ns = 0, cleared_ns = 0;  ///< 0: not cleared
  std::uint32_t alert = 0;
  HitRule rule = HitRule::kNone;
  std::string link, object, interest_point;
  double speed_m_s = 0.0;

  friend bool operator==(const AlertMark&, const AlertMark&) = default;
};

/// A number of the recording over time.
struct ReviewSeries {
  std::string name;   ///< "percept/2": unique
  std::string label;  ///< "wrist": what a reader calls it
  std::string unit;   ///< "N·m"; empty: none
  std::string plot;   ///< series of one plot have the same: "percept"
  ReducedSeries values;
};

/// A recorded session that is shown again: which moment, what was known then, and what there is to plot.
///
/// The recording is read once in whole when it is opened. Of it stay the reduced series, the marks, the
/// meshes until they are taken, and moments at certain times, from which any other is reached by reading the
/// file on from there: memory is bounded however long the recording is (kMaxMoments, kMaxMomentBytes), and
/// so is the time to reach a moment for a recording of minutes.
class Review {
 public:
  static constexpr std::size_t kMaxMoments = 512, kMaxMomentBytes = std::size_t{96} << 20, kMaxMarks = 10'000,
                               kMaxMeshBytes = std::size_t{512} << 20;
  static constexpr core::Nanoseconds kMinSpacing_ns = core::kNsPerSecond;  ///< of moments that stay
  /// Limits for the reading of files that may be hostile.
  static constexpr recording::ReaderLimits kLimits{256U << 20, 128U << 20, 512U << 20};

  /// Hears how far the reading is, 0…1.
  using OnProgress = std::function<void(double share)>;

  /// Reads the recordings, which were opened with kLimits. `arm`: the arm that is recorded. `others`: arms of
  /// the cell whose slave_state is in the same or in further recordings. Throws core::ConfigError if nothing
  /// in them is of that arm's viewer topics.
  Review(std::vector<recording::OpenedRecording> recordings, const robot::SerialArm& arm,
         const OnProgress& on_progress = {}, const std::vector<OtherArmSource>& others = {});

  // What was found, unchanged from then on. Any thread.
  core::Nanoseconds begin_ns() const { return begin_ns_; }  ///< log time of the first sample
  core::Nanoseconds end_ns() const { return end_ns_; }      ///< and of the last
  double duration_s() const { return core::seconds(end_ns_ - begin_ns_); }
  const std::vector<AlertMark>& marks() const { return marks_; }
  const std::vector<ReviewSeries>& series() const { return series_; }
  /// Returns what could not be read, and what was refused.
  const std::vector<std::string>& problems() const { return problems_; }
  std::size_t moments() const { return moments_.size(); }
  std::size_t moment_bytes() const { return moment_bytes_; }

  // What is shown. Any thread.
  struct Position {
    core::Nanoseconds at_ns = 0;  ///< log time
    bool playing = false;
    double rate = 1.0;
  };
  /// Carries out a request at `now_ns` (CLOCK_MONOTONIC). Fails if a value is out of its range.
  core::Status control(const ReviewRequest& request, core::Nanoseconds now_ns);
  Position position(core::Nanoseconds now_ns) const;
  /// Lets a command for the views hold instead of those that were recorded. An automatic node, or no hold,
  /// leaves the choice to the recording again.
  void choose(const Command& command);
  /// Returns which sides are stopped at the moment that is shown.
  StopView stops() const;

  // For the viewer. One thread.
  struct Shown {
    core::Nanoseconds at_ns = 0;
    bool jumped = false;          ///< the moment does not follow from the one before
    std::vector<HitSample> hits;  ///< alerts since the one before, if it does
  };
  /// Brings what topics fill of `state` to the moment that is to be shown at `now_ns` (CLOCK_MONOTONIC).
  Shown advance(core::Nanoseconds now_ns, ViewerState& state);
  /// Returns the parts of meshes of the whole recording, each once.
  std::deque<MeshChunkSample> take_meshes() { return std::move(meshes_); }

 private:
  struct Kept {
    core::Nanoseconds before_ns = 0;  // all messages before this were taken
    RecordedMoment moment;
  };
  using Sources = std::vector<std::unordered_map<std::uint16_t, RecordedTopics::Source>>;  // by recording

  void lay_out_series(const robot::SerialArm& arm);
  void read_all(const robot::SerialArm& arm, const OnProgress& on_progress);
  void keep_mesh(MeshChunkSample chunk);
  void keep(core::Nanoseconds before_ns, const RecordedMoment& moment);
  void mark(const HitSample& hit, const ViewerState& state);
  RecordedListener for_plots();
  recording::SeriesCursor cursor_from(core::Nanoseconds from_ns) const;
  const RecordedTopics::Source& source_of(const recording::SeriesCursor::Next& next) const;
  void go_to(core::Nanoseconds at_ns, std::vector<HitSample>* hits);

  std::vector<recording::OpenedRecording> recordings_;
  const messages::ArmBounds arm_;
  const std::vector<OtherArmSource> others_;
  Sources sources_;
  RecordedTopics topics_;
  core::Nanoseconds begin_ns_ = 0, end_ns_ = 0;
  core::Nanoseconds first_pose_ns_ = 0;  // of the arm: what is shown at first; 0: it never came
  std::vector<AlertMark> marks_;
  std::unordered_map<std::uint32_t, std::size_t> open_marks_;  // by alert
  std::uint64_t marks_left_out_ = 0;
  std::vector<ReviewSeries> series_;
  std::vector<std::string> problems_;
  std::deque<MeshChunkSample> meshes_;
  std::set<std::pair<std::uint64_t, std::uint32_t>> mesh_parts_;  // while the recording is read
  std::size_t mesh_bytes_ = 0;

  std::vector<Kept> moments_;
  std::size_t moment_bytes_ = 0;
  core::Nanoseconds spacing_ns_ = kMinSpacing_ns;

  // The moment that is shown, and how it goes on; the viewer's thread alone.
  std::optional<RecordedMoment> moment_;
  core::Nanoseconds reached_ns_ = 0;
  std::optional<recording::SeriesCursor> cursor_;

  mutable std::mutex mutex_;  // for what follows
  Position position_;         // as of since_ns_
  core::Nanoseconds since_ns_ = 0;
  bool jump_ = true;
  std::optional<ViewNode> node_;
  std::optional<bool> hold_;
  StopView stops_;
};

}  // namespace phantom::synthetic_viewer
