#include "common/fusion/fusion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace phantom::fusion {
namespace {

using workspace::Index3;

/// From a block's centre to the centre of its farthest voxel, in voxels.
const double kBlockRadius_vox = 3.5 * std::sqrt(3.0);
/// One of so many blocks without content is looked at in a frame.
constexpr std::size_t kFreeTurns = 8;
/// One of so many of these, if the camera may see a part of it, is looked at voxel by voxel.
constexpr std::size_t kPartTurns = 2;
/// A block that was fused so often is fused in one of so many frames while nothing changes there.
constexpr std::uint8_t kMature = 64;
constexpr std::uint32_t kQuietTurns = 4;
/// Cells of the image count as changed at this part of what resets a voxel.
constexpr double kCellTolerance = 0.5;
/// One of so many rows is searched for new blocks in a frame.
constexpr std::uint32_t kRowTurns = 2;

bool all_set(const BlockBits& bits) {
  return std::all_of(bits.begin(), bits.end(), [](std::uint64_t word) { return word == ~std::uint64_t{0}; });
}
bool none_set(const BlockBits& bits) {
  return std::all_of(bits.begin(), bits.end(), [](std::uint64_t word) { return word == 0; });
}

/// Returns whether at least a quarter of a block's voxels was seen.
bool shows_a_quarter(const BlockBits& observed) {
  int seen = 0;
  for (const std::uint64_t word : observed) seen += std::popcount(word);
  return 4 * seen >= static_cast<int>(kBlockVoxels);
}

/// Returns whether no surface is near any voxel that is known.
bool holds_no_surface(const FusedBlock& block, double truncation_vox) {
  const auto saturated =
      static_cast<int>(static_cast<double>(detail::kSaturated) * truncation_vox * kDistanceSteps);
  for (std::size_t i = 0; i < kBlockVoxels; ++i) {
    if (block.weight[i] > 0 && block.distance[i] < saturated) return false;
  }
  return true;
}

}  // namespace

core::Expected<Fusion> Fusion::create(const FusionParameters& parameters) {
  if (core::Status checked = check_parameters(parameters); !checked) return checked;
  return Fusion(parameters);
}

Fusion::Fusion(const FusionParameters& parameters)
    : parameters_(parameters),
      pool_(std::make_unique<BlockPool>(parameters.grid, parameters.max_blocks)),
      gate_(std::make_unique<ChangeGate>(parameters.grid, *pool_, parameters.min_component_vox)),
      policies_(pool_->box().voxel_count(), parameters.unknown),
      seen_free_(policies_.size()),
      seen_at_(policies_.size()),
      view_(std::make_unique<detail::FrameView>()) {
  for (std::size_t place = 0; place < policies_.size(); ++place) {
    const Index3 block = pool_->block_at(place), centre = kBlockEdge * block + Index3{4, 4, 4};
    for (const UnknownRegion& region : parameters_.unknown_regions) {
      if (region.box.contains(centre)) policies_[place] = region.policy;
    }
    if (policies_[place] == UnknownPolicy::kOccupied) gate_->set_block(block, true);
  }
}

