#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "components/synthetic_viewer/view_choice.hpp"

namespace phantom::synthetic_viewer {

struct HitViewConfig {
  ViewChoiceConfig choice;
  /// An alert's view is shown at least this long before a newer alert replaces it.
  double least_show_s = 1.0;
  double hold_after_clear_s = 3.0;  ///< and for this long after the alert is cleared
};

/// A hit alert in the form that the view needs.
struct AlertNews {
  std::uint32_t alert = 0;
  bool cleared = false;
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d pgv = Eigen::Vector3d::Zero();
};

/// What the hit-zone view shows now.
struct HitView {
  std::uint32_t alert = 0;   ///< 0: no view
  bool threatening = false;  ///< the alert is not cleared
  ViewNode node = ViewNode::kAutomatic;
  ViewSituation situation;
  Eigen::Vector3d eye_m = Eigen::Vector3d::Zero();
};

/// Decides which hit zone is shown, and from where (4.2): that of the newest alert, steadily, until some time
/// after the alert was cleared. The operator may hold the view and choose the node. Time comes in as dt only.
/// step() allocates nothing.
class SyntheticViewer {
 public:
  explicit SyntheticViewer(const HitViewConfig& config) : config_(config), chooser_(config.choice) {}

  /// Takes a raised or cleared alert. A cleared alert that is not known is ignored.
  void take(const AlertNews& news) noexcept;

  /// Advances by one frame. `hold`: keep the view that is shown; `chosen`: the operator's node, or automatic.
  HitView step(bool hold, ViewNode chosen, const VisibleShare& visible, double dt_s);

 private:
  struct Alert {
    AlertNews news;
    bool pending = false;  // raised, and neither shown nor cleared
  };
  void show(const AlertNews& news) noexcept;

  static constexpr std::size_t kRemembered = 16;

  HitViewConfig config_;
  ViewChooser chooser_;
  std::optional<AlertNews> shown_;
  double shown_s_ = 0.0;
  double over_s_ = 0.0;  // since the shown alert was cleared
  std::array<Alert, kRemembered> alerts_{};
  std::size_t next_ = 0;
};

}  // namespace phantom::synthetic_viewer
