// What SkinSensing does apart from the tick: its memory, fingers, muted objects.
#include <Eigen/Geometry>
#include <algorithm>

#include "common/robot/sensing/skin_sensing_parts.hpp"

namespace phantom::robot {
namespace {

/// Size of the part that a thread takes at a time: some microseconds of work. Each part is summed, and the
/// parts are added up, in a fixed order, whichever thread takes them.
constexpr std::size_t kPointsOfPart = 16 * kernel::kBlock, kClustersOfPart = 32;

}  // namespace

std::vector<SkinSensing::Part> SkinSensing::parts_of(const SkinLayout& layout) {
  std::vector<Part> parts;
  std::size_t packed = 0;
  const auto cut = [&parts](std::size_t link, bool clusters, std::size_t first, std::size_t end,
                            std::size_t most) {
    for (; first < end; first += most)
      parts.push_back({link, first, std::min(first + most, end), clusters, {}});
  };
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t points = kernel::whole_groups(layout.first_cluster[link] - layout.first[link]);
    cut(link, false, packed, packed + points, kPointsOfPart);
    packed += points;
    cut(link, true, layout.first_cluster[link], layout.first[link + 1], kClustersOfPart);
  }
  return parts;
}

SkinSensing::SkinSensing(const SkinLayout& layout, const SensingOptions& options)
    : open_(layout),
      layout_(&layout),
      options_(options),
      cluster_codes_(layout.size()),
      neighbourhood_(make_neighbourhood(options.gradient_reach_vox)),
      parts_(parts_of(layout)),
      team_(std::min(std::max<std::size_t>(options.threads, 1), std::max<std::size_t>(parts_.size(), 1))),
      medium_(layout, options.medium) {
  for (const ClusterSpec& kind : layout.clusters) stencils_.emplace_back(kind, layout.voxel_stretch);
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    packed_first_[link] = x_m_.size();
    for (std::size_t i = layout.first[link]; i < layout.first_cluster[link]; ++i) {
      x_m_.push_back(layout.x_m[i]);
      y_m_.push_back(layout.y_m[i]);
      z_m_.push_back(layout.z_m[i]);
      weight_.push_back(layout.weight[i]);
    }
    const std::size_t packed = kernel::whole_groups(x_m_.size());
    x_m_.resize(packed, 0.0);
    y_m_.resize(packed, 0.0);
    z_m_.resize(packed, 0.0);
    weight_.resize(packed, 0.0);
  }
  packed_first_.back() = x_m_.size();
  for (auto* steps : {&x_steps_, &y_steps_, &z_steps_}) steps->resize(x_m_.size());
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t packed = packed_first_[link];
    const std::size_t sensors = layout.first_cluster[link] - layout.first[link];
    first_block_[link] = blocks_.size();
    for (std::size_t first = 0; first < sensors; first += kernel::kBlock) {
      const MovingBlock block{blocks_.size(), packed + first, std::min(kernel::kBlock, sensors - first)};
      blocks_.emplace_back();
      measure(block);
      const auto moves = [&](const Eigen::Vector3d& way_m) { return !way_m.isZero(0.0); };
      const auto way = layout.closing_m.begin() + static_cast<std::ptrdiff_t>(layout.first[link] + first);
      if (!layout.closing_m.empty() &&
          std::any_of(way, way + static_cast<std::ptrdiff_t>(block.sensors), moves))
        moving_blocks_.push_back(block);
    }
  }
  for (std::size_t i = 0; i < layout.closing_m.size(); ++i)
    if (!layout.closing_m[i].isZero(0.0)) moving_.push_back(i);
  if (!moving_.empty()) layout_ = &moved_.emplace(layout);
  enclose(layout);
  for (std::size_t k = 0; k < std::min(options.moving_fluids, kMaxFluids); ++k) {
    SensingOptions alone = options;
    alone.threads = 1;
    alone.moving_fluids = 0;
    alone.medium = {};
    alone.memory.clear();
    in_fluids_.push_back(std::make_unique<SkinSensing>(layout, alone));
  }
  fluid_sums_.resize(in_fluids_.size());
  codes_.resize(x_m_.size());
  mu_.resize(x_m_.size());
  block_worst_.resize(blocks_.size());
  block_fast_.resize(blocks_.size());
  if (!options.memory.empty()) {
    memory_.emplace(x_m_.size(), options.memory);
    voxels_.resize(x_m_.size());
  }
}

SkinSensing::~SkinSensing() = default;

/// Finds a ball about each link's sensors, wherever its fingers are.
void SkinSensing::enclose(const SkinLayout& layout) noexcept {
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    middle_m_[link] = Eigen::Vector3d::Zero();
    const std::size_t count = layout.first[link + 1] - layout.first[link];
    for (std::size_t i = layout.first[link]; i < layout.first[link + 1]; ++i)
      middle_m_[link] += layout.position(i, 0.5) / static_cast<double>(count);
    radius_m_[link] = 0.0;
    for (std::size_t i = layout.first[link]; i < layout.first[link + 1]; ++i)
      for (const double closed : {0.0, 1.0})
        radius_m_[link] = std::max(radius_m_[link], (layout.position(i, closed) - middle_m_[link]).norm());
  }
}

void SkinSensing::measure(const MovingBlock& at) noexcept {
  kernel::measure_blocks(points_of(at.first, at.first + kernel::whole_groups(at.sensors)), at.sensors,
                         &blocks_[at.block], &x_steps_[at.first], &y_steps_[at.first], &z_steps_[at.first]);
}

void SkinSensing::close_gripper(double share) noexcept {
  if (moving_.empty() || share == closed_) return;
  closed_ = share;
  for (const auto& fluid : in_fluids_) fluid->close_gripper(share);
  for (const std::size_t i : moving_) {
    const Eigen::Vector3d at_m = open_.position(i, share);
    moved_->x_m[i] = at_m.x();
    moved_->y_m[i] = at_m.y();
    moved_->z_m[i] = at_m.z();
    const std::size_t link = open_.link_of(i);
    if (i >= open_.first_cluster[link]) continue;
    const std::size_t packed = packed_first_[link] + (i - open_.first[link]);
    x_m_[packed] = at_m.x();
    y_m_[packed] = at_m.y();
    z_m_[packed] = at_m.z();
  }
  for (const MovingBlock& block : moving_blocks_) measure(block);
}

bool SkinSensing::mute(std::size_t link, std::uint16_t object, bool muted) noexcept {
  if (link >= muted_objects_.size()) return false;
  for (const auto& fluid : in_fluids_) fluid->mute(link, object, muted);
  MutedObjects& list = muted_objects_[link];
  if (list.has(object) == muted) return true;
  if (muted) {
    if (list.count == kMaxMuted) return false;
    list.object[list.count++] = object;
  } else {
    *std::find(list.object.begin(), list.object.end(), object) = list.object[list.count - 1];
    --list.count;
  }
  return true;
}

void SkinSensing::forget() noexcept {
  if (memory_) memory_->forget();
}

void SkinSensing::continue_from(const SkinSensing& before, const SkinLayout& own) noexcept {
  if (!memory_ || !before.memory_) return;
  memory_->forget();
  for (std::size_t link = 0; link <= core::kMaxJoints; ++link) {
    const std::size_t points = own.first_cluster[link] - own.first[link];
    if (points == 0) continue;
    memory_->take_over(packed_first_[link], *before.memory_, before.packed_first_[link], points);
  }
}

}  // namespace phantom::robot
