#include <algorithm>
#include <cmath>
#include <string>

#include "common/voxel/distance_field.hpp"
#include "common/voxel/nearest_triangles.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {
namespace {

constexpr std::int32_t kTile = 64;  // voxels along a tile of work; a multiple of the field's cubes
constexpr double kQuanta = 32767.0;

}  // namespace

/// Adds bodies one after the other to a field.
class DistanceFieldBuilder {
 public:
  DistanceFieldBuilder(const GridSpec& grid, const DistanceFieldOptions& options) {
    field_.grid_ = grid;
    field_.outside_m_ = options.outside_m;
    field_.inside_m_ = options.inside_m;
    field_.quantum_m_ = std::max(options.outside_m, options.inside_m) / kQuanta;
    for (std::size_t i = 0; i < 3; ++i) field_.size_cubes_[i] = (grid.size_vox[i] + 7) / 8;
    field_.directory_.assign(field_.cube_index(0, 0, field_.size_cubes_[2]), DistanceField::kFar);
    reach_vox_ =
        std::max(options.outside_m, options.inside_m) / grid.voxel_size_m + 1.0;  // one for interpolation
  }

  core::Status add(const FieldBody& body) {
    const GridSpec& grid = field_.grid_;
    auto solid = voxelise(body.mesh_W, grid, VoxelBox::of(grid));
    if (!solid) return solid.status();
    solid_ = &*solid;
    id_ = body.id;
    vertices_vox_.clear();
    for (const auto& vertex : body.mesh_W.vertices_m) {
      vertices_vox_.push_back(((vertex.cast<double>() - grid.origin_m) / grid.voxel_size_m).cast<float>());
    }
    const auto halo = static_cast<std::int32_t>(std::ceil(reach_vox_)) + 1;
    const VoxelBox region = voxel_bounds(body.mesh_W, grid).grown(halo).intersection(VoxelBox::of(grid));
    if (region.empty()) return core::Status::ok();
    sort_into_tiles(body.mesh_W, region, halo);
    detail::NearestTriangles nearest(vertices_vox_, body.mesh_W.triangles, static_cast<float>(reach_vox_));
    std::size_t tile = 0;
    Index3 t;
    for (t.z = first_.z; t.z <= last_.z; ++t.z) {
      for (t.y = first_.y; t.y <= last_.y; ++t.y) {
        for (t.x = first_.x; t.x <= last_.x; ++t.x, ++tile) {
          const VoxelBox box =
              VoxelBox{{t.x * kTile, t.y * kTile, t.z * kTile}, {kTile, kTile, kTile}}.intersection(
                  VoxelBox::of(grid));
          const bool near = !lists_[tile].empty();
          if (near) nearest.compute(box.grown(halo).intersection(region), lists_[tile]);
          take_tile(box.intersection(cube_aligned(region)), near ? &nearest : nullptr, region);
        }
      }
    }
    return core::Status::ok();
  }

  DistanceField take() { return std::move(field_); }

 private:
  /// The region's cubes, whole, within the grid.
  VoxelBox cube_aligned(const VoxelBox& region) const {
    const auto down = [](std::int32_t v) { return v & ~7; };
    const Index3 min{down(region.min.x), down(region.min.y), down(region.min.z)};
    return VoxelBox{
        min,
        {down(region.min.x + region.size[0] + 7) - min.x, down(region.min.y + region.size[1] + 7) - min.y,
         down(region.min.z + region.size[2] + 7) - min.z}}
        .intersection(VoxelBox::of(field_.grid_));
  }

