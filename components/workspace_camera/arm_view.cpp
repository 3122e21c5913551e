#include "components/workspace_camera/arm_view.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/fusion/fused_block.hpp"
#include "components/workspace_camera/depth_raster.hpp"

namespace phantom::workspace_camera {
namespace {

std::vector<LinkPart> load_parts(const robot::SerialArm& arm, const std::optional<robot::SerialArm>& closed) {
  std::vector<LinkPart> parts;
  for (std::size_t link = 0; link < arm.links().size(); ++link) {
    const auto& meshes = arm.links()[link].meshes;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      auto mesh = robot::load_mesh(meshes[i]);
      if (!mesh && mesh.status().code() == core::ErrorCode::kNotFound)
        throw core::MissingError(mesh.status().message());
      if (!mesh) throw core::ConfigError(mesh.status().message());
      LinkPart part{link, meshes[i].X_link_mesh, std::move(mesh).value()};
      if (closed)
        part.closing_m = closed->links()[link].meshes[i].X_link_mesh.translation_m - part.X_LM.translation_m;
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

/// Puts a depth where it is the least.
void put(float& pixel_m, float depth_m) {
  if (pixel_m == 0.0F || depth_m < pixel_m) pixel_m = depth_m;
}

}  // namespace

void ArmHistory::put(core::Nanoseconds at_ns, const core::JointArray& q) {
  const std::lock_guard lock(mutex_);
  if (count_ > 0 && at_ns <= entries_[(count_ - 1) % kEntries].at_ns) return;
  entries_[count_++ % kEntries] = {at_ns, q};
}

void ArmHistory::set_closing(double share) {
  const std::lock_guard lock(mutex_);
  closing_ = std::clamp(share, 0.0, 1.0);
}

core::Nanoseconds ArmHistory::newest_ns() const {
  const std::lock_guard lock(mutex_);
  return count_ == 0 ? 0 : entries_[(count_ - 1) % kEntries].at_ns;
}

std::optional<ArmPose> ArmHistory::at(core::Nanoseconds time_ns) const {
  const std::lock_guard lock(mutex_);
  const std::size_t first = count_ > kEntries ? count_ - kEntries : 0;
  std::size_t low = first, high = count_;  // the first entry that is not before the time
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (entries_[middle % kEntries].at_ns < time_ns) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == count_) {
    if (count_ == 0) return std::nullopt;
    const Entry& newest = entries_[(count_ - 1) % kEntries];
    if (time_ns - newest.at_ns > kAhead_ns) return std::nullopt;
    return ArmPose{newest.q, closing_};
  }
  const Entry& after = entries_[low % kEntries];
  if (low == first) {
    if (after.at_ns != time_ns) return std::nullopt;
    return ArmPose{after.q, closing_};
  }
  const Entry& before = entries_[(low - 1) % kEntries];
  if (after.at_ns - before.at_ns > kGap_ns) return std::nullopt;
  const double share =
      static_cast<double>(time_ns - before.at_ns) / static_cast<double>(after.at_ns - before.at_ns);
  ArmPose pose{before.q, closing_};
  for (std::size_t j = 0; j < pose.q.size(); ++j) pose.q[j] += share * (after.q[j] - before.q[j]);
  return pose;
}

ArmView::ArmView(robot::SerialArm arm, const std::optional<robot::SerialArm>& closed, robot::SkinLayout skin,
                 double skin_pitch_m)
    : arm_(std::move(arm)),
      parts_(load_parts(arm_, closed)),
      skin_(std::move(skin)),
      skin_radius_m_(1.5 * skin_pitch_m) {}

geometry::Pose ArmView::pose_of(const LinkPart& part, const robot::LinkPoses& X_WL, double closing) {
  geometry::Pose X_LM = part.X_LM;
  X_LM.translation_m += closing * part.closing_m;
  return X_WL[part.link] * X_LM;
}

void ArmView::draw(const ArmPose& pose, const fusion::PinholeCamera& camera, const geometry::Pose& X_WC,
                   std::vector<float>& depth_m) {
  depth_m.assign(camera.pixels(), 0.0F);
  robot::LinkPoses X_WL;
  arm_.link_poses(pose.q, X_WL);
  const geometry::Pose X_CW = X_WC.inverse();
  for (const auto* parts : {&parts_, &carried_})
    for (const LinkPart& part : *parts)
      draw_mesh(
          part.mesh, X_CW * pose_of(part, X_WL, pose.closing), camera, corners_m_,
          [&](std::size_t pixel, double at_m, double) { put(depth_m[pixel], static_cast<float>(at_m)); });
  // The skin as small discs: an arm without meshes is masked by it alone.
  for (std::size_t link = 0; link < arm_.links().size(); ++link) {
    const geometry::Pose X_CL = X_CW * X_WL[link];
    for (std::size_t i = skin_.first[link]; i < skin_.first[link + 1]; ++i) {
      const Eigen::Vector3d p = X_CL * skin_.position(i, pose.closing);
      if (p.z() < kNearest_m || p.z() > camera.max_depth_m) continue;
      const double u = camera.fx_px * p.x() / p.z() + camera.cx_px,
                   v = camera.fy_px * p.y() / p.z() + camera.cy_px;
      const double radius_px = std::min(camera.fx_px * skin_radius_m_ / p.z(), 64.0);
      const auto from = [radius_px](double middle) {
        return static_cast<int>(std::max(0.0, std::ceil(middle - radius_px)));
      };
      const auto to = [radius_px](double middle, int size) {
        return static_cast<int>(std::min(size - 1.0, std::floor(middle + radius_px)));
      };
      if (u + radius_px < 0.0 || v + radius_px < 0.0 || u - radius_px > camera.width_px ||
          v - radius_px > camera.height_px)
        continue;
      for (int y = from(v); y <= to(v, camera.height_px); ++y)
        for (int x = from(u); x <= to(u, camera.width_px); ++x)
          put(depth_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) +
                      static_cast<std::size_t>(x)],
              static_cast<float>(p.z()));
    }
  }
}

void ArmView::mark_own(const ArmPose& pose, const workspace::GridSpec& grid, double margin_m,
                       std::span<std::uint8_t> own) const {
  const workspace::VoxelBox blocks = fusion::blocks_of(grid);
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(margin_m);
  const auto mark = [&](const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m) {
    const auto block_at = [&](const Eigen::Vector3d& p_m) { return fusion::block_of(grid.index_of(p_m)); };
    workspace::VoxelBox::between(block_at(low_m - margin),
                                 block_at(high_m + margin) + workspace::Index3{1, 1, 1})
        .intersection(blocks)
        .for_each([&](workspace::Index3 block) { own[blocks.index(block)] = 1; });
  };
  robot::LinkPoses X_WL;
  arm_.link_poses(pose.q, X_WL);
  for (std::size_t link = 0; link < arm_.links().size(); ++link) {
    for (std::size_t i = skin_.first[link]; i < skin_.first[link + 1]; ++i) {
      const Eigen::Vector3d p = X_WL[link] * skin_.position(i, pose.closing);
      mark(p, p);
    }
  }
  for (const LinkPart& part : carried_) {
    const geometry::BoundingBox box = part.mesh.transformed(pose_of(part, X_WL, pose.closing)).bounding_box();
    mark(box.min_m.cast<double>(), box.max_m.cast<double>());
  }
}

}  // namespace phantom::workspace_camera
