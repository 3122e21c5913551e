#include "common/layers/activation.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/core/parallel.hpp"
#include "common/core/text.hpp"
#include "common/layers/layers.hpp"
#include "common/layers/merge.hpp"
#include "common/voxelise/voxelise_implicit.hpp"

namespace phantom::layers {
namespace {

core::Status error_of(const Body& body, const core::Status& status) {
  return {status.code(), "'" + body.name + "': " + status.message()};
}

std::string extent_text(const workspace::VoxelBox& box) {
  return std::to_string(box.size[0]) + " × " + std::to_string(box.size[1]) + " × " +
         std::to_string(box.size[2]);
}

core::Status check_size(const workspace::VoxelBox& box) {
  if (box.voxel_count() <= kMaxObjectVoxels) return core::Status::ok();
  return {core::ErrorCode::kResourceExhausted,
          "takes " + extent_text(box) + " voxels with its layers; allowed: at most " +
              std::to_string(kMaxObjectVoxels) +
              " in all. Is the mesh's scale right, or the voxel size too small?"};
}

core::Expected<voxelise::SolidVoxels> solid_of(const Body& body, const workspace::GridSpec& grid,
                                               const workspace::VoxelBox& clip,
                                               const workspace::WorkOptions& options) {
  return body.implicit_W ? voxelise::voxelise(*body.implicit_W, grid, clip, options)
                         : voxelise::voxelise(body.mesh_W, grid, clip, options);
}

/// Returns the voxels that the body takes without its layers. Refuses a body too far from the origin for 32
/// bit voxel addresses.
core::Expected<workspace::VoxelBox> place_of(const Body& body, const workspace::GridSpec& grid) {
  geometry::BoundingBox bounds = body.mesh_W.bounding_box();
  if (!bounds.finite)
    return core::Status(core::ErrorCode::kInvalidArgument, "has a coordinate that is not a finite number");
  if (body.implicit_W) {
    const geometry::Box exact = body.implicit_W->bounding_box();
    bounds = {exact.min_m.cast<float>(), exact.max_m.cast<float>()};
  }
  const double farthest_m =
      bounds.empty() ? 0.0 : std::max(-bounds.min_m.minCoeff(), bounds.max_m.maxCoeff());
  if (farthest_m < std::min(1e6, 1e9 * grid.voxel_size_m.reference_m()))
    return body.implicit_W ? voxelise::voxel_bounds(*body.implicit_W, grid)
                           : voxelise::voxel_bounds(bounds, grid);
  return core::Status(core::ErrorCode::kResourceExhausted,
                      core::formatted("reaches %.3g m from the origin; is its scale right?", farthest_m));
}

/// Returns the smallest box, in the solid's voxel addresses, that holds all its boundary and interior voxels.
workspace::VoxelBox tight_box(const voxelise::SolidVoxels& solid) {
  workspace::Index3 low{INT32_MAX, INT32_MAX, INT32_MAX}, high{-1, -1, -1};
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
      for (std::size_t i = 0; i < solid.boundary.words_per_row(); ++i) {
        const std::uint64_t word = solid.boundary.row(y, z)[i] | solid.inside.row(y, z)[i];
        if (word == 0) continue;
        const auto x = static_cast<std::int32_t>(i * 64);
        low = workspace::min(low, {x + std::countr_zero(word), y, z});
        high = workspace::max(high, {x + 63 - std::countl_zero(word), y, z});
      }
    }
  }
  if (high.x < 0) return {};
  return workspace::VoxelBox::between(solid.box.min + low, solid.box.min + high + workspace::Index3{1, 1, 1});
}

/// Times an activation, reports its progress and asks whether to continue.
struct Steps {
  const ActivationOptions& options;

  double now_s() const { return options.stopwatch ? options.stopwatch() : 0.0; }
  void report(double share) const {
    if (options.on_progress) options.on_progress(share);
  }
  /// Reports the share of the work done. Returns false if the work must stop.
  bool go_on(double share) const {
    report(share);
    return !options.keep_going || options.keep_going();
  }
};

constexpr double kVoxelised = 0.3;  // share of the work that voxelising takes, estimated

struct SolidCount {
  std::atomic<std::size_t> boundary = 0, interior = 0;
};

