#include "components/wva_server/grasp_watch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace phantom::wva_server {
namespace {

constexpr int kSteps = 12;          // of the fingers' way until they meet
constexpr double kMinShare = 0.02;  // of all places: less is a touch, not a grasp
constexpr double kSame_m = 0.002;   // by which the width of what is held may change

bool is_body(std::int8_t order) { return order >= workspace::kOrderBoundary || order < 0; }

}  // namespace

std::optional<std::uint16_t> object_between(const std::vector<robot::FingerPoint>& fingers,
                                            double width_share, const robot::LinkPoses& X_WL,
                                            const workspace::Workspace& workspace) {
  const double from = 1.0 - std::clamp(width_share, 0.0, 1.0);
  std::map<std::uint16_t, std::size_t> found;
  for (const robot::FingerPoint& point : fingers) {
    for (int step = 0; step < kSteps; ++step) {
      const double at = from + (1.0 - from) * (step + 0.5) / kSteps;
      const workspace::Index3 voxel =
          workspace.grid().index_of(X_WL[point.link] * (point.open_m + at * point.closing_m));
      if (is_body(workspace.order(voxel))) ++found[workspace.object(voxel)];
    }
  }
  const auto most = std::max_element(found.begin(), found.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  const double all = static_cast<double>(fingers.size()) * kSteps;
  if (most == found.end() || static_cast<double>(most->second) < kMinShare * all) return std::nullopt;
  return most->first;
}

std::optional<std::uint16_t> GraspWatch::carried_by_gripper(const LiveCell& cell) const {
  for (const auto& [id, object] : cell.objects()) {
    if (object.carrier && object.carrier->arm == arm_ && object.carrier->frame == tip_ && !object.config.hold)
      return id;
  }
  return std::nullopt;
}

WorkspaceCommand GraspWatch::command(WorkspaceOperation operation, std::uint16_t id,
                                     const LiveCell& cell) const {
  WorkspaceCommand command;
  command.requester = "the gripper of arm '" + arm_ + "'";
  command.operation = operation;
  command.object = cell.objects().at(id).config.name;
  command.arm = arm_;
  command.frame = tip_;
  return command;
}

std::optional<WorkspaceCommand> GraspWatch::step(const messages::GripperState& gripper,
                                                 const robot::LinkPoses& X_WL, const LiveCell& cell) {
  if (!has_gripper() || !gripper.sense.known || !gripper.sense.follows || gripper.sense.fault)
    return std::nullopt;
  const double width_m = gripper.sense.width_m;
  const auto carried = carried_by_gripper(cell);
  if (gripper.holds && !gripper.open) {
    const bool begins = !std::exchange(held_, true);
    if (begins) held_width_m_ = width_m;
    if (!begins || carried) return std::nullopt;
    const auto id = object_between(fingers_, width_m / gripper.widest_m, X_WL, cell.workspace());
    if (!id || !cell.objects().contains(*id)) return std::nullopt;
    return command(WorkspaceOperation::kAttach, *id, cell);
  }
  if (!held_ || std::abs(width_m - held_width_m_) < kSame_m) return std::nullopt;
  held_ = false;
  if (!carried) return std::nullopt;
  return command(WorkspaceOperation::kRelease, *carried, cell);
}

}  // namespace phantom::wva_server
