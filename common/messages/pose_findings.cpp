#include "common/messages/pose_findings.hpp"

#include <utility>

#include "common/geometry/pose.hpp"

namespace phantom::messages {

bool PoseFindings::take(PoseFinding finding) {
  if (findings_.size() == kMax && !findings_.contains(finding.id)) return false;
  const std::uint16_t id = finding.id;
  findings_.insert_or_assign(id, std::move(finding));
  return true;
}

const PoseFinding* PoseFindings::of(std::uint16_t id) const {
  const auto found = findings_.find(id);
  return found == findings_.end() ? nullptr : &found->second;
}

const PoseFinding* PoseFindings::displacing(std::uint16_t id, const geometry::Pose& X_WO) const {
  const PoseFinding* const found = of(id);
  if (found == nullptr || found->verdict == PoseVerdict::kAgrees) return nullptr;
  return geometry::same_pose(found->X_WO, X_WO) ? found : nullptr;
}

}  // namespace phantom::messages