void Fusion::set_view(const DepthImage& image) {
  const double voxel_m = parameters_.grid.voxel_size_m.reference_m();
  camera_ = image.camera();
  const geometry::Pose X_CW = image.X_WC().inverse();
  const Eigen::Vector3d& origin_m = parameters_.grid.origin_m;
  first_voxel_ = (X_CW * (origin_m + Eigen::Vector3d::Constant(0.5 * voxel_m))) / voxel_m;
  step_ = double{kBlockEdge} * X_CW.rotation;
  centre_ = X_CW.rotation * Eigen::Vector3d::Constant(3.5);

  detail::FrameView& view = *view_;
  view.depth = depth_.fused_vox().data();
  view.width = depth_.width();
  view.height = depth_.height();
  view.min_z = static_cast<float>(std::max(1.0, camera_.min_depth_m / voxel_m - parameters_.truncation_vox));
  view.rules = {
      static_cast<float>(parameters_.truncation_vox), static_cast<float>(parameters_.hysteresis_vox),
      static_cast<float>(parameters_.shell_vox),      static_cast<float>(parameters_.sigma.at_1m_m * voxel_m),
      static_cast<float>(parameters_.surprise_vox),   static_cast<float>(parameters_.surprise_sigmas),
      static_cast<float>(parameters_.max_weight),     static_cast<float>(parameters_.decision_sigma_vox)};
  std::size_t i = 0;
  voxels_of({}).for_each([&](Index3 v) {
    const Eigen::Vector3d p = X_CW.rotation * workspace::vector(v);
    view.du[i] = static_cast<float>(camera_.fx_px * p.x() + camera_.cx_px * p.z());
    view.dv[i] = static_cast<float>(camera_.fy_px * p.y() + camera_.cy_px * p.z());
    view.dz[i++] = static_cast<float>(p.z());
  });

  const Eigen::Vector3d eye = (image.X_WC().translation_m - origin_m) / (voxel_m * kBlockEdge);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    rays_.eye[at] = static_cast<float>(eye[axis]);
    rays_.along_x[at] = static_cast<float>(image.X_WC().rotation(axis, 0));
    rays_.along_y[at] = static_cast<float>(image.X_WC().rotation(axis, 1));
    rays_.along_z[at] = static_cast<float>(image.X_WC().rotation(axis, 2));
  }
  rays_.inverse_fx = static_cast<float>(1.0 / camera_.fx_px);
  rays_.inverse_fy = static_cast<float>(1.0 / camera_.fy_px);
  rays_.cx = static_cast<float>(camera_.cx_px);
  rays_.cy = static_cast<float>(camera_.cy_px);
  rays_.voxels_to_blocks = 1.0F / kBlockEdge;
  rays_.truncation = view.rules.truncation;
  rays_.size = pool_->box().size;
  rays_.directory = pool_->directory().data();
  missing_.resize(std::max(missing_.size(), detail::max_missing(static_cast<std::size_t>(view.width))));
}

void Fusion::allocate_near_surfaces() noexcept {
  for (auto v = static_cast<std::int32_t>(frame_ % kRowTurns); v < view_->height;
       v += static_cast<std::int32_t>(kRowTurns)) {
    const float* const row =
        view_->depth + static_cast<std::size_t>(v) * static_cast<std::size_t>(view_->width);
    const std::size_t found = detail::find_missing(rays_, row, view_->width, v, missing_.data());
    for (std::size_t i = 0; i < found; ++i) {
      const auto place = static_cast<std::size_t>(missing_[i]);
      if (pool_->at(place) != nullptr) continue;
      FusedBlock* const block = pool_->allocate(place);
      if (block == nullptr) {
        ++report_.refused;
        continue;
      }
      block->published = gate_->bits_of(block->place);
      ++report_.allocated;
    }
  }
}

Fusion::BlockView Fusion::view_of(const Eigen::Vector3d& first_voxel) const noexcept {
  const Eigen::Vector3d p = first_voxel + centre_;
  BlockView view{.z = p.z(), .depths = {}};
  const double nearest = p.z() - kBlockRadius_vox;
  if (p.z() + kBlockRadius_vox <= static_cast<double>(view_->min_z)) return view;
  int u0 = 0, v0 = 0, u1 = view_->width - 1, v1 = view_->height - 1;
  if (nearest > 1.0) {
    // A bound of the sphere's image: its border is nearer to the camera by the radius at most.
    const double u = camera_.fx_px * p.x() / p.z() + camera_.cx_px,
                 v = camera_.fy_px * p.y() / p.z() + camera_.cy_px, growth = kBlockRadius_vox / nearest,
                 du = growth * (camera_.fx_px + std::abs(u - camera_.cx_px)) + 1.0,
                 dv = growth * (camera_.fy_px + std::abs(v - camera_.cy_px)) + 1.0;
    if (u + du < 0.0 || v + dv < 0.0 || u - du > u1 || v - dv > v1) return view;
    u0 = static_cast<int>(std::max(0.0, u - du));
    v0 = static_cast<int>(std::max(0.0, v - dv));
    u1 = static_cast<int>(std::min<double>(u1, u + du));
    v1 = static_cast<int>(std::min<double>(v1, v + dv));
  }
  return {p.z(), pyramid_.in(u0, v0, u1, v1), u0, v0, u1, v1};
}

