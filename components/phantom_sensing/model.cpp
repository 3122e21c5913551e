#include "components/phantom_sensing/model.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/cell/cell_identity.hpp"
#include "common/runtime/cell/cell_names.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::ConfigError;

/// Returns the value, or throws a ConfigError whose message begins with `place`.
template <class T>
T value_or_throw(core::Expected<T> expected, const std::string& place) {
  if (!expected) throw ConfigError(place + expected.status().message());
  return std::move(expected).value();
}

std::vector<SkinShare> shares_of(const Config& config, const robot::SerialArm& arm) {
  std::vector<SkinShare> shares;
  robot::LinkSet taken;
  for (const ShareConfig& share : config.shares) {
    SkinShare& links = shares.emplace_back(share.name, robot::LinkSet(), share.partition);
    const std::string place = config.file.string() + ": sharing.shares: '" + share.name + "': ";
    for (const std::string& name : share.links) {
      const auto frame = arm.find_frame(name);
      if (!frame || frame->first == 0)
        throw ConfigError(place + "'" + name + "' is no moving link; allowed: one of the arm's");
      if (taken[frame->first])
        throw ConfigError(place + "'" + name +
                          "' moves with a link that is named already; allowed: each once");
      taken[frame->first] = links.links[frame->first] = true;
    }
  }
  return shares;
}

std::size_t first_feeling_link(const Config& config, const robot::SerialArm& arm) {
  if (config.first_feeling_link.empty()) return 1;
  const auto frame = arm.find_frame(config.first_feeling_link);
  if (frame && frame->first > 0) return frame->first;
  throw ConfigError(config.file.string() + ": doubt.first_link: '" + config.first_feeling_link +
                    "' is no moving link; allowed: one of the arm's, or \"\"");
}

std::optional<std::size_t> own_share_of(const Config& config) {
  if (config.own_share.empty()) return {};
  const auto named = std::find_if(config.shares.begin(), config.shares.end(),
                                  [&](const ShareConfig& share) { return share.name == config.own_share; });
  if (named != config.shares.end()) return static_cast<std::size_t>(named - config.shares.begin());
  throw ConfigError(
      "--share: '" + config.own_share + "' is none of sharing.shares in " + config.file.string() +
      "; allowed: " + (config.shares.empty() ? "none" : core::listed(config.shares, &ShareConfig::name)));
}

/// Returns whether two arms have the same joints, and their links stand alike at the home of one.
bool stand_alike(const runtime::ArmConfig& one, const runtime::ArmConfig& other) {
  const robot::SerialArm a = runtime::load_arm(one), b = runtime::load_arm(other);
  const auto same_joint = [](const robot::Joint& x, const robot::Joint& y) { return x.name == y.name; };
  if (!std::ranges::equal(a.joints(), b.joints(), same_joint)) return false;
  core::JointArray home{};
  std::ranges::copy(one.home, home.begin());
  robot::LinkPoses of_a, of_b;
  a.link_poses(home, of_a);
  b.link_poses(home, of_b);
  const auto links = static_cast<std::ptrdiff_t>(a.joint_count() + 1);
  return std::equal(of_a.begin(), of_a.begin() + links, of_b.begin(), [](const auto& x, const auto& y) {
    return x.translation_m == y.translation_m && x.rotation == y.rotation;
  });
}

/// A share's own cell is the arm's in other voxels: alerts name objects by their numbers, and the arm stands
/// where it stands.
void check_alike(const runtime::CellConfig& cell, const runtime::CellConfig& other, const Config& config) {
  const auto same_name = [](const auto& a, const auto& b) {
    return a.name == b.name && a.id == b.id && a.kind == b.kind;
  };
  if (!std::ranges::equal(cell.objects, other.objects, same_name))
    throw ConfigError(other.file.string() + ": objects: are not those of " + cell.file.string() +
                      "; allowed: the same names and kinds in the same order");
  const auto is_soft = [](const auto& object) { return !object.profile.stiffness_inside_Pa_per_m.empty(); };
  for (std::size_t i = 0; i < cell.objects.size(); ++i)
    if (is_soft(cell.objects[i]) != is_soft(other.objects[i]))
      throw ConfigError(other.objects[i].place + " '" + other.objects[i].name +
                        "': is soft in this file or in " + cell.file.string() +
                        " only (inside.stiffness_Pa_per_m); allowed: in both or in neither");
  const runtime::ArmConfig &arm = cell.arm(config.arm), &twin = other.arm(config.arm);
  if (arm.name != twin.name || arm.home != twin.home || !stand_alike(arm, twin))
    throw ConfigError(other.file.string() + ": arm '" + twin.name + "': is not that of " +
                      cell.file.string() + "; allowed: the same but for its skin and interest points");
}

std::vector<robot::SoftBody> soft_bodies(const runtime::CellConfig& cell) {
  std::vector<robot::SoftBody> bodies;
  for (const auto& object : cell.objects)
    if (!object.profile.stiffness_inside_Pa_per_m.empty())
      bodies.push_back(robot::soft_body(object.id, object.profile, cell.voxel_size_m.reference_m()));
  return bodies;
}

}  // namespace

