#include <algorithm>
#include <cmath>
#include <deque>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "common/voxelise/distance_field.hpp"
#include "common/voxelise/nearest_triangles.hpp"
#include "common/voxelise/voxelise.hpp"

namespace phantom::voxelise {
namespace {

constexpr double kQuanta = 32767.0;

}  // namespace

/// Adds bodies to a field, one after the other.
class DistanceFieldBuilder {
 public:
  DistanceFieldBuilder(const workspace::GridSpec& grid, const DistanceFieldOptions& options) {
    field_.grid_ = grid;
    field_.outside_m_ = options.outside_m;
    field_.inside_m_ = options.inside_m;
    field_.quantum_m_ = std::max(options.outside_m, options.inside_m) / kQuanta;
    for (std::size_t i = 0; i < 3; ++i) field_.size_cubes_[i] = (grid.size_vox[i] + 7) / 8;
    field_.directory_.assign(field_.cube_index(0, 0, field_.size_cubes_[2]), DistanceField::kFar);
    keep_going_ = options.keep_going;
    reach_vox_ =
        std::max(options.outside_m, options.inside_m) / grid.voxel_size_m + 1.0;  // one for interpolation
  }

  /// The part of the work that can be done for several bodies at once: everything but the merge.
  struct Prepared {
    std::uint16_t id = 0;
    SolidVoxels solid;
    std::vector<Eigen::Vector3f> vertices_vox;
    workspace::VoxelBox region;
    std::unique_ptr<detail::NearestTriangles> nearest;  // null: the body is out of reach
  };

  core::Expected<std::unique_ptr<Prepared>> prepare(const FieldBody& body) const {
    const workspace::GridSpec& grid = field_.grid_;
    if (!goes_on()) return ended();
    auto prepared = std::make_unique<Prepared>();
    prepared->id = body.id;
    auto solid = voxelise(body.mesh_W, grid, workspace::VoxelBox::of(grid));
    if (!solid) {
      return core::Status(solid.status().code(),
                          "body " + std::to_string(body.id) + ": " + solid.status().message());
    }
    prepared->solid = std::move(*solid);
    for (const auto& vertex : body.mesh_W.vertices_m) {
      prepared->vertices_vox.push_back(
          ((vertex.cast<double>() - grid.origin_m) / grid.voxel_size_m).cast<float>());
    }
    const auto halo = static_cast<std::int32_t>(std::ceil(reach_vox_)) + 1;
    // Triangles outside the grid count as far as their distances reach into it.
    prepared->region = voxel_bounds(body.mesh_W.bounding_box(), grid)
                           .grown(halo)
                           .intersection(workspace::VoxelBox::of(grid).grown(halo));
    if (!prepared->region.empty()) {
      prepared->nearest = std::make_unique<detail::NearestTriangles>(
          prepared->vertices_vox, body.mesh_W.triangles, prepared->region, static_cast<float>(reach_vox_),
          keep_going_);
      if (!prepared->nearest->is_whole()) return ended();
    }
    return prepared;
  }

  bool goes_on() const { return !keep_going_ || keep_going_(); }
  static core::Status ended() { return {core::ErrorCode::kUnavailable, "distance field: was told to end"}; }

  /// Returns true if the merge was completed, false if keep_going ended it.
  bool merge(const Prepared& body) {
    if (!body.nearest) return true;
    const workspace::VoxelBox cubes =
        cube_aligned(body.region.intersection(workspace::VoxelBox::of(field_.grid_)));
    workspace::Index3 cube;
    for (cube.z = cubes.min.z; cube.z < cubes.min.z + cubes.size[2]; cube.z += 8) {
      if (!goes_on()) return false;
      for (cube.y = cubes.min.y; cube.y < cubes.min.y + cubes.size[1]; cube.y += 8) {
        for (cube.x = cubes.min.x; cube.x < cubes.min.x + cubes.size[0]; cube.x += 8) merge_cube(cube, body);
      }
    }
    return true;
  }

  DistanceField take() { return std::move(field_); }

 private:
  /// Returns the region enlarged to whole cubes, within the grid.
  workspace::VoxelBox cube_aligned(const workspace::VoxelBox& region) const {
    const auto down = [](std::int32_t v) { return v & ~7; };
    const workspace::Index3 min{down(region.min.x), down(region.min.y), down(region.min.z)};
    return workspace::VoxelBox{
        min,
        {down(region.min.x + region.size[0] + 7) - min.x, down(region.min.y + region.size[1] + 7) - min.y,
         down(region.min.z + region.size[2] + 7) - min.z}}
        .intersection(workspace::VoxelBox::of(field_.grid_));
  }