/// Counts the voxels of the solid that lie in `part`.
void count_in(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& part, int threads,
              SolidCount& count) {
  const workspace::VoxelBox& box = solid.box;
  const workspace::VoxelBox here = box.intersection(part);
  if (here.empty()) return;
  const std::int32_t low = here.min.x - box.min.x, high = low + here.size[0] - 1, y = here.min.y - box.min.y;
  const std::uint64_t from = ~std::uint64_t{0} << (low & 63), to = ~std::uint64_t{0} >> (63 - (high & 63));
  const auto first = static_cast<std::size_t>(low >> 6), last = static_cast<std::size_t>(high >> 6);
  const bool whole_rows = here.size[0] == box.size[0];
  const auto add = [&](const workspace::BitCounts& more) {
    count.boundary += more.a;
    count.interior += more.only_b;
  };
  core::parallel_for(threads, static_cast<std::size_t>(here.size[2]), [&](std::size_t layer, std::size_t) {
    const std::int32_t z = here.min.z - box.min.z + static_cast<std::int32_t>(layer);
    if (whole_rows) {
      const std::size_t words = solid.inside.words_per_row() * static_cast<std::size_t>(here.size[1]);
      return add(workspace::count_bits(solid.boundary.row(y, z), solid.inside.row(y, z), words));
    }
    std::vector<std::uint64_t> words[2];
    for (std::int32_t row = y; row < y + here.size[1]; ++row) {
      const std::uint64_t* const rows[2] = {solid.boundary.row(row, z), solid.inside.row(row, z)};
      for (std::size_t i = 0; i < 2; ++i) {
        words[i].assign(rows[i] + first, rows[i] + last + 1);
        words[i].front() &= from;
        words[i].back() &= to;
      }
      add(workspace::count_bits(words[0].data(), words[1].data(), words[0].size()));
    }
  });
}

/// Makes a body's voxels, and those of its guard, fluid of layer 1.
void make_fluid(workspace::ObjectBricks& bricks) {
  constexpr std::int8_t kInnermost = 1;
  const std::vector<workspace::BrickKey> keys = bricks.keys();
  for (const workspace::BrickKey key : keys) {
    std::int8_t* const orders = bricks.edit(key);
    std::replace_if(
        orders, orders + workspace::kBrickVoxels,
        [](std::int8_t order) { return order >= workspace::kOrderGuard; }, kInnermost);
  }
}

/// Divides the part of a grid that an object reaches into parts of whole bricks.
std::vector<workspace::VoxelBox> parts_of(const workspace::VoxelBox& reached, const workspace::GridSpec& grid,
                                          std::size_t most_voxels) {
  const workspace::VoxelBox bricks = workspace::bricks_of(reached);
  const workspace::Index3 first = workspace::corner_of({bricks.min}),
                          end = workspace::min(workspace::corner_of({bricks.end()}),
                                               workspace::VoxelBox::of(grid).end());
  const auto cube =
      static_cast<std::int32_t>(std::cbrt(static_cast<double>(most_voxels))) & -workspace::kBrickEdge;
  const std::int32_t edge = std::max(workspace::kBrickEdge, cube);
  const workspace::Index3 step =
      reached.voxel_count() <= most_voxels ? end - first : workspace::Index3{edge, edge, edge};
  std::vector<workspace::VoxelBox> parts;
  for (workspace::Index3 at = first; at.z < end.z; at.z += step.z) {
    for (at.y = first.y; at.y < end.y; at.y += step.y) {
      for (at.x = first.x; at.x < end.x; at.x += step.x)
        parts.push_back(workspace::VoxelBox::between(at, workspace::min(at + step, end)));
    }
  }
  return parts;
}

/// Makes an object's bricks, part by part.
class ObjectActivation {
 public:
  ObjectActivation(const Body& body, const workspace::GridSpec& grid, const ActivationOptions& options,
                   const Steps& steps)
      : body_(body),
        grid_(grid),
        options_(options),
        steps_(steps),
        margin_(-voxelise_clip(grid, body.profile).min.x) {}