void Fusion::fuse(FusedBlock& block) noexcept {
  const Eigen::Vector3d first = first_voxel(block.place);
  const BlockView seen = view_of(first);
  if (!seen.depths.any() ||
      seen.z - kBlockRadius_vox > static_cast<double>(seen.depths.greatest_vox) + parameters_.truncation_vox)
    return;  // outside of the image, or hidden
  const auto slot = static_cast<std::uint32_t>(&block - pool_->slots().data());
  if (block.fused_count >= kMature && (slot + frame_) % kQuietTurns != 0 && none_set(block.once) &&
      none_set(block.twice) && pyramid_.steady(seen.u0, seen.v0, seen.u1, seen.v1)) {
    ++report_.quiet;
    see(pool_->box().index(block.place));
    return;
  }
  if (block.fused_count < kMature) ++block.fused_count;
  detail::BlockVotes votes;
  detail::fuse_block(*view_, static_cast<float>(camera_.fx_px * first.x() + camera_.cx_px * first.z()),
                     static_cast<float>(camera_.fy_px * first.y() + camera_.cy_px * first.z()),
                     static_cast<float>(first.z()), block, votes);
  ++report_.fused;
  if (shows_a_quarter(votes.observed)) see(pool_->box().index(block.place));
  gate_->vote(block, votes, policy(block.place) == UnknownPolicy::kOccupied);
  if (votes.saturated != votes.observed || !none_set(block.published) || !none_set(block.once) ||
      !holds_no_surface(block, parameters_.truncation_vox))
    return;
  if (all_set(votes.saturated)) seen_free_[pool_->box().index(block.place)] = frame_;
  pool_->release(block);
  ++report_.released;
}

void Fusion::fuse_blocks() noexcept {
  for (FusedBlock& block : pool_->slots()) {
    if (block.used) fuse(block);
  }
}

/// Returns whether a quarter of a block, by one of eight of its voxels, lies before what the camera sees.
bool Fusion::is_partly_seen(const Eigen::Vector3d& first_voxel) const noexcept {
  const detail::FrameView& view = *view_;
  const auto first_u = static_cast<float>(camera_.fx_px * first_voxel.x() + camera_.cx_px * first_voxel.z()),
             first_v = static_cast<float>(camera_.fy_px * first_voxel.y() + camera_.cy_px * first_voxel.z()),
             first_z = static_cast<float>(first_voxel.z()), end_u = static_cast<float>(view.width) - 0.5F,
             end_v = static_cast<float>(view.height) - 0.5F;
  int seen = 0;
  for (std::size_t i = 1 << 6 | 1 << 3 | 1; i < kBlockVoxels; i += (i & 7) < 7     ? 2
                                                                   : i / 8 % 8 < 7 ? 10
                                                                                   : 74) {
    const float z = first_z + view.dz[i];
    if (z <= view.min_z) continue;
    const float u = (first_u + view.du[i]) / z, v = (first_v + view.dv[i]) / z;
    if (!(u > -0.5F && v > -0.5F && u < end_u && v < end_v)) continue;
    const auto column = static_cast<std::ptrdiff_t>(u + 0.5F), row = static_cast<std::ptrdiff_t>(v + 0.5F);
    seen += std::abs(view.depth[row * view.width + column]) > z ? 1 : 0;
  }
  return 4 * 8 * seen >= static_cast<int>(kBlockVoxels);
}

