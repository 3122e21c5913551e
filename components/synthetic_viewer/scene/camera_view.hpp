#pragma once

#include <deque>
#include <memory>
#include <string>

#include "components/synthetic_viewer/render/renderer.hpp"
#include "components/synthetic_viewer/samples/recent_samples.hpp"
#include "components/synthetic_viewer/state/localized_text.hpp"
#include "components/synthetic_viewer/state/state.hpp"
#include "components/synthetic_viewer/video/picture_warp.hpp"
#include "components/synthetic_viewer/video/video_feed.hpp"

namespace phantom::synthetic_viewer {

/// When video is out of date.
struct VideoStaleness {
  double silent_s = 0.5;  ///< since the last picture came
  double stuck_s = 2.0;   ///< since the last picture came that differs from the one before; 0: not looked at
};

/// A camera's picture as it is shown at one moment, and of which moment it is.
struct VideoMoment {
  std::shared_ptr<const Image>
      picture;    ///< without distortion, of the view's size; darkened if not live; null: none
  Camera camera;  ///< sees the world as the picture does
  std::string name;
  LocalizedText calibration;  ///< how good it is; empty: not told
  bool live = false;          ///< false: nothing may be drawn over the picture
  LocalizedText problem;      ///< what must be said in large letters if it is not live
  bool latency_known = false;
  core::Nanoseconds exposed_ns = 0;  ///< if the latency is not known: when the picture came
  double age_s = 0.0;                ///< since then
};

/// Prepares a camera's video for drawing: takes the distortion out, judges its age, and knows the samples of
/// its time. Used on the viewer's thread.
class CameraView {
 public:
  /// `camera` must be calibrated. All references must outlive this.
  CameraView(const VideoCamera& camera, const PictureFormat& format, const VideoStaleness& staleness,
             const VideoFeed& feed, const RecentSamples& past);

  /// Lets the model be drawn by another calibration of the pose from now on.
  void stand(const Calibration& calibration, bool on_trial);
  /// Takes the skin's percept, for pictures of its time.
  void take(const SkinSample& skin);
  /// Returns the video as it stands now.
  VideoMoment at(core::Nanoseconds now_ns);
  /// Returns the state as it was at a time: arms, gripper, percept and skin of then, or not known; all else
  /// as now.
  ViewerState state_at(const ViewerState& now, core::Nanoseconds time_ns, const Staleness& staleness) const;
  /// Returns the number of pictures that the feed refused.
  std::uint64_t refused() const { return feed_.status().refused; }

 private:
  void straighten(const VideoStatus& status);
  LocalizedText fault(const VideoStatus& status, core::Nanoseconds now_ns) const;

  const VideoCamera& camera_;
  Calibration calibration_;
  bool on_trial_ = false;
  const VideoStaleness staleness_;
  const VideoFeed& feed_;
  const RecentSamples& past_;
  camera::Lens straight_;
  PictureWarp warp_;
  std::uint64_t shown_ = 0;  // number of the picture below
  std::shared_ptr<const Image> picture_, dark_;
  std::deque<SkinSample> skins_;
};

}  // namespace phantom::synthetic_viewer
