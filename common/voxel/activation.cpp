#include "common/voxel/activation.hpp"

#include <cmath>

#include "common/voxel/layer_methods.hpp"
#include "common/voxel/merge.hpp"
#include "common/voxel/voxelise_implicit.hpp"

namespace phantom::voxel {
namespace {

core::Status about(const Body& body, const core::Status& status) {
  return {status.code(), "'" + body.name + "': " + status.message()};
}

std::string extent_text(const VoxelBox& box) {
  return std::to_string(box.size[0]) + " × " + std::to_string(box.size[1]) + " × " +
         std::to_string(box.size[2]);
}

core::Status check_size(const VoxelBox& box) {
  if (box.voxel_count() <= kMaxObjectVoxels) return core::Status::ok();
  return {core::ErrorCode::kResourceExhausted,
          "takes " + extent_text(box) + " voxels with its layers; allowed: at most " +
              std::to_string(kMaxObjectVoxels) +
              " in all. Is the mesh's scale right, or the voxel size too small?"};
}

VoxelBox bounds_of(const Body& body, const GridSpec& grid) {
  return body.implicit_W ? voxel_bounds(*body.implicit_W, grid) : voxel_bounds(body.mesh_W, grid);
}

core::Expected<SolidVoxels> solid_of(const Body& body, const GridSpec& grid, const VoxelBox& clip, int threads) {
  return body.implicit_W ? voxelise(*body.implicit_W, grid, clip) : voxelise(body.mesh_W, grid, clip, threads);
}

/// Voxel addresses are 32 bit integers.
core::Status check_place(const Body& body, double voxel_size_m) {
  if (!body.mesh_W.all_finite())
    return {core::ErrorCode::kInvalidArgument, "has a coordinate that is not a finite number"};
  geometry::BoundingBox bounds = body.mesh_W.bounding_box();
  if (body.implicit_W) {
    const geometry::Box exact = body.implicit_W->bounding_box();
    bounds = {exact.min_m.cast<float>(), exact.max_m.cast<float>()};
  }
  const double farthest_m =
      bounds.empty() ? 0.0 : std::max(-bounds.min_m.minCoeff(), bounds.max_m.maxCoeff());
  if (farthest_m < std::min(1e6, 1e9 * voxel_size_m)) return core::Status::ok();
  return {core::ErrorCode::kResourceExhausted,
          "reaches " + std::to_string(farthest_m) + " m from the origin; is its scale right?"};
}

/// Smallest box (in the solid's own voxels' addresses) that holds all its boundary and interior voxels.
VoxelBox tight_box(const SolidVoxels& solid) {
  std::int32_t low[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, high[3] = {-1, -1, -1};
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
      for (std::size_t i = 0; i < solid.boundary.words_per_row(); ++i) {
        const std::uint64_t word = solid.boundary.row(y, z)[i] | solid.interior.row(y, z)[i];
        if (word == 0) continue;
        const auto x = static_cast<std::int32_t>(i * 64);
        const std::int32_t first[3] = {x + std::countr_zero(word), y, z},
                           last[3] = {x + 63 - std::countl_zero(word), y, z};
        for (int axis = 0; axis < 3; ++axis) {
          low[axis] = std::min(low[axis], first[axis]);
          high[axis] = std::max(high[axis], last[axis]);
        }
      }
    }
  }
  if (high[0] < 0) return {};
  return {{solid.box.min.x + low[0], solid.box.min.y + low[1], solid.box.min.z + low[2]},
          {high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1}};
}

/// Times, progress and the wish to stop.
class Steps {
 public:
  explicit Steps(const ActivationOptions& options) : options_(options), start_s_(now_s()) {}
  double now_s() const { return options_.stopwatch ? options_.stopwatch() : 0.0; }
  double start_s() const { return start_s_; }
  /// Tells the share that is done; false if the work shall end here.
  bool go_on(double share) const {
    if (options_.on_progress) options_.on_progress(share);
    return !options_.keep_going || options_.keep_going();
  }

 private:
  const ActivationOptions& options_;
  double start_s_;
};

const core::Status kStopped{core::ErrorCode::kUnavailable, "activation was stopped"};

constexpr double kVoxelised = 0.3;  // share of the work, about

ActivatedObject layered(const geometry::TriangleMesh& mesh_W, const SolidVoxels& solid, const LayerProfile& profile,
                        const GridSpec& grid, int threads, const Steps& steps) {
  ActivatedObject object;
  const auto go_on = [&](double share) { return steps.go_on(kVoxelised + (1.0 - kVoxelised) * share); };
  object.bricks = lay_layers(mesh_W, solid, profile, grid, VoxelBox::of(grid), {threads, go_on});
  object.report.mesh = solid.report;
  object.report.box = solid.box.grown(profile.reach_vox()).intersection(voxelise_clip(grid, profile));
  object.report.boundary_voxels = solid.boundary.count();
  object.report.interior_voxels = solid.interior.count();
  return object;
}

}  // namespace

