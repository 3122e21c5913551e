#include "common/robot/sensing/skin_patches.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace phantom::robot {

SkinPatches::SkinPatches(const SerialArm& arm, const SkinLayout& layout, double voxel_m)
    : arm_(arm), layout_(layout) {
  for (const ClusterSpec& spec : layout.clusters) stencils_.emplace_back(spec, layout.voxel_stretch);
  double edge_m = std::min(0.02, 4.0 * voxel_m);
  while (!divide(edge_m)) edge_m *= 1.25;
  worst_.resize(patches_.size());
}

/// Returns false if there are too many patches.
bool SkinPatches::divide(double edge_m) {
  edge_m_ = edge_m;
  patches_.clear();
  patch_of_.assign(layout_.size(), 0);
  std::map<std::array<int, 4>, std::uint16_t> known;  // by link and cube
  std::vector<double> members;
  for (std::size_t link = 0; link < arm_.links().size(); ++link) {
    for (std::size_t sensor = layout_.first[link]; sensor < layout_.first[link + 1]; ++sensor) {
      const Eigen::Vector3d p_L_m = layout_.position(sensor);
      const Eigen::Vector3d cube = (p_L_m / edge_m).array().floor();
      const auto [found, fresh] = known.try_emplace({static_cast<int>(link), static_cast<int>(cube.x()),
                                                     static_cast<int>(cube.y()), static_cast<int>(cube.z())},
                                                    static_cast<std::uint16_t>(patches_.size()));
      if (fresh) {
        if (patches_.size() == kMax) return false;
        patches_.push_back({link});
        members.push_back(0.0);
      }
      patches_[found->second].middle_m += p_L_m;
      members[found->second] += 1.0;
      patch_of_[sensor] = found->second;
    }
  }
  for (std::size_t i = 0; i < patches_.size(); ++i) patches_[i].middle_m /= members[i];
  return true;
}

/// Returns the code that a sensor meets: at its voxel or, for a cluster sensor, the greatest in its zone.
std::uint8_t SkinPatches::code_of(std::size_t sensor, std::size_t link, workspace::Index3 at,
                                  const workspace::Workspace& workspace, const Muted& muted) const {
  const auto felt = [&](workspace::Index3 voxel) {
    const std::uint8_t code = workspace.mu_code(voxel);
    return code != 0 && muted && muted(link, workspace.object(voxel)) ? std::uint8_t{0} : code;
  };
  const std::uint8_t kind = layout_.cluster_kind[sensor];
  if (kind == 0) return felt(at);
  std::uint8_t greatest = 0;
  stencils_[kind - std::size_t{1}].for_each(
      at, [&](workspace::Index3 voxel, double) { greatest = std::max(greatest, felt(voxel)); });
  return greatest;
}

const std::vector<SkinPatches::Patch>& SkinPatches::sense(const core::JointArray& position,
                                                          const workspace::Workspace& workspace,
                                                          const Muted& muted, double closed) {
  LinkPoses X_WL;
  arm_.link_poses(position, X_WL);
  std::fill(worst_.begin(), worst_.end(), std::uint8_t{0});
  const workspace::GridSpec& grid = workspace.grid();
  for (std::size_t link = 1; link < arm_.links().size(); ++link) {
    for (std::size_t sensor = layout_.first[link]; sensor < layout_.first[link + 1]; ++sensor) {
      const Eigen::Vector3d p_W_m = X_WL[link] * layout_.position(sensor, closed);
      if (!((p_W_m - grid.origin_m).cwiseAbs().maxCoeff() < 1e9 * grid.voxel_size_m.reference_m())) continue;
      std::uint8_t& worst = worst_[patch_of_[sensor]];
      worst = std::max(worst, code_of(sensor, link, grid.index_of(p_W_m), workspace, muted));
    }
  }
  felt_.clear();
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    if (worst_[i] == 0) continue;
    felt_.push_back(patches_[i]);
    felt_.back().mu = workspace.palette()[worst_[i]];
  }
  return felt_;
}

}  // namespace phantom::robot
