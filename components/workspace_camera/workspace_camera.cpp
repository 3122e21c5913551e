#include "components/workspace_camera/workspace_camera.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/core/errors.hpp"
#include "common/fusion/fused_block.hpp"
#include "common/fusion/space_ages.hpp"
#include "common/runtime/cell/cell_names.hpp"

namespace phantom::workspace_camera {
namespace {

using messages::DepthCameraState;
using workspace::Index3;
using workspace::VoxelBox;

fusion::Fusion fusion_or_throw(const WorkspaceCameraConfig& config, const workspace::GridSpec& grid) {
  fusion::FusionParameters parameters = config.fusion;
  parameters.grid = grid;
  const Eigen::Vector3d end_m = grid.corner_of({grid.size_vox[0], grid.size_vox[1], grid.size_vox[2]});
  const auto voxel_at = [&](const Eigen::Vector3d& p_m) {
    return grid.index_of(p_m.cwiseMax(grid.origin_m).cwiseMin(end_m));
  };
  for (const UnknownRegionConfig& region : config.unknown_regions)
    parameters.unknown_regions.push_back(
        {VoxelBox::between(voxel_at(region.min_m), voxel_at(region.max_m)), region.policy});
  auto made = fusion::Fusion::create(parameters);
  if (!made) throw core::ConfigError("the cell cannot be fused: " + made.status().message());
  return std::move(made).value();
}

}  // namespace

WorkspaceCamera::WorkspaceCamera(const WorkspaceCameraConfig& config, std::string source, std::string cell,
                                 const workspace::GridSpec& grid, ArmView* arm, const ArmHistory& history)
    : config_(config),
      source_(std::move(source)),
      cell_(std::move(cell)),
      arm_(arm),
      history_(history),
      fusion_(fusion_or_throw(config, grid)),
      blocks_(fusion::blocks_of(grid)),
      occupied_(blocks_.voxel_count()) {
  for (const CameraConfig& camera : config.cameras) {
    View view{camera, CameraWatch(camera.name, config.late_s, config.dead_s)};
    if (!camera.link.empty()) {
      const auto frame = arm != nullptr ? arm->arm().find_frame(camera.link) : std::nullopt;
      if (!frame)
        throw core::ConfigError(camera.place + ".link: '" + camera.link +
                                "' is no link of the arm; allowed: " +
                                (arm != nullptr ? runtime::links_of(arm->arm()) + ", or " : "") +
                                "\"\" for a camera that is fixed in the cell");
      view.link = frame->first;
      view.X_LF = frame->second;
    }
    views_.push_back(std::move(view));
  }
}

core::Status WorkspaceCamera::refuse(core::Status why) {
  ++refused_;
  why_refused_ = why.message();
  return why;
}

geometry::Pose WorkspaceCamera::pose_of(const View& view, const ArmPose* pose) const {
  if (view.config.link.empty() || pose == nullptr) return view.config.X_FC;
  robot::LinkPoses X_WL;
  arm_->arm().link_poses(pose->q, X_WL);
  return X_WL[view.link] * view.X_LF * view.config.X_FC;
}

core::Status WorkspaceCamera::take(const CameraImage& image, core::Nanoseconds now_ns) {
  View& view = views_.at(image.camera);
  std::optional<ArmPose> pose;
  if (arm_ != nullptr) pose = history_.at(image.exposed_ns);
  const fusion::DepthHeader header{image.pinhole, pose_of(view, pose ? &*pose : nullptr),
                                   std::max(0.0, core::seconds(image.exposed_ns))};
  if (core::Status loaded = image_.load_mm(header, image.depth_mm); !loaded) {
    refused_ns_ = now_ns;
    return refuse(loaded);
  }
  // An image that is not fused does not count as one: what is published rests on older ones.
  if (arm_ != nullptr && !pose) {
    refused_ns_ = now_ns;
    return refuse(core::Status(core::ErrorCode::kUnavailable,
                               "slave_state does not come: images are not fused, as the arm in them would be "
                               "taken for matter"));
  }
  const bool may_repeat = view.config.driver == CameraDriver::kFiles;
  if (!view.watch.put(image.exposed_ns, image.depth_mm, may_repeat)) {
    refused_ns_ = now_ns;
    return refuse(core::Status::invalid_argument("camera '" + view.config.name +
                                                 "' sends the same image again; allowed: a new one"));
  }
  arm_depth_m_.clear();
  if (pose) arm_->draw(*pose, image_.camera(), image_.X_WC(), arm_depth_m_);
  report_ = fusion_.integrate(image_, arm_depth_m_);
  view.watch.fused(now_ns);
  const VoxelBox seen = box_seen(image_.camera(), image_.X_WC());
  view.seen = view.seen ? view.seen->hull(seen) : seen;
  exposed_ns_ = std::max(exposed_ns_, image.exposed_ns);
  ++fused_;
  return core::Status::ok();
}

/// Returns the voxels that may be in the image.
VoxelBox WorkspaceCamera::box_seen(const fusion::PinholeCamera& camera, const geometry::Pose& X_WC) const {
  const workspace::GridSpec& grid = fusion_.grid();
  Eigen::Vector3d low = grid.to_voxels(X_WC.translation_m), high = low;
  for (const double u : {0.0, camera.width_px - 1.0}) {
    for (const double v : {0.0, camera.height_px - 1.0}) {
      const Eigen::Vector3d corner = grid.to_voxels(X_WC * (camera.max_depth_m * camera.direction(u, v)));
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const auto index = [](const Eigen::Vector3d& p) {
    return Index3{static_cast<std::int32_t>(p.x()), static_cast<std::int32_t>(p.y()),
                  static_cast<std::int32_t>(p.z())};
  };
  const Eigen::Vector3d size = Eigen::Vector3d(grid.size_vox[0], grid.size_vox[1], grid.size_vox[2]);
  low = low.cwiseMax(0.0).cwiseMin(size);
  high = (high.array() + 1.0).matrix().cwiseMax(0.0).cwiseMin(size);
  return VoxelBox::between(index(low), index(high));
}

bool WorkspaceCamera::watch(core::Nanoseconds now_ns) {
  bool changed = false;
  for (View& view : views_) {
    const DepthCameraState state = view.watch.state(now_ns);
    if (state == view.state) continue;
    changed = true;
    view.state = state;
    if (state != DepthCameraState::kDead || config_.on_loss == OnLoss::kKeep || !view.seen) continue;
    fusion_.forget(*view.seen);
    view.seen.reset();
  }
  return changed;
}

messages::OccupancyBlock WorkspaceCamera::block_at(Index3 block) const {
  messages::OccupancyBlock made{static_cast<std::uint16_t>(block.x), static_cast<std::uint16_t>(block.y),
                                static_cast<std::uint16_t>(block.z)};
  const workspace::BitVolume& bits = fusion_.occupied();
  const Index3 first = fusion::kBlockEdge * block;
  const auto& size = fusion_.grid().size_vox;
  for (std::int32_t z = 0; z < std::min(fusion::kBlockEdge, size[2] - first.z); ++z)
    for (std::int32_t y = 0; y < std::min(fusion::kBlockEdge, size[1] - first.y); ++y)
      made.bits[static_cast<std::size_t>(z)] |=
          (bits.row(first.y + y, first.z + z)[first.x >> 6] >> (first.x & 63) & 0xFF) << (8 * y);
  return made;
}

messages::OccupancyChange WorkspaceCamera::change(bool whole, core::Nanoseconds now_ns) {
  messages::OccupancyChange change;
  change.source = source_;
  change.cell = cell_;
  change.grid = fusion_.grid();
  change.whole = whole;
  if (exposed_ns_ != 0) change.image_age_s = std::max(0.0, core::seconds(now_ns - exposed_ns_));
  exposed_ns_ = 0;
  const auto is_occupied = [](const messages::OccupancyBlock& block) {
    return std::ranges::any_of(block.bits, [](std::uint64_t word) { return word != 0; });
  };
  for (const Index3 place : fusion_.changed_blocks()) {
    const messages::OccupancyBlock block = block_at(place);
    occupied_[blocks_.index(place)] = is_occupied(block) ? 1 : 0;
    if (!whole) change.blocks.push_back(block);
  }
  fusion_.clear_changes();
  if (whole)
    blocks_.for_each([&](Index3 place) {
      if (occupied_[blocks_.index(place)] != 0) change.blocks.push_back(block_at(place));
    });
  // No more than that has content at a time; matter beyond it would be of blocks that lost theirs.
  if (change.blocks.size() > messages::kMaxOccupancyBlocks)
    change.blocks.resize(messages::kMaxOccupancyBlocks);
  for (const View& view : views_) change.cameras.push_back(view.watch.health(now_ns));
  return change;
}

messages::SpaceView WorkspaceCamera::space_view(core::Nanoseconds now_ns) const {
  std::vector<std::uint8_t> own(blocks_.voxel_count());
  if (const auto pose = arm_ != nullptr ? history_.at(history_.newest_ns()) : std::nullopt)
    arm_->mark_own(*pose, fusion_.grid(), config_.fusion.masks.arm_margin_m, own);
  const fusion::SpaceAges ages =
      fusion::space_ages(fusion_, core::seconds(now_ns), messages::kMaxSpaceCubes, own);
  messages::SpaceView view;
  view.source = source_;
  view.cell = cell_;
  view.origin_m = messages::vector_of(fusion_.grid().origin_m);
  view.cube_m = ages.cube_vox * fusion_.grid().voxel_size_m.reference_m();
  view.size_x = static_cast<std::uint16_t>(ages.cubes.size[0]);
  view.size_y = static_cast<std::uint16_t>(ages.cubes.size[1]);
  view.size_z = static_cast<std::uint16_t>(ages.cubes.size[2]);
  view.ages.reserve(ages.ages_s.size());
  for (const double age_s : ages.ages_s)
    view.ages.push_back(age_s == fusion::SpaceAges::kNever
                            ? messages::kSpaceNeverSeen
                            : static_cast<std::uint8_t>(std::min<double>(
                                  messages::kSpaceAgeMax, std::ceil(age_s / messages::kSpaceAgeStep_s))));
  return view;
}

core::Health WorkspaceCamera::health(core::Nanoseconds now_ns) const {
  core::Health health{core::ComponentState::kRunning, "", {}, {}};
  std::string troubles;
  for (const View& view : views_) {
    const messages::DepthCameraHealth camera = view.watch.health(now_ns);
    health.figures.push_back({"age " + camera.name, camera.age_s, "s"});
    health.figures.push_back({"rate " + camera.name, camera.rate_hz, "Hz"});
    if (camera.state == DepthCameraState::kLive) continue;
    const bool ends = camera.state == DepthCameraState::kDead && config_.on_loss == OnLoss::kEnd;
    troubles += fmt::format("{}camera '{}' is {}{}", troubles.empty() ? "" : "; ", camera.name,
                            name_of(camera.state), ends ? ": its matter has ended" : "");
  }
  if (refused_ns_ != 0 && now_ns - refused_ns_ < core::kNsPerSecond)
    troubles += (troubles.empty() ? "" : "; ") + why_refused_;
  if (report_.refused > 0)
    troubles += fmt::format("{}{} blocks found no memory (fusion.max_blocks): new matter there is not seen",
                            troubles.empty() ? "" : "; ", report_.refused);
  if (!troubles.empty()) health.state = core::ComponentState::kDegraded;
  health.message = troubles.empty() ? fmt::format("images of {} camera{} are fused", views_.size(),
                                                  views_.size() == 1 ? "" : "s")
                                    : troubles;
  const auto figure = [&](const char* name, auto value, const char* unit) {
    health.figures.push_back({name, static_cast<double>(value), unit});
  };
  figure("images", fused_, "");
  figure("refused_images", refused_, "");
  figure("blocks", report_.blocks, "");
  return health;
}

}  // namespace phantom::workspace_camera
