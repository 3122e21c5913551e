#include <algorithm>
#include <cmath>
#include <deque>
#include <future>
#include <string>
#include <thread>

#include "common/voxelise/distance_field.hpp"
#include "common/voxelise/triangle_tree.hpp"
#include "common/voxelise/voxelise.hpp"

namespace phantom::voxelise {

/// Adds bodies to a field, one after the other.
class DistanceFieldBuilder {
 public:
  DistanceFieldBuilder(const workspace::GridSpec& grid, const DistanceFieldOptions& options)
      : options_(options),
        reach_m_(std::max(options.outside_m, options.inside_m)),
        field_(grid, options.outside_m, options.inside_m, reach_m_ / 32767.0) {
    field_.directory_.assign(field_.cubes_.voxel_count(), DistanceField::kFar);
  }

  /// A body's distances in a cube of the field, in quanta.
  struct Cube {
    workspace::Index3 corner;
    std::array<std::int16_t, DistanceField::kCubeVoxels> quanta;
  };
  /// The part of the work that can be done for several bodies at once: everything but the merge. Leaves out
  /// cubes that are wholly far outside.
  core::Expected<std::vector<Cube>> cubes_of(const FieldBody& body) const {
    const workspace::GridSpec& grid = field_.grid_;
    if (!goes_on()) return ended();
    auto solid = voxelise(body.mesh_W, grid, workspace::VoxelBox::of(grid));
    if (!solid) {
      return core::Status(solid.status().code(),
                          "body " + std::to_string(body.id) + ": " + solid.status().message());
    }
    std::vector<Cube> cubes;
    if (body.mesh_W.triangles.empty()) return cubes;
    const TriangleTree tree(body.mesh_W, grid);
    const auto reach = static_cast<std::int32_t>(std::ceil(reach_m_ / grid.voxel_size_m)) + 2;
    const workspace::VoxelBox region = voxel_bounds(body.mesh_W.bounding_box(), grid)
                                           .grown(reach)
                                           .intersection(workspace::VoxelBox::of(grid));
    if (region.empty()) return cubes;
    const auto cube_at = [](workspace::Index3 v) { return workspace::Index3{v.x >> 3, v.y >> 3, v.z >> 3}; };
    const workspace::VoxelBox all =
        workspace::VoxelBox::between(cube_at(region.min), cube_at(region.end() + workspace::Index3{7, 7, 7}));
    bool on = true;
    all.for_each([&](workspace::Index3 cube) { on = on && add_cube(8 * cube, *solid, tree, cubes); });
    if (!on) return ended();
    return cubes;
  }

  static core::Status ended() { return {core::ErrorCode::kUnavailable, "distance field: was told to end"}; }

  /// Merges a body's distances into the field.
  void merge(const std::vector<Cube>& cubes, std::uint16_t id) {
    const std::int16_t out = outside(), in = inside();
    for (const Cube& cube : cubes) {
      std::int32_t& entry = field_.directory_[field_.cube_index(cube.corner)];
      if (entry == DistanceField::kDeep) continue;
      if (std::all_of(cube.quanta.begin(), cube.quanta.end(), [&](std::int16_t q) { return q == in; })) {
        entry = DistanceField::kDeep;
        continue;
      }
      if (entry == DistanceField::kFar) {
        entry = static_cast<std::int32_t>(field_.samples_.size() / DistanceField::kCubeVoxels);
        field_.samples_.resize(field_.samples_.size() + DistanceField::kCubeVoxels, out);
        field_.objects_.resize(field_.samples_.size(), 0);
      }
      const std::size_t base = static_cast<std::size_t>(entry) * DistanceField::kCubeVoxels;
      for (std::size_t i = 0; i < DistanceField::kCubeVoxels; ++i) {
        if (cube.quanta[i] >= field_.samples_[base + i]) continue;
        field_.samples_[base + i] = cube.quanta[i];
        field_.objects_[base + i] = id;
      }
    }
  }

  DistanceField take() { return std::move(field_); }

 private:
  bool goes_on() const { return !options_.keep_going || options_.keep_going(); }
  std::int16_t outside() const {
    return static_cast<std::int16_t>(std::lround(field_.outside_m_ / field_.quantum_m_));
  }
  std::int16_t inside() const {
    return static_cast<std::int16_t>(-std::lround(field_.inside_m_ / field_.quantum_m_));
  }

  /// Adds the cube with this corner unless it is far outside. Returns false if keep_going ended the build.
  bool add_cube(workspace::Index3 corner, const SolidVoxels& solid, const TriangleTree& tree,
                std::vector<Cube>& cubes) const {
    const auto is_inside = [&](workspace::Index3 v) {
      return solid.box.contains(v) && solid.inside.get(v - solid.box.min);
    };
    constexpr double kRadius_vox = 3.5 * 1.7320509;  // from a cube's centre to its farthest voxel's
    const double quanta_per_vox = field_.grid_.voxel_size_m / field_.quantum_m_,
                 limit_vox = reach_m_ / field_.grid_.voxel_size_m + kRadius_vox;
    const std::int16_t out = outside(), in = inside();
    Cube cube{corner, {}};
    const Eigen::Vector3d centre = workspace::vector(corner).array() + 4.0;
    NearestPoint nearest = tree.nearest(centre, limit_vox);
    if (!(nearest.distance_vox <= limit_vox)) {  // no surface near: the whole cube is inside or outside
      cube.quanta.fill(in);
      if (is_inside(corner)) cubes.push_back(cube);
      return true;
    }
    if (!goes_on()) return false;
    bool far = true;
    workspace::VoxelBox{corner, {8, 8, 8}}.for_each([&](workspace::Index3 v) {
      nearest = tree.nearest_with_guess(workspace::vector(v).array() + 0.5, nearest.triangle);
      const auto quanta = static_cast<std::int32_t>(std::lround(nearest.distance_vox * quanta_per_vox));
      const auto value = static_cast<std::int16_t>(is_inside(v) ? std::max<std::int32_t>(in, -quanta)
                                                                : std::min<std::int32_t>(out, quanta));
      cube.quanta[DistanceField::offset_in_cube(v)] = value;
      far = far && value == out;
    });
    if (!far) cubes.push_back(cube);
    return true;
  }

  const DistanceFieldOptions& options_;
  double reach_m_;
  DistanceField field_;
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
  using Result = core::Expected<std::vector<DistanceFieldBuilder::Cube>>;
  std::deque<std::future<Result>> ahead;
  const std::size_t most_ahead = std::max(1U, std::thread::hardware_concurrency());
  std::size_t started = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (; started < std::min(bodies.size(), i + most_ahead); ++started) {
      ahead.push_back(std::async(std::launch::async,
                                 [&builder, &body = bodies[started]] { return builder.cubes_of(body); }));
    }
    const Result cubes = ahead.front().get();
    ahead.pop_front();
    if (!cubes) return cubes.status();
    builder.merge(*cubes, bodies[i].id);
  }
  return builder.take();
}

}  // namespace phantom::voxelise
