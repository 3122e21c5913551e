#include "common/runtime/cell/cell_names.hpp"

#include <algorithm>
#include <ranges>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/runtime/cell/arm_model.hpp"

namespace phantom::runtime {
namespace {

using core::ConfigError;

enum class Links { kAll, kMoving };

std::string names_of(const robot::SerialArm& arm, Links which) {
  std::string names;
  for (std::size_t i = which == Links::kMoving ? 1 : 0; i < arm.links().size(); ++i)
    for (const auto& [name, X_link_frame] : arm.links()[i].frames) core::add_to_list(names, name);
  return names;
}

bool has_link(const robot::SerialArm& arm, const std::string& link, Links which) {
  const auto frame = arm.find_frame(link);
  return frame && (which == Links::kAll || frame->first > 0);
}

void check_link(const robot::SerialArm& arm, const std::string& link, Links which, const std::string& place) {
  if (has_link(arm, link, which)) return;
  throw ConfigError(place + "'" + link + "' is no " + (which == Links::kMoving ? "moving " : "") +
                    "link of the arm; allowed: " + names_of(arm, which));
}

void check_arm(const ArmConfig& config, const robot::SerialArm& arm, const CellConfig& cell) {
  const std::string place = config.file.string() + ": arm '" + config.name + "': ";
  for (const LinkSkinConfig& skin : config.skin)
    check_link(arm, skin.link, Links::kAll, place + "skin: link: ");
  for (const InterestPointConfig& point : config.interest_points)
    check_link(arm, point.link, Links::kAll, place + "interest_points: '" + point.name + "': link: ");
  for (const DisplacedLinkConfig& one : config.displaced)
    check_link(arm, one.link, Links::kMoving, place + "displaced: link: ");
  for (const AllowedContactConfig& contact : config.allowed_contact) {
    const std::string at = cell.file.string() + ": arm '" + config.name + "': allowed_contact: ";
    if (std::ranges::count(cell.objects, contact.object, &ObjectConfig::name) == 0) {
      throw ConfigError(at + "object: no object is called '" + contact.object +
                        "'; allowed: " + core::listed(cell.objects, &ObjectConfig::name));
    }
    if (!contact.link.empty()) check_link(arm, contact.link, Links::kMoving, at + "link: ");
  }
}

/// A hold without an arm is for any arm that takes the object: one must have the link.
void check_hold(const ObjectConfig& object, const std::map<std::string, robot::SerialArm>& arms) {
  const std::string place = object.place + " '" + object.name + "': hold.";
  const HoldConfig& hold = *object.hold;
  if (!hold.arm.empty()) {
    const auto arm = arms.find(hold.arm);
    if (arm == arms.end()) {
      throw ConfigError(place + "arm: the cell has no arm '" + hold.arm +
                        "'; allowed: " + (arms.empty() ? "none" : core::listed(std::views::keys(arms))));
    }
    if (!hold.frame.empty()) check_link(arm->second, hold.frame, Links::kMoving, place + "frame: ");
    return;
  }
  if (hold.frame.empty() || arms.empty()) return;
  const auto has_frame = [&](const auto& arm) { return has_link(arm.second, hold.frame, Links::kMoving); };
  if (std::ranges::any_of(arms, has_frame)) return;
  std::string allowed;
  for (const auto& [name, arm] : arms) core::add_to_list(allowed, names_of(arm, Links::kMoving));
  throw ConfigError(place + "frame: '" + hold.frame +
                    "' is no moving link of an arm of the cell; allowed: " + allowed);
}

}  // namespace

std::string links_of(const robot::SerialArm& arm) { return names_of(arm, Links::kAll); }

void check_names(const CellConfig& cell) {
  std::map<std::string, robot::SerialArm> arms;
  for (const ArmConfig& config : cell.arms) {
    const auto& arm = arms.emplace(config.name, load_kinematics(config)).first->second;
    check_arm(config, arm, cell);
    load_closed_arm(config);
  }
  for (const ObjectConfig& object : cell.objects)
    if (object.hold) check_hold(object, arms);
}

CellConfig load_checked_cell(const std::filesystem::path& path, CellArms arms) {
  CellConfig cell = load_cell(path, arms);
  check_names(cell);
  return cell;
}

CellConfig load_checked_cell(const Deployment& deployment) {
  require_files(deployment);
  return load_checked_cell(deployment.cell);
}

}  // namespace phantom::runtime