GridSpec grid_over(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m, double voxel_size_m) {
  GridSpec grid{min_m, voxel_size_m, {}};
  for (int axis = 0; axis < 3; ++axis) {
    // The millionth keeps 2.2 m ÷ 5 mm at 440 voxels whatever the quotient's rounding.
    grid.size_vox[static_cast<std::size_t>(axis)] =
        static_cast<std::int32_t>(std::ceil((max_m[axis] - min_m[axis]) / voxel_size_m - 1e-6));
  }
  return grid;
}

core::Expected<ActivatedObject> activate_object(const Body& body, const GridSpec& grid,
                                                const ActivationOptions& options) {
  if (core::Status checked = check_profile(body.profile); !checked) return about(body, checked);
  if (core::Status checked = check_place(body, grid.voxel_size_m); !checked) return about(body, checked);
  const VoxelBox clip = voxelise_clip(grid, body.profile);
  const VoxelBox reached = bounds_of(body, grid).grown(body.profile.reach_vox()).intersection(clip);
  if (core::Status checked = check_size(reached); !checked) return about(body, checked);
  const Steps steps(options);
  const auto solid = solid_of(body, grid, clip, options.threads);
  if (!solid) return about(body, solid.status());
  const double voxelised_s = steps.now_s();
  if (!steps.go_on(kVoxelised)) return about(body, kStopped);
  ActivatedObject object = layered(body.mesh_W, *solid, body.profile, grid, options.threads, steps);
  object.report.voxelise_s = voxelised_s - steps.start_s();
  object.report.layers_s = steps.now_s() - voxelised_s;
  if (!steps.go_on(1.0)) return about(body, kStopped);
  return object;
}

core::Expected<std::pair<Workspace, BodyReport>> activate_alone(const Body& body, double voxel_size_m,
                                                                const ActivationOptions& options) {
  if (core::Status checked = check_profile(body.profile); !checked) return about(body, checked);
  auto palette = make_palette({body.profile});
  if (!palette) return palette.status();
  if (core::Status checked = check_place(body, voxel_size_m); !checked) return about(body, checked);
  const GridSpec lattice{Eigen::Vector3d::Zero(), voxel_size_m, {0, 0, 0}};
  const VoxelBox around = bounds_of(body, lattice);
  if (core::Status checked = check_size(around.grown(body.profile.reach_vox())); !checked)
    return about(body, checked);
  const Steps steps(options);
  auto solid = solid_of(body, lattice, around, options.threads);
  if (!solid) return about(body, solid.status());
  const double voxelised_s = steps.now_s();
  if (!steps.go_on(kVoxelised)) return about(body, kStopped);

  const VoxelBox whole = tight_box(*solid).grown(body.profile.reach_vox());
  const Index3 min = whole.min;
  const GridSpec grid{voxel_size_m * Eigen::Vector3d(min.x, min.y, min.z), voxel_size_m, whole.size};
  solid->box.min = {solid->box.min.x - min.x, solid->box.min.y - min.y, solid->box.min.z - min.z};
  ActivatedObject object = layered(body.mesh_W, *solid, body.profile, grid, options.threads, steps);
  object.report.voxelise_s = voxelised_s - steps.start_s();
  object.report.layers_s = steps.now_s() - voxelised_s;
  const CodeTable codes = code_table(body.profile, *palette);
  const MergeEntry entry{&object.bricks, body.id, &codes};
  Workspace workspace(grid, *palette);
  merge_bricks(MergeLaw::kHighestViscosity, {&entry, 1}, object.bricks.keys(), workspace, options.threads);
  if (!steps.go_on(1.0)) return about(body, kStopped);
  return std::pair{std::move(workspace), object.report};
}

std::array<std::uint64_t, 256> count_orders(const Workspace& workspace) {
  std::array<std::uint64_t, 256> counts{};
  std::uint64_t in_bricks = 0;
  for (const BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    const VoxelBox part = box_of(key).intersection(VoxelBox::of(workspace.grid()));
    for (std::uint32_t z = 0; z < static_cast<std::uint32_t>(part.size[2]); ++z) {
      for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(part.size[1]); ++y) {
        for (std::uint32_t x = 0; x < static_cast<std::uint32_t>(part.size[0]); ++x) {
          ++counts[static_cast<std::uint8_t>(brick.order[brick_offset(x, y, z)])];
        }
      }
    }
    in_bricks += part.voxel_count();
  }
  counts[0] += static_cast<std::uint64_t>(workspace.grid().voxel_count()) - in_bricks;
  return counts;
}

}  // namespace phantom::voxel