  /// Lists, per tile of the region, the triangles that come within the halo of it.
  void sort_into_tiles(const geometry::TriangleMesh& mesh, const VoxelBox& region, std::int32_t halo) {
    first_ = {region.min.x / kTile, region.min.y / kTile, region.min.z / kTile};
    last_ = {(region.min.x + region.size[0] - 1) / kTile, (region.min.y + region.size[1] - 1) / kTile,
             (region.min.z + region.size[2] - 1) / kTile};
    const std::int32_t count[3] = {last_.x - first_.x + 1, last_.y - first_.y + 1, last_.z - first_.z + 1};
    const std::int32_t origin[3] = {first_.x, first_.y, first_.z};
    lists_.assign(static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
                      static_cast<std::size_t>(count[2]),
                  {});
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      const Eigen::Vector3f &a = vertices_vox_[t[0]], &b = vertices_vox_[t[1]], &c = vertices_vox_[t[2]];
      const Eigen::Vector3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
      std::int32_t from[3], to[3];
      for (int axis = 0; axis < 3; ++axis) {
        const float reach = static_cast<float>(halo);
        from[axis] =
            std::max(0, static_cast<std::int32_t>(std::floor((low[axis] - reach) / kTile)) - origin[axis]);
        to[axis] =
            std::min(count[axis] - 1,
                     static_cast<std::int32_t>(std::floor((high[axis] + reach) / kTile)) - origin[axis]);
      }
      for (std::int32_t z = from[2]; z <= to[2]; ++z) {
        for (std::int32_t y = from[1]; y <= to[1]; ++y) {
          for (std::int32_t x = from[0]; x <= to[0]; ++x) {
            lists_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(count[1]) +
                    static_cast<std::size_t>(y)) *
                       static_cast<std::size_t>(count[0]) +
                   static_cast<std::size_t>(x)]
                .push_back(i);
          }
        }
      }
    }
  }

  bool inside(Index3 v) const {
    const VoxelBox& box = solid_->box;
    const std::int32_t x = v.x - box.min.x, y = v.y - box.min.y, z = v.z - box.min.z;
    return x >= 0 && y >= 0 && z >= 0 && x < box.size[0] && y < box.size[1] && z < box.size[2] &&
           solid_->inside.get(x, y, z);
  }

  /// Merges the body's distances in the tile's cubes into the field.
  void take_tile(const VoxelBox& box, const detail::NearestTriangles* nearest, const VoxelBox& region) {
    Index3 cube;
    for (cube.z = box.min.z; cube.z < box.min.z + box.size[2]; cube.z += 8) {
      for (cube.y = box.min.y; cube.y < box.min.y + box.size[1]; cube.y += 8) {
        for (cube.x = box.min.x; cube.x < box.min.x + box.size[0]; cube.x += 8)
          take_cube(cube, nearest, region);
      }
    }
  }

  void take_cube(Index3 corner, const detail::NearestTriangles* nearest, const VoxelBox& region) {
    std::array<std::int16_t, 512> values;
    const auto out = static_cast<std::int16_t>(std::lround(field_.outside_m_ / field_.quantum_m_));
    const auto in = static_cast<std::int16_t>(-std::lround(field_.inside_m_ / field_.quantum_m_));
    bool all_out = true, all_in = true;
    const Index3 end{region.min.x + region.size[0], region.min.y + region.size[1],
                     region.min.z + region.size[2]};
    for (std::int32_t i = 0; i < 512; ++i) {
      const Index3 v{corner.x + (i & 7), corner.y + (i >> 3 & 7), corner.z + (i >> 6)};
      double distance_vox = std::numeric_limits<double>::infinity();
      const bool computed = v.x >= region.min.x && v.y >= region.min.y && v.z >= region.min.z &&
                            v.x < end.x && v.y < end.y && v.z < end.z;
      if (nearest != nullptr && computed) distance_vox = static_cast<double>(nearest->distance_vox(v));
      const double quanta = distance_vox * field_.grid_.voxel_size_m / field_.quantum_m_;
      std::int16_t& value = values[static_cast<std::size_t>(i)];
      if (inside(v)) {
        value = quanta >= -in ? in : static_cast<std::int16_t>(-std::lround(quanta));
      } else {
        value = quanta >= out ? out : static_cast<std::int16_t>(std::lround(quanta));
      }
      all_out = all_out && value == out;
      all_in = all_in && value == in;
    }
    std::int32_t& entry = field_.directory_[field_.cube_index(corner.x >> 3, corner.y >> 3, corner.z >> 3)];
    if (all_out || entry == DistanceField::kDeep) return;
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
      field_.objects_[base + i] = id_;
    }
  }

  DistanceField field_;
  double reach_vox_ = 0.0;
  const SolidVoxels* solid_ = nullptr;
  std::uint16_t id_ = 0;
  std::vector<Eigen::Vector3f> vertices_vox_;
  Index3 first_, last_;  // tiles
  std::vector<std::vector<std::uint32_t>> lists_;
};

core::Expected<DistanceField> DistanceField::build(const GridSpec& grid, const std::vector<FieldBody>& bodies,
                                                   const DistanceFieldOptions& options) {
  for (const double width_m : {options.outside_m, options.inside_m}) {
    if (!(width_m > 0 && width_m <= 64 * grid.voxel_size_m)) {
      return core::Status::invalid_argument("distance field: a band of " + std::to_string(width_m) +
                                            " m; allowed: above 0, up to 64 voxels");
    }
  }
  DistanceFieldBuilder builder(grid, options);
  for (const FieldBody& body : bodies) {
    if (core::Status added = builder.add(body); !added) {
      return core::Status(added.code(), "body " + std::to_string(body.id) + ": " + added.message());
    }
  }
  return builder.take();
}

}  // namespace phantom::voxel
