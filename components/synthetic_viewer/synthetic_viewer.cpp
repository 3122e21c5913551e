#include "components/synthetic_viewer/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

void SyntheticViewer::take(const AlertNews& news) noexcept {
  if (!news.cleared) {
    alerts_[next_] = {news, true};
    next_ = (next_ + 1) % kRemembered;
    return;
  }
  for (Alert& alert : alerts_) {
    if (alert.news.alert == news.alert) alert.pending = false;
  }
  if (shown_ && shown_->alert == news.alert && !shown_->cleared) {
    shown_->cleared = true;
    over_s_ = 0.0;
  }
}

void SyntheticViewer::show(const AlertNews& news) noexcept {
  shown_ = news;
  shown_s_ = 0.0;
  over_s_ = 0.0;
  chooser_.release();
}

HitView SyntheticViewer::step(bool hold, ViewNode chosen, const VisibleShare& visible, double dt_s) {
  shown_s_ += dt_s;
  if (shown_ && shown_->cleared) over_s_ += dt_s;
  const bool may_change = !shown_ || (!hold && (shown_->cleared || shown_s_ >= config_.least_show_s));
  if (may_change) {
    const Alert* newest = nullptr;
    // By arrival, not by number, because a restarted phantom counts from 1 again.
    for (std::size_t back = 1; back <= kRemembered && newest == nullptr; ++back) {
      const Alert& alert = alerts_[(next_ + kRemembered - back) % kRemembered];
      if (alert.pending) newest = &alert;
    }
    if (newest != nullptr) {
      show(newest->news);
      // Older alerts are dropped: the view follows the newest.
      for (Alert& alert : alerts_) alert.pending = false;
    }
  }
  if (shown_ && shown_->cleared && !hold && over_s_ >= config_.hold_after_clear_s) shown_.reset();
  if (!shown_) return {};
  HitView view;
  view.alert = shown_->alert;
  view.threatening = !shown_->cleared;
  view.situation = {shown_->look_at_m, shown_->pgv, chosen};
  view.node = chooser_.step(view.situation, visible, dt_s);
  view.eye_m = chooser_.eye_m(view.situation);
  return view;
}

}  // namespace phantom::synthetic_viewer
