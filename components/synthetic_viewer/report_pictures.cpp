#include "components/synthetic_viewer/report_pictures.hpp"

#include <utility>

namespace phantom::synthetic_viewer {

void ReportPictures::take(const HitSample& alert) {
  if (report_.wants_hit_pictures()) alerts_.push_back(alert);
}

bool ReportPictures::photograph_alert(Drawing& drawing, const GiveUp& give_up) {
  if (alerts_.empty()) return true;
  const HitSample& hit = alerts_.front();
  auto [picture, node] = drawing.picture(hit);
  auto image = drawing.photograph(std::move(picture), give_up);
  if (!image) return false;
  report_.save_hit(hit.alert, percept::node_name(node), core::seconds(hit.received_ns - begin_ns_),
                   hit.utc_ns, std::move(*image));
  alerts_.pop_front();
  return true;
}

bool ReportPictures::photograph(Drawing& drawing, const ArmSample& arm, bool complete,
                                const GiveUp& give_up) {
  if (!report_.wanted()) return true;
  if (!photograph_alert(drawing, give_up)) return false;
  const std::array<bool, 3> reached{complete && arm.received_ns != 0, drawing.hit_view().alert != 0,
                                    arm.contact};
  for (std::size_t i = 0; i < milestones_.size(); ++i) {
    if (milestones_[i].saved || !reached[i]) continue;
    auto image = drawing.photograph(drawing.picture(View::kMain), give_up);
    if (!image) return false;
    report_.save(milestones_[i].name, std::move(*image));
    milestones_[i].saved = true;
  }
  return true;
}

void ReportPictures::finish(Drawing& drawing) {
  if (!report_.wanted()) return;
  constexpr core::Nanoseconds kPatience_ns = core::kNsPerSecond;
  const core::Nanoseconds until_ns = core::monotonic_ns() + kPatience_ns;
  while (!alerts_.empty() && core::monotonic_ns() < until_ns) photograph_alert(drawing, {});
  report_.save("main", *drawing.photograph(drawing.picture(View::kMain), {}));
}

}  // namespace phantom::synthetic_viewer