  static bool inside(const SolidVoxels& solid, workspace::Index3 v) {
    const workspace::VoxelBox& box = solid.box;
    const std::int32_t x = v.x - box.min.x, y = v.y - box.min.y, z = v.z - box.min.z;
    return x >= 0 && y >= 0 && z >= 0 && x < box.size[0] && y < box.size[1] && z < box.size[2] &&
           solid.inside.get(x, y, z);
  }

  /// Merges the body's distances in one cube into the field.
  void merge_cube(workspace::Index3 corner, const Prepared& body) {
    const detail::NearestTriangles& nearest = *body.nearest;
    std::int32_t& entry = field_.directory_[field_.cube_index(corner.x >> 3, corner.y >> 3, corner.z >> 3)];
    if (entry == DistanceField::kDeep) return;
    if (!nearest.knows_cube(corner)) {  // no surface near: the whole cube is inside or outside
      if (inside(body.solid, corner)) entry = DistanceField::kDeep;
      return;
    }
    std::array<std::int16_t, 512> values;
    const auto out = static_cast<std::int16_t>(std::lround(field_.outside_m_ / field_.quantum_m_));
    const auto in = static_cast<std::int16_t>(-std::lround(field_.inside_m_ / field_.quantum_m_));
    bool all_out = true, all_in = true;
    for (std::int32_t i = 0; i < 512; ++i) {
      const workspace::Index3 v{corner.x + (i & 7), corner.y + (i >> 3 & 7), corner.z + (i >> 6)};
      const auto distance_vox = static_cast<double>(nearest.distance_vox(v));
      const double quanta = distance_vox * field_.grid_.voxel_size_m / field_.quantum_m_;
      std::int16_t& value = values[static_cast<std::size_t>(i)];
      if (inside(body.solid, v)) {
        value = quanta >= -in ? in : static_cast<std::int16_t>(-std::lround(quanta));
      } else {
        value = quanta >= out ? out : static_cast<std::int16_t>(std::lround(quanta));
      }
      all_out = all_out && value == out;
      all_in = all_in && value == in;
    }
    if (all_out) return;
    if (all_in) {
      entry = DistanceField::kDeep;
      return;
    }
    if (entry == DistanceField::kFar) {
      entry = static_cast<std::int32_t>(field_.samples_.size() / 512);
      field_.samples_.resize(field_.samples_.size() + 512, out);
      field_.objects_.resize(field_.objects_.size() + 512, 0);
    }
    const std::size_t base = static_cast<std::size_t>(entry) * 512;
    for (std::size_t i = 0; i < 512; ++i) {
      if (values[i] >= field_.samples_[base + i]) continue;
      field_.samples_[base + i] = values[i];
      field_.objects_[base + i] = body.id;
    }
  }

  DistanceField field_;
  double reach_vox_ = 0.0;
  std::function<bool()> keep_going_;
};

core::Expected<DistanceField> DistanceField::build(const workspace::GridSpec& grid,
                                                   const std::vector<FieldBody>& bodies,
                                                   const DistanceFieldOptions& options) {
  for (const double width_m : {options.outside_m, options.inside_m}) {
    if (!(width_m > 0 && width_m <= 64 * grid.voxel_size_m)) {
      return core::Status::invalid_argument("distance field: a band of " + std::to_string(width_m) +
                                            " m; allowed: above 0, up to 64 voxels");
    }
  }
  DistanceFieldBuilder builder(grid, options);
  // Bodies are prepared in parallel, a few ahead, and merged in their order, so that the result does not
  // depend on timing.
  using Result = core::Expected<std::unique_ptr<DistanceFieldBuilder::Prepared>>;
  std::deque<std::future<Result>> ahead;
  const std::size_t most_ahead = std::max(1U, std::thread::hardware_concurrency());
  std::size_t started = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (; started < std::min(bodies.size(), i + most_ahead); ++started) {
      ahead.push_back(std::async(std::launch::async,
                                 [&builder, &body = bodies[started]] { return builder.prepare(body); }));
    }
    const Result prepared = ahead.front().get();
    ahead.pop_front();
    if (!prepared) return prepared.status();
    if (!builder.merge(**prepared)) return DistanceFieldBuilder::ended();
  }
  return builder.take();
}

}  // namespace phantom::voxelise