  /// Makes all bricks; `reached` is the part of the grid that the object reaches.
  core::Expected<ActivatedObject> all(const workspace::VoxelBox& reached) {
    if (reached.empty()) return finish();
    const std::vector<workspace::VoxelBox> parts = parts_of(reached, grid_, options_.most_voxels_at_once);
    parts_ = static_cast<double>(parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
      part_ = static_cast<double>(i);
      const double start_s = steps_.now_s();
      auto solid = solid_of(
          body_, grid_, parts[i].grown(margin_),
          {options_.threads, [&](double share) { return steps_.go_on(share_of_all(kVoxelised * share)); },
           options_.budget});
      if (!solid) return error_of(body_, solid.status());
      object_.report.voxelise_s += steps_.now_s() - start_s;
      if (!add(*solid, parts[i])) return error_of(body_, ended());
    }
    return finish();
  }
  /// The same for a solid that is known as a whole.
  core::Expected<ActivatedObject> of(const voxelise::SolidVoxels& solid) {
    if (!add(solid, workspace::VoxelBox::of(grid_))) return error_of(body_, ended());
    return finish();
  }

 private:
  bool add(const voxelise::SolidVoxels& solid, const workspace::VoxelBox& part) {
    if (!steps_.go_on(share_of_all(kVoxelised))) return false;
    const double start_s = steps_.now_s();
    bool stopped = false;
    const auto go_on = [&](double share) {
      stopped = stopped || !steps_.go_on(share_of_all(kVoxelised + (1.0 - kVoxelised) * share));
      return !stopped;
    };
    workspace::ObjectBricks bricks = lay_layers(body_.mesh_W, solid, body_.profile, grid_, part,
                                                {options_.threads, go_on, options_.budget});
    if (stopped || (options_.budget != nullptr && options_.budget->ended())) return false;
    if (!body_.solid) make_fluid(bricks);
    for (workspace::ObjectBricks::Part& brick : bricks.take_parts()) bricks_.push_back(std::move(brick));
    BodyReport& report = object_.report;
    SolidCount count;
    count_in(solid, part, options_.threads, count);
    report.boundary_voxels += count.boundary;
    report.interior_voxels += count.interior;
    const std::size_t disputed = report.mesh.disputed_voxels;
    // The report of a part without the mesh says less.
    if (!known_ || !solid.box.empty()) report.mesh = solid.report;
    report.mesh.disputed_voxels = disputed + solid.report.disputed_voxels;
    known_ = true;
    report.layers_s += steps_.now_s() - start_s;
    return true;
  }
  core::Status ended() const { return workspace::ended_early({.budget = options_.budget}, "activation"); }
  /// Returns the share of all parts that is done, from the share of the current part. Rounding never lowers
  /// it from one part to the next.
  double share_of_all(double share) const { return (part_ + share) / parts_; }
  ActivatedObject finish() {
    object_.bricks = workspace::ObjectBricks(std::move(bricks_));
    return std::move(object_);
  }

  const Body& body_;
  const workspace::GridSpec& grid_;
  const ActivationOptions& options_;
  const Steps& steps_;
  std::int32_t margin_;
  double part_ = 0.0, parts_ = 1.0;  // index of the current part, and number of parts
  bool known_ = false;
  std::vector<workspace::ObjectBricks::Part> bricks_;
  ActivatedObject object_;
};

/// Checks the profile and the place. Returns the voxels that the body takes without its layers.
core::Expected<workspace::VoxelBox> checked_place(const Body& body, const workspace::GridSpec& grid) {
  if (core::Status checked = workspace::check_profile(body.profile); !checked) return error_of(body, checked);
  if (!body.solid && !body.profile.inside_thickness_vox.empty())
    return error_of(body, core::Status::invalid_argument(
                              "has layers inside, but is no body; allowed: none of a protected zone"));
  auto place = place_of(body, grid);
  if (!place) return error_of(body, place.status());
  return place;
}

/// Returns the workspace that holds this object alone.
workspace::Workspace workspace_of(const Body& body, const workspace::GridSpec& grid,
                                  const ActivatedObject& object, int threads) {
  workspace::Workspace workspace(grid, *workspace::make_palette({body.profile}));
  const workspace::CodeTable codes = workspace::code_table(body.profile, workspace.palette());
  const MergeEntry entry{&object.bricks, body.id, &codes};
  merge_bricks(MergeLaw::kHighestViscosity, {&entry, 1}, object.bricks.keys(), workspace, threads);
  return workspace;
}

}  // namespace

