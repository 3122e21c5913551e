#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/core/clock.hpp"
#include "common/web/broadcast.hpp"
#include "components/synthetic_viewer/render/image.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"
#include "components/synthetic_viewer/scene/mesh_store.hpp"
#include "components/synthetic_viewer/scene/scene_base.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// The newest picture of a view, for its followers.
struct ViewOutput {
  web::Broadcast<std::string> jpeg;
  web::Broadcast<Image> image;  ///< with HUD; followed by window and recorder

  bool followed() const { return jpeg.followers > 0 || image.followers > 0; }
};

class FluidStore;
class Review;
class PoseCalibration;

/// What page and window show. The viewer fills it; the servers' threads and the window's read it.
struct PageContent {
  std::array<ViewOutput, kViews.size()> views;
  web::Broadcast<SceneBase> scene;       ///< for the scene stream
  MeshStore meshes;                      ///< of the scene
  web::Broadcast<nlohmann::json> state;  ///< page_state()
  web::Broadcast<ViewSwitches> switches;
  web::Broadcast<ViewPoseSample> view_pose;  ///< of the view that the operator looks at
  ViewOutput& view(View which) { return views[static_cast<std::size_t>(which)]; }
  /// Returns the newest main picture as PNG; empty if there is none yet. Called on a server thread.
  std::function<std::string()> main_png;
  /// Returns an alert's first picture as JPEG; empty if there is none (any more). Called on a server thread.
  std::function<std::string(std::uint32_t alert)> hit_picture;
  FluidStore* fluid = nullptr;  ///< what the drawn scene shows of the fluid; null: nothing is known of it
  Review* review = nullptr;     ///< the recording that is shown; null: what is shown is live
  PoseCalibration* calibration = nullptr;  ///< of the real camera's pose; null: there is none
  std::function<void()> wake;              ///< lets the next round begin at once; may be empty. Any thread
  /// Returns which sides are stopped now. Any thread; must not wait for a picture.
  std::function<StopView()> stops;

  /// Records a request for the state by a page that polls it instead of following it.
  void ask_state(core::Nanoseconds now_ns) { state_asked_ns = now_ns; }
  bool state_wanted(core::Nanoseconds now_ns) const {
    constexpr core::Nanoseconds kAsked_ns = 2 * core::kNsPerSecond;
    const core::Nanoseconds asked_ns = state_asked_ns;
    return state.followers > 0 || (asked_ns != 0 && now_ns - asked_ns < kAsked_ns);
  }

 private:
  std::atomic<core::Nanoseconds> state_asked_ns{0};
};

}  // namespace phantom::synthetic_viewer
