#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::voxelise {

/// A body for a distance field: its mesh where it really stands.
struct FieldBody {
  geometry::TriangleMesh mesh_W;
  std::uint16_t id = 0;  ///< 1…65534
};

struct DistanceFieldOptions {
  double outside_m = 0.060;  ///< farthest distance known outside of the bodies
  double inside_m = 0.030;   ///< deepest distance known inside
  /// Asked every few milliseconds, by several threads at once; "no" ends it with kUnavailable.
  std::function<bool()> keep_going;
};

/// Signed distance to the nearest of a set of bodies (negative inside), sampled at the voxel centres of a
/// grid in a band around their surfaces and interpolated in between. Kept in cubes of 8³ samples of which
/// only those in the band exist. Error: interpolation (second order in the voxel size, first order across
/// edges and thin plates) plus, farther than a voxel from the
/// surface, up to a twentieth of a voxel. Bodies that overlap: the least of their signed distances.
/// Immutable after building; lookups are real-time safe and thread-safe.
class DistanceField {
 public:
  DistanceField() = default;
  /// Builds the field. Refuses bands that are not positive or wider than 64 voxels, and meshes out of all
  /// proportion. kUnavailable: options.keep_going said no.
  static core::Expected<DistanceField> build(const workspace::GridSpec& grid,
                                             const std::vector<FieldBody>& bodies,
                                             const DistanceFieldOptions& options = {});

  /// The field as a zstd frame with a checksum, in the host's byte order: to be kept on the host that built
  /// it. Throws std::runtime_error if zstd fails.
  std::vector<std::uint8_t> encode() const;
  /// Back from encode(). Refuses what is damaged, cut short or no field; nothing it accepts makes a lookup
  /// leave its memory.
  static core::Expected<DistanceField> decode(std::span<const std::uint8_t> frame);

  /// Distance in metres at a point of W, from −inside_m to +outside_m (the bounds stand for "at least that
  /// far"). Points outside the grid are free space: outside_m. Not finite: outside_m. Real-time safe.
  double distance_m(const Eigen::Vector3d& p_W_m) const noexcept;
  /// Gradient of distance_m: of about unit length, pointing out of the body; zero where the band ends and at
  /// points where the distance has no slope. Real-time safe.
  Eigen::Vector3d gradient(const Eigen::Vector3d& p_W_m) const noexcept;
  /// Id of the body nearest to the voxel in which the point lies; 0 outside the band. Real-time safe.
  std::uint16_t object(const Eigen::Vector3d& p_W_m) const noexcept;

  const workspace::GridSpec& grid() const noexcept { return grid_; }
  double outside_m() const noexcept { return outside_m_; }
  double inside_m() const noexcept { return inside_m_; }
  std::size_t bytes() const noexcept;

 private:
  friend class DistanceFieldBuilder;
  struct EncodedHeader;
  static constexpr std::int32_t kEdge = 8;              // samples along a cube
  static constexpr std::size_t kCubeVoxels = 512;       // kEdge³
  static constexpr std::int32_t kFar = -1, kDeep = -2;  // cubes without samples
  std::size_t cube_index(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept;
  double sample_m(workspace::Index3 v) const noexcept;

  workspace::GridSpec grid_;
  double outside_m_ = 0.0, inside_m_ = 0.0, quantum_m_ = 1.0;
  std::array<std::int32_t, 3> size_cubes_{0, 0, 0};
  std::vector<std::int32_t> directory_;  // number of a cube's samples, or kFar or kDeep
  std::vector<std::int16_t> samples_;    // distance in quanta
  std::vector<std::uint16_t> objects_;
};

}  // namespace phantom::voxelise
