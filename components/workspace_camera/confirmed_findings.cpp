#include "components/workspace_camera/confirmed_findings.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace phantom::workspace_camera {

void ConfirmedFindings::take(std::size_t camera, const std::vector<PoseFinding>& findings) {
  for (const PoseFinding& finding : findings) {
    if (finding.verdict == PoseVerdict::kUnseen) continue;
    auto entry = std::ranges::find_if(
        entries_, [&](const Entry& one) { return one.camera == camera && one.latest.id == finding.id; });
    if (entry == entries_.end())
      entry = entries_.insert(entries_.end(), {camera, finding, {}});
    else if (entry->latest.verdict == finding.verdict) {
      // Figures that vary by less than is tolerated stay as they were said.
      const bool same = entry->reported.verdict == finding.verdict &&
                        (entry->reported.shift_m - finding.shift_m).norm() < tolerance_m_;
      if (!same) entry->reported = finding;
    }
    entry->latest = finding;
  }
}

void ConfirmedFindings::forget(std::uint16_t id) {
  std::erase_if(entries_, [id](const Entry& entry) { return entry.latest.id == id; });
}

void ConfirmedFindings::forget_camera(std::size_t camera) {
  std::erase_if(entries_, [camera](const Entry& entry) { return entry.camera == camera; });
}

std::string sentence(const PoseFinding& reported) {
  if (reported.verdict == PoseVerdict::kGone)
    return fmt::format("'{}' is gone: the camera sees through where the model has it", reported.name);
  if (reported.verdict == PoseVerdict::kUnclear)
    return fmt::format("'{}' is not where the model has it, and this camera does not show where it is",
                       reported.name);
  const Eigen::Vector3d& shift_m = reported.shift_m;
  return fmt::format(
      "'{}' stands {:.2f} m from where the model has it, by ({:+.2f}, {:+.2f}, {:+.2f}) m{}; {:.0f} mm remain{}",
      reported.name, shift_m.norm(), shift_m.x(), shift_m.y(), shift_m.z(),
      reported.turned_rad > 0.035 ? fmt::format(", turned by {:.0f}°", 57.29578 * reported.turned_rad) : "",
      1e3 * reported.residual_m,
      reported.open.empty() ? "" : fmt::format("; not seen: {}", fmt::join(reported.open, ", ")));
}

std::vector<ConfirmedFinding> ConfirmedFindings::reported() const {
  std::vector<ConfirmedFinding> all;
  for (const Entry& entry : entries_) {
    if (entry.reported.verdict == PoseVerdict::kUnseen) continue;
    const auto known = std::ranges::find_if(
        all, [&](const ConfirmedFinding& one) { return one.finding.id == entry.reported.id; });
    if (known == all.end())
      all.push_back({entry.camera, entry.reported});
    else if (known->finding.verdict == PoseVerdict::kAgrees)
      *known = {entry.camera, entry.reported};
  }
  return all;
}

}  // namespace phantom::workspace_camera
