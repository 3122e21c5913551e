#include "components/phantom_sensing/other_arms.hpp"

#include <algorithm>
#include <set>

#include "common/core/errors.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/percept/closeness.hpp"
#include "common/robot/kinematics/joint_values.hpp"
#include "common/robot/kinematics/link_mesh.hpp"
#include "common/runtime/cell/arm_model.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::ConfigError;

/// Activates what is seen of a link in the link's own frame; an empty workspace if that is nothing.
workspace::Workspace activate(const robot::Link& link, const runtime::CellConfig& cell, std::uint16_t id,
                              const std::string& place) {
  std::vector<layers::Body> bodies;
  geometry::BoundingBox box;
  for (const robot::LinkMesh& seen : link.meshes) {
    auto mesh = robot::load_mesh(seen);
    if (!mesh) throw ConfigError(place + mesh.status().message());
    layers::Body& body = bodies.emplace_back();
    body.name = link.name;
    body.id = static_cast<std::uint16_t>(bodies.size());
    body.mesh_W = mesh->transformed(seen.X_link_mesh);
    body.profile = cell.profile;
    box.extend(body.mesh_W.bounding_box().min_m);
    box.extend(body.mesh_W.bounding_box().max_m);
  }
  if (bodies.empty()) return {};
  const Eigen::Vector3d beyond_m = (cell.profile.reach_vox() + 2) * cell.voxel_size_m.sides_m();
  layers::LiveWorkspace live(layers::grid_over(box.min_m.cast<double>() - beyond_m,
                                               box.max_m.cast<double>() + beyond_m, cell.voxel_size_m),
                             layers::MergeLaw::kHighestViscosity);
  std::vector<layers::LiveBody> all;
  for (const layers::Body& body : bodies) all.push_back({&body, 0});
  if (const auto added = live.add(all, 1); !added) throw ConfigError(place + added.status().message());
  workspace::Workspace fluid = std::move(live).take();
  for (const workspace::BrickKey key : fluid.bricks()) {  // its parts are one object
    const auto brick = fluid.edit_brick(key);
    for (std::uint32_t i = 0; i < workspace::kBrickVoxels; ++i)
      if (brick.object[i] != 0) brick.object[i] = id;
  }
  return fluid;
}

}  // namespace

OtherArm::OtherArm(std::string name, std::string partition, std::uint16_t id, robot::SerialArm arm,
                   std::vector<workspace::Workspace> fluids)
    : name_(std::move(name)), partition_(std::move(partition)), id_(id), arm_(std::move(arm)) {
  for (std::size_t link = 0; link < fluids.size(); ++link) {
    if (fluids[link].brick_count() == 0) continue;
    const double greatest = percept::greatest_neighbour_mu(fluids[link]);
    links_.push_back({link, std::move(fluids[link]), greatest});
  }
}

void OtherArm::put(const core::JointArray& position, const core::JointArray& velocity,
                   std::span<OtherLink> links) const noexcept {
  robot::LinkPoses X_WL;
  arm_.link_poses(position, X_WL);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link& link = links_[i];
    const robot::PlaceVelocity moves(arm_, link.index, X_WL, velocity);
    links[i] = {&link.fluid, link.greatest_neighbour_mu, X_WL[link.index], moves.origin_W_m_s,
                moves.angular_W_rad_s};
  }
}

std::vector<OtherArm> load_other_arms(const runtime::CellConfig& cell, const Config& config) {
  std::vector<OtherArm> others;
  std::set<std::string> names{cell.arm(config.arm).name};
  for (const OtherArmConfig& other : config.other_arms) {
    const std::string place = config.file.string() + ": other_arms: '" + other.arm + "': ";
    if (!names.insert(other.arm).second)
      throw ConfigError(place + "is this arm, or stands twice; allowed: other arms of the cell, each once");
    const runtime::ArmConfig& arm_config = cell.arm(other.arm);
    robot::SerialArm arm = runtime::load_arm(arm_config);
    const auto id = static_cast<std::uint16_t>(OtherArm::kFirstId + others.size());
    std::vector<workspace::Workspace> fluids;
    for (const robot::Link& link : arm.links()) fluids.push_back(activate(link, cell, id, place));
    others.emplace_back(other.arm, other.partition, id, std::move(arm), std::move(fluids));
    if (others.back().link_count() == 0)
      throw ConfigError(place + "nothing is seen of its links; allowed: an arm by a URDF with visuals");
  }
  if (links_of(others) > kMaxOtherLinks)
    throw ConfigError(config.file.string() + ": other_arms: have " + std::to_string(links_of(others)) +
                      " links in all; allowed: " + std::to_string(kMaxOtherLinks));
  return others;
}

std::size_t links_of(const std::vector<OtherArm>& others) {
  std::size_t links = 0;
  for (const OtherArm& other : others) links += other.link_count();
  return links;
}

}  // namespace phantom::phantom_sensing