workspace::GridSpec grid_over(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m,
                              const workspace::VoxelSize& voxel_size_m) {
  workspace::GridSpec grid{min_m, voxel_size_m, {}};
  const Eigen::Vector3d voxels = (max_m - min_m).cwiseQuotient(voxel_size_m.sides_m());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The 1e-6 keeps 2.2 m ÷ 5 mm at 440 voxels, however the quotient is rounded.
    grid.size_vox[axis] =
        static_cast<std::int32_t>(std::ceil(voxels[static_cast<Eigen::Index>(axis)] - 1e-6));
  }
  return grid;
}

core::Expected<ActivatedObject> activate_object(const Body& body, const workspace::GridSpec& grid,
                                                const ActivationOptions& options) {
  const auto place = checked_place(body, grid);
  if (!place) return place.status();
  const workspace::VoxelBox reached = place->grown(body.profile.reach_vox());
  if (core::Status checked = check_size(reached.intersection(voxelise_clip(grid, body.profile))); !checked)
    return error_of(body, checked);
  const Steps steps{options};
  auto object =
      ObjectActivation(body, grid, options, steps).all(reached.intersection(workspace::VoxelBox::of(grid)));
  if (!object) return object.status();
  object->report.box = reached.intersection(voxelise_clip(grid, body.profile));
  steps.report(1.0);
  return object;
}

core::Expected<std::pair<workspace::Workspace, BodyReport>> activate_alone(
    const Body& body, const workspace::VoxelSize& voxel_size_m, const ActivationOptions& options) {
  const workspace::GridSpec lattice{Eigen::Vector3d::Zero(), voxel_size_m, {0, 0, 0}};
  const auto around = checked_place(body, lattice);
  if (!around) return around.status();
  const workspace::VoxelBox reached = around->grown(body.profile.reach_vox());
  if (core::Status checked = check_size(reached); !checked) return error_of(body, checked);
  const auto grid_of = [&](const workspace::VoxelBox& box) {
    return workspace::GridSpec{lattice.corner_of(box.min), voxel_size_m, box.size};
  };
  const Steps steps{options};
  if (reached.voxel_count() > options.most_voxels_at_once) {
    auto object = activate_object(body, grid_of(reached), options);
    if (!object) return object.status();
    return std::pair{workspace_of(body, grid_of(reached), *object, options.threads), object->report};
  }
  const double start_s = steps.now_s();
  auto solid = solid_of(
      body, lattice, *around,
      {options.threads, [&](double share) { return steps.go_on(kVoxelised * share); }, options.budget});
  if (!solid) return error_of(body, solid.status());
  const double voxelise_s = steps.now_s() - start_s;
  const workspace::VoxelBox whole = tight_box(*solid).grown(body.profile.reach_vox());
  solid->box.min = solid->box.min - whole.min;
  const workspace::GridSpec grid = grid_of(whole);
  auto object = ObjectActivation(body, grid, options, steps).of(*solid);
  if (!object) return object.status();
  object->report.voxelise_s = voxelise_s;
  object->report.box = workspace::VoxelBox::of(grid);
  workspace::Workspace workspace = workspace_of(body, grid, *object, options.threads);
  steps.report(1.0);
  return std::pair{std::move(workspace), object->report};
}

std::array<std::uint64_t, 256> count_orders(const workspace::Workspace& workspace) {
  std::array<std::uint64_t, 256> counts{};
  std::uint64_t in_bricks = 0;
  for (const workspace::BrickKey key : workspace.bricks()) {
    const auto brick = workspace.brick(key);
    const workspace::VoxelBox part =
        workspace::box_of(key).intersection(workspace::VoxelBox::of(workspace.grid()));
    part.for_each([&](workspace::Index3 v) {
      ++counts[static_cast<std::uint8_t>(brick.order[workspace::brick_offset(v)])];
    });
    in_bricks += part.voxel_count();
  }
  counts[0] += static_cast<std::uint64_t>(workspace.grid().voxel_count()) - in_bricks;
  return counts;
}

}  // namespace phantom::layers
