#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/workspace.hpp"

// What of a workspace people look at: where each object's fluid is, its layers as shells, and a section of
// it.

namespace phantom::workspace {

/// Stands for all objects together.
inline constexpr std::uint16_t kEveryObject = 0;

/// Returns how deep a voxel of this order lies, as a rank that rises on the way into a body: layers from the
/// outermost inwards, guard, boundary, layers inside the body, interior. Free space has the least.
constexpr int depth_of(std::int8_t order) noexcept {
  if (order == kOrderFree) return -128;
  if (order == kOrderInterior) return 127;
  if (order == kOrderBoundary) return 1;
  if (order == kOrderGuard) return 0;
  return order > 0 ? -order : 1 - order;
}

/// The voxels of an object that are not free.
struct ObjectFluid {
  std::uint16_t object = 0;
  VoxelBox box;                                ///< the smallest that holds them
  std::map<std::int8_t, std::uint8_t> mu_code; /*!< greatest μ code by order; the orders that it has */
};
/// Returns the fluid of every object that has any voxel, by rising id. Not real-time safe.
std::vector<ObjectFluid> fluids_of(const Workspace& workspace);

/// A rectangle of faces of voxels, all in one plane and all turned to the same side. Twelve octets.
struct ShellFace {
  std::array<std::uint16_t, 3> corner{};  ///< its least corner, in voxel edges from the grid's origin
  std::array<std::uint16_t, 2>
      size{};             ///< in voxels, along the next axis after its normal's, and the one after
  std::uint8_t side = 0;  ///< axis of the normal × 2, + 1 where that points to lower coordinates
  std::int8_t order = 0;  ///< of the shell

  friend bool operator==(const ShellFace&, const ShellFace&) = default;
};
static_assert(sizeof(ShellFace) == 12);

/// Returns the surface of the voxels of `object` (kEveryObject: of any) that lie as deep as `order` or
/// deeper, within `box` inside the grid: each face between such a voxel and one that is none lies in one
/// rectangle. Shells of lower depth enclose those of higher. kResourceExhausted if there were more than
/// `most_faces` rectangles. Takes time and memory as `box` has voxels, and as a plane of it has; not
/// real-time safe.
core::Expected<std::vector<ShellFace>> shell_of(const Workspace& workspace, const VoxelBox& box,
                                                std::uint16_t object, std::int8_t order,
                                                std::size_t most_faces);

/// Returns the orders of the voxels of `object` (kEveryObject: of any) in the plane of `box` whose address
/// along `axis` (0…2) is `at`, those of other objects as free; the next axis fastest, then the one after.
/// `at` outside the grid: all free. Not real-time safe.
std::vector<std::int8_t> section_of(const Workspace& workspace, const VoxelBox& box, std::uint16_t object,
                                    std::size_t axis, std::int32_t at);

}  // namespace phantom::workspace
