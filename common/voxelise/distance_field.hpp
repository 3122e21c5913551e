#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::voxelise {

/// A body of a distance field: its mesh at its real pose.
struct FieldBody {
  geometry::TriangleMesh mesh_W;
  std::uint16_t id = 0;  ///< 1…65534
};

struct DistanceFieldOptions {
  double outside_m = 0.060;  ///< greatest distance stored outside the bodies
  double inside_m = 0.030;   ///< greatest depth stored inside
  /// Called every few milliseconds, by several threads at once; returning false ends the build with
  /// kUnavailable.
  std::function<bool()> keep_going;
};

/// Holds the signed distance to the nearest of a set of bodies (negative inside). It is sampled at the voxel
/// centres of a grid in a band around the surfaces, and interpolated between them. It is stored in cubes of
/// 8³ samples, of which only those in the band exist. Where bodies overlap, the distance is the least of
/// their signed distances. The error is that of the interpolation (second order in the voxel size, first
/// order across edges and thin plates). Immutable after building; lookups are real-time safe and thread-safe.
class DistanceField {
 public:
  DistanceField() = default;
  /// Builds the field. Refuses bands that are not positive or wider than 64 voxels, and meshes that reach too
  /// far. Returns kUnavailable if options.keep_going returned false.
  static core::Expected<DistanceField> build(const workspace::GridSpec& grid,
                                             const std::vector<FieldBody>& bodies,
                                             const DistanceFieldOptions& options = {});

  /// Encodes the field as a zstd frame with a checksum, in the host's byte order, for use on the same host
  /// only. Throws std::runtime_error if zstd fails.
  std::vector<std::uint8_t> encode() const;
  /// Decodes the bytes of encode(). Refuses bytes that are damaged, truncated or not a field. A lookup in an
  /// accepted field never reads outside its memory.
  static core::Expected<DistanceField> decode(std::span<const std::uint8_t> frame);

  /// Returns the distance in metres at a point of W, from −inside_m to +outside_m; these bounds mean "at
  /// least that far". Points outside the grid are free space and give outside_m, as do points that are not
  /// finite. Real-time safe.
  double distance_m(const Eigen::Vector3d& p_W_m) const noexcept;
  /// Returns the gradient of distance_m: of about unit length, pointing out of the body; zero where the band
  /// ends and at points where the distance has no slope. Real-time safe.
  Eigen::Vector3d gradient(const Eigen::Vector3d& p_W_m) const noexcept;
  /// Returns the id of the body nearest to the voxel in which the point lies; 0 outside the band. Real-time
  /// safe.
  std::uint16_t object(const Eigen::Vector3d& p_W_m) const noexcept;

  const workspace::GridSpec& grid() const noexcept { return grid_; }
  double outside_m() const noexcept { return outside_m_; }
  double inside_m() const noexcept { return inside_m_; }
  std::size_t bytes() const noexcept;

 private:
  friend class DistanceFieldBuilder;
  struct EncodedHeader;
  static constexpr std::size_t kCubeVoxels = 512;       // 8³
  static constexpr std::int32_t kFar = -1, kDeep = -2;  // cubes without samples: far outside, deep inside

  DistanceField(const workspace::GridSpec& grid, double outside_m, double inside_m, double quantum_m)
      : grid_(grid), outside_m_(outside_m), inside_m_(inside_m), quantum_m_(quantum_m) {
    for (std::size_t i = 0; i < 3; ++i) cubes_.size[i] = (grid.size_vox[i] + 7) / 8;
  }
  std::size_t cube_index(workspace::Index3 v) const noexcept {
    return cubes_.index({v.x >> 3, v.y >> 3, v.z >> 3});
  }
  static std::size_t offset_in_cube(workspace::Index3 v) noexcept {
    return static_cast<std::size_t>((v.z & 7) << 6 | (v.y & 7) << 3 | (v.x & 7));
  }
  double sample_m(workspace::Index3 v) const noexcept;

  workspace::GridSpec grid_;
  double outside_m_ = 0.0, inside_m_ = 0.0, quantum_m_ = 1.0;
  workspace::VoxelBox cubes_;
  std::vector<std::int32_t> directory_;  // number of the cube in samples_, or kFar or kDeep
  std::vector<std::int16_t> samples_;    // distance in quanta
  std::vector<std::uint16_t> objects_;
};

}  // namespace phantom::voxelise