runtime::CellConfig sensed_cell(runtime::CellConfig cell, const Config& config) {
  std::optional<runtime::CellConfig> own;
  for (const ShareConfig& share : config.shares) {
    if (share.cell.empty()) continue;
    runtime::CellConfig other = runtime::load_checked_cell(share.cell);
    check_alike(cell, other, config);
    if (share.name == config.own_share) own = std::move(other);
  }
  return own ? *std::move(own) : std::move(cell);
}

PhantomModel load_model(const runtime::CellConfig& cell, const Config& config) {
  const runtime::ArmConfig& arm_config = cell.arm(config.arm);
  const std::string place = cell.file.string() + ": arm '" + arm_config.name + "': ";
  robot::SerialArm arm = runtime::load_arm(arm_config);
  robot::SkinOptions options = config.skin;
  options.voxel_size_m = cell.voxel_size_m;
  auto shares = shares_of(config, arm);
  const auto own_share = own_share_of(config);
  auto parts = runtime::load_skin(arm_config, arm);
  if (own_share &&
      shares[*own_share].has_own_workspace())  // all of the arm's would be too many in fine voxels
    std::erase_if(parts, [&](const robot::LinkSkin& part) {
      const auto frame = arm.find_frame(part.link);
      return frame && !shares[*own_share].links[frame->first];
    });
  auto skin = value_or_throw(robot::lay_out_skin(arm, parts, options), place);
  if (skin.left_out > 0) {
    spdlog::warn("{} parts of the skin are on the arm's base, which does not move: left out", skin.left_out);
  }
  if (options.pitch_vox > 1.0) {
    spdlog::warn("skin.pitch_vox is {}: the skin is coarser than the voxels, drag will be less smooth",
                 options.pitch_vox);
  }
  const auto closed = runtime::load_closed_arm(arm_config);
  std::vector<InterestPoint> points;
  for (const auto& point : arm_config.interest_points) {
    const auto frame = arm.find_frame(point.link);
    if (!frame) {
      throw ConfigError(place + "interest_points: '" + point.name + "' is on an unknown link '" + point.link +
                        "'; allowed: a link of the arm");
    }
    points.push_back({point.name, frame->first, frame->second * point.position_m,
                      runtime::closing_of_frame(arm, closed, point.link)});
  }
  if (own_share) points.clear();  // the arm's process watches them
  auto soft = soft_bodies(cell);
  robot::ModelIdentity identity = runtime::identity_of(cell, config.arm, arm);
  if (own_share) identity.cell = 0;  // a share may have voxels of its own
  const std::size_t first_feeling = first_feeling_link(config, arm);
  PhantomModel model{std::move(arm),     std::move(skin),   std::move(points),
                     arm_config.name,    options,           {cell.media.begin(), cell.media.end()},
                     std::move(soft),    std::move(shares), own_share,
                     std::move(identity)};
  model.first_feeling_link = first_feeling;
  return model;
}

ContactRegister contacts_of_cell(const runtime::CellConfig& cell, const Config& config,
                                 const PhantomModel& model) {
  ContactRegister contacts(model.arm);
  std::map<std::uint16_t, std::string> names;
  for (std::size_t i = 0; i < cell.objects.size(); ++i)
    names[static_cast<std::uint16_t>(i + 1)] = cell.objects[i].name;
  contacts.know_objects(std::move(names));
  for (const auto& contact : cell.arm(config.arm).allowed_contact) {
    const Answer answer = contacts.handle(
        {.request = messages::SensingRequest::kAllowContact, .object = contact.object, .link = contact.link},
        0);
    if (!answer.done) throw ConfigError(cell.file.string() + ": allowed_contact: " + answer.message);
  }
  return contacts;
}

percept::AllowedContact allowed_contact(const runtime::CellConfig& cell, const Config& config,
                                        const PhantomModel& model) {
  return contacts_of_cell(cell, config, model).permits().at(0);
}

TickTime predict_tick(const runtime::CellConfig& cell, const Config& config, const PhantomModel& model) {
  std::vector<workspace::LayerProfile> profiles{cell.profile};
  for (const auto& object : cell.objects) profiles.push_back(object.profile);
  TickCase at;
  const auto& home = cell.arm(config.arm).home;
  std::copy(home.begin(), home.end(), at.home.begin());
  at.grid = runtime::grid_of(cell);
  at.palette =
      value_or_throw(workspace::next_palette(profiles, {0.0F}), cell.file.string() + ": ").mu_Pa_s_per_m;
  at.allowed = allowed_contact(cell, config, model);
  return time_tick(model, config.percept, at, 0.5);
}

workspace::Workspace build_workspace(const runtime::CellConfig& cell) {
  const std::vector<runtime::CellBody> bodies = runtime::load_bodies(cell);
  std::vector<layers::LiveBody> live;
  for (const auto& loaded : bodies)
    live.push_back({&loaded.body, cell.objects[loaded.body.id - 1U].priority});
  layers::LiveWorkspace workspace(runtime::grid_of(cell), cell.merge);
  value_or_throw(workspace.add(live, 1), cell.file.string() + ": objects: ");
  return std::move(workspace).take();
}

}  // namespace phantom::phantom_sensing
