#include "components/wva_server/carriers.hpp"

#include <spdlog/fmt/fmt.h>

#include <ranges>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/runtime/cell/arm_model.hpp"

namespace phantom::wva_server {
namespace {

using core::Status;

}  // namespace

std::map<std::string, CarrierArm> load_carriers(const runtime::CellConfig& cell) {
  std::map<std::string, CarrierArm> arms;
  for (const runtime::ArmConfig& config : cell.arms)
    arms.emplace(config.name, CarrierArm{runtime::load_kinematics(config), last_link_of(config)});
  return arms;
}

Carriers::Carriers(std::map<std::string, CarrierArm> arms, const std::string& followed, double staleness_s)
    : arms_(std::move(arms)), followed_(followed), staleness_ns_(core::from_seconds(staleness_s)) {
  if (followed_.empty() && arms_.size() == 1) followed_ = arms_.begin()->first;
}

const robot::SerialArm* Carriers::followed() const {
  const auto arm = arms_.find(followed_);
  return arm == arms_.end() ? nullptr : &arm->second.arm;
}

std::optional<robot::LinkPoses> Carriers::link_poses(core::Nanoseconds now_ns) const {
  if (followed() == nullptr || newest_.received_ns == 0 || now_ns - newest_.received_ns > staleness_ns_)
    return std::nullopt;
  robot::LinkPoses X_WL;
  followed()->link_poses(newest_.position, X_WL);
  return X_WL;
}

core::Expected<WorkspaceCommand> Carriers::complete(const WorkspaceCommand& command, const LiveCell& cell,
                                                    core::Nanoseconds now_ns) const {
  const bool attaches = command.operation == WorkspaceOperation::kAttach;
  if (!attaches && command.operation != WorkspaceOperation::kRelease) return command;
  const auto id = cell.find(command);
  if (!id) return id.status();
  const ServedObject& object = cell.objects().at(*id);
  if (attaches == object.carrier.has_value()) return command;  // refused with a better reason
  if (attaches) return complete_attach(command, object, now_ns);
  if (command.sets_pose) return command;
  WorkspaceCommand completed = command;
  const auto X_WF = frame_pose(object.carrier->arm, object.carrier->frame, "where it stands now", now_ns);
  if (!X_WF) return X_WF.status();
  completed.X_WO = *X_WF * object.carrier->X_FO;
  completed.sets_pose = true;
  return completed;
}

core::Expected<WorkspaceCommand> Carriers::complete_attach(WorkspaceCommand command,
                                                           const ServedObject& object,
                                                           core::Nanoseconds now_ns) const {
  if (command.arm.empty()) command.arm = followed_;
  const auto carrier = arms_.find(command.arm);
  if (carrier == arms_.end())
    return Status::not_found(fmt::format("no arm '{}' that can carry it; there are: {}", command.arm,
                                         arms_.empty() ? "none" : core::listed(std::views::keys(arms_))));
  const auto& hold = object.config.hold;
  if (hold && !command.sets_pose && (command.frame.empty() || command.frame == hold->frame)) {
    command.frame = hold->frame;
    command.X_FO = hold->X_FO;
    command.sets_pose = true;
  }
  if (command.frame.empty()) command.frame = carrier->second.tip;
  const auto frame = carrier->second.arm.find_frame(command.frame);
  if (!frame || frame->first == 0)
    return Status::not_found(fmt::format("arm '{}' has no moving link '{}'", command.arm, command.frame));
  if (command.sets_pose) return command;
  const auto X_WF = frame_pose(command.arm, command.frame, "its pose in the frame of the link", now_ns);
  if (!X_WF) return X_WF.status();
  command.X_FO = X_WF->inverse() * object.config.X_WO;
  command.sets_pose = true;
  return command;
}

/// Returns where a link's frame is now. `instead`: what the command can say if that is not known.
core::Expected<geometry::Pose> Carriers::frame_pose(const std::string& arm, const std::string& frame,
                                                    const std::string& instead,
                                                    core::Nanoseconds now_ns) const {
  const auto unknown = [&](const std::string& why) {
    return Status(core::ErrorCode::kUnavailable,
                  fmt::format("the place of arm '{}' is not known: {}; allowed: the same command with {}",
                              arm, why, instead));
  };
  if (arm != followed_ || followed() == nullptr)
    return unknown("this wva_server does not follow it (arm in its configuration)");
  if (newest_.received_ns == 0) return unknown("no slave_state has come");
  const auto X_WL = link_poses(now_ns);
  if (!X_WL)
    return unknown(
        fmt::format("its newest slave_state is {:.1f} s old", core::seconds(now_ns - newest_.received_ns)));
  const auto link = followed()->find_frame(frame);
  if (!link) return unknown("it has no link '" + frame + "'");
  return (*X_WL)[link->first] * link->second;
}

}  // namespace phantom::wva_server