/// Looks at some of the blocks without content: whether the camera sees through them as a whole, or sees a
/// part of them.
void Fusion::look_through_free_blocks() noexcept {
  const std::span<const std::int32_t> directory = pool_->directory();
  for (std::size_t place = frame_ % kFreeTurns; place < directory.size(); place += kFreeTurns) {
    if (directory[place] != BlockPool::kNoSlot) continue;
    const Index3 block = pool_->block_at(place);
    const Eigen::Vector3d first = first_voxel(block);
    const BlockView seen = view_of(first);
    if (!seen.depths.any() || seen.z - kBlockRadius_vox > static_cast<double>(seen.depths.greatest_vox))
      continue;
    if (!seen.depths.seen || seen.z + kBlockRadius_vox + parameters_.truncation_vox >=
                                 static_cast<double>(seen.depths.least_vox)) {
      if ((place / kFreeTurns + frame_ / kFreeTurns) % kPartTurns == 0 && is_partly_seen(first)) see(place);
      continue;
    }
    seen_free_[place] = frame_;
    see(place);
    if (policies_[place] == UnknownPolicy::kOccupied)
      report_.changes.vanished += gate_->set_block(block, false);
  }
}

const FusionReport& Fusion::integrate(const DepthImage& image, std::span<const float> arm_depth_m) {
  report_ = {};
  ++frame_;
  now_steps_ = static_cast<std::uint32_t>(std::min((image.header().time_s + 1.0) * kSeenSteps_per_s,
                                                   double{std::numeric_limits<std::uint32_t>::max()}));
  depth_.prepare(image, arm_depth_m, parameters_.sigma, parameters_.masks,
                 parameters_.grid.voxel_size_m.reference_m());
  SeenCells& before =
      history_.of({image.camera(), image.X_WC(), 0.0}, DepthPyramid::cells_of(image.camera()), frame_);
  const double voxel_m = parameters_.grid.voxel_size_m.reference_m();
  pyramid_.build(depth_, before,
                 {static_cast<float>(kCellTolerance * parameters_.surprise_vox),
                  static_cast<float>(kCellTolerance * parameters_.surprise_sigmas *
                                     parameters_.sigma.at_1m_m * voxel_m)});
  set_view(image);
  allocate_near_surfaces();
  fuse_blocks();
  look_through_free_blocks();
  const ChangeGate::Settled settled = gate_->settle();
  report_.changes.appeared += settled.appeared;
  report_.changes.vanished += settled.vanished;
  report_.changes.speckle += settled.speckle;
  report_.changes.waiting += settled.waiting;
  report_.blocks = pool_->in_use();
  return report_;
}

void Fusion::forget(const workspace::VoxelBox& box) noexcept {
  const workspace::VoxelBox in_grid = box.intersection(workspace::VoxelBox::of(parameters_.grid));
  if (in_grid.empty()) return;
  workspace::VoxelBox::between(block_of(in_grid.min),
                               block_of(in_grid.end() - Index3{1, 1, 1}) + Index3{1, 1, 1})
      .for_each([&](Index3 block) {
        const std::size_t place = pool_->box().index(block);
        if (FusedBlock* const fused = pool_->at(place)) pool_->release(*fused);
        seen_free_[place] = 0;
        seen_at_[place] = 0;
        if (policies_[place] != UnknownPolicy::kIgnore)
          gate_->set_block(block, policies_[place] == UnknownPolicy::kOccupied);
      });
}

double Fusion::distance_vox(Index3 v) const noexcept {
  const FusedBlock* const block = pool_->find(block_of(v));
  if (block == nullptr) return 0.0;
  return block->distance[static_cast<std::size_t>((v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7))] /
         kDistanceSteps;
}

int Fusion::weight(Index3 v) const noexcept {
  const FusedBlock* const block = pool_->find(block_of(v));
  if (block == nullptr) return 0;
  return block->weight[static_cast<std::size_t>((v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7))];
}

double Fusion::coverage(Index3 block) const noexcept {
  const std::size_t place = pool_->box().index(block);
  const FusedBlock* const fused = pool_->at(place);
  if (fused == nullptr) return seen_free_[place] != 0 ? 1.0 : 0.0;
  const auto known =
      std::count_if(fused->weight.begin(), fused->weight.end(), [](std::uint8_t w) { return w > 0; });
  return static_cast<double>(known) / static_cast<double>(kBlockVoxels);
}

std::size_t Fusion::bytes() const noexcept {
  return pool_->bytes() + gate_->bytes() + policies_.size() +
         (seen_free_.size() + seen_at_.size()) * sizeof(std::uint32_t);
}

}  // namespace phantom::fusion
