#pragma once

#include <algorithm>

#include "common/geometry/mesh/mesh.hpp"
#include "common/voxelise/voxelise.hpp"
#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::layers {

/// Returns the part of space in which a body must be voxelised so that its layers are right inside the grid.
inline workspace::VoxelBox voxelise_clip(const workspace::GridSpec& grid,
                                         const workspace::LayerProfile& profile) {
  return workspace::VoxelBox::of(grid).grown(std::max(profile.reach_vox(), profile.inside_depth_vox()));
}

/// Lays layers by the `distance` method (spec 1.4). Let d be the Euclidean distance in voxels from a voxel's
/// centre to the nearest solid voxel's centre, j the guard and W_i = m_1 + … + m_i. Then a voxel is guard for
/// 0 < d ≤ j and has order i for j + W_{i−1} < d ≤ j + W_i. If voxels are no cubes, d is in reference lengths
/// (workspace::VoxelSize), of which `stretch` gives the sides; so d, j and W_i are lengths in metres, divided
/// by that length. Exact: of cubes, integers only; of others, d is in double precision and a limit holds to
/// 5e-10 of itself. Computes the bricks of `part`, a part of the grid with corners at whole bricks. The solid
/// must be known within the profile's reach around it. The profile must have been checked. Time: linear in
/// the bricks around the solid. Memory: those bricks, and a few MiB for each thread. The same for any number
/// of threads. Not real-time safe.
workspace::ObjectBricks distance_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options = {},
                                        const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones());

/// Lays layers by the `surface` method (spec 1.4): like distance_bricks(), but d is the distance from a
/// voxel's centre to the nearest point of the mesh itself, however coarse the voxels. Boundary and interior
/// are the solid's. Exact except for rounding in double precision. `mesh_W` is the surface from which `solid`
/// was made. The solid need only be known in `part`, a part of the grid whose lower corner is a brick's. Work
/// space: the mesh as a tree, besides the bricks. Not real-time safe.
workspace::ObjectBricks surface_bricks(const geometry::TriangleMesh& mesh_W,
                                       const voxelise::SolidVoxels& solid,
                                       const workspace::LayerProfile& profile,
                                       const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                                       const workspace::WorkOptions& options = {});

/// Returns whether the shaping element of size m contains the cell at (i, j, k) from its centre (thesis
/// 4.6.3b, 4.7.2; spec 1.4).
bool in_element(workspace::ShapingElement element, int m, int i, int j, int k);
/// Returns how many rows along x such an element has.
std::uint64_t element_rows(workspace::ShapingElement element, int m);

/// Lays layers by the thesis's method. The element of size m_1 is centred on every boundary voxel, and the
/// empty voxels that it contains get order 1. Then the element of size m_2 is centred on every voxel of order
/// 1, and so on. Interior voxels are not empty. With a guard of j voxels, every empty voxel whose centre is
/// at most j voxels from the centre of a solid voxel is guard, and layer 1 grows from all guard voxels
/// instead of the boundary. Elements and guard count voxels along each axis, as the thesis has it, also where
/// voxels are no cubes: the layers are as much thicker along an axis as its side is longer.
///
/// Computes the bricks of `part`, a part of the grid whose lower corner is a brick's. The solid must be known
/// within the profile's reach around it. The result is the same for any number of threads and any division of
/// the grid into parts. Work space: three bits for each voxel that the layers reach and, for each thread, a
/// few slices of the element's size. Not real-time safe.
workspace::ObjectBricks dilation_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options = {});

/// Computes all of an object's orders by the method that the profile names: outer layers, guard, boundary,
/// interior, layers inside. `mesh_W` is the surface from which `solid` was made; only the `surface` method
/// uses it. `part` is a part of the grid whose lower corner is a brick's. The solid must be known around it
/// as far as voxelise_clip() says. Empty if options.go_on returned false or the budget is used up, for which
/// layer_steps() count before it begins and the `surface` method its searches besides. Not real-time safe.
workspace::ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                   const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                   const workspace::VoxelBox& part,
                                   const workspace::WorkOptions& options = {});

/// Returns the work of lay_layers(), in steps of a formula (core::WorkBudget), but for the searches of the
/// `surface` method: a step for eight voxels that it goes over (if they are no cubes, for each distance to
/// a row or slice around eight voxels that it compares), and of `dilation` one for each 40 rows of an element
/// that it sets at 64 voxels.
std::uint64_t layer_steps(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                          const workspace::VoxelBox& part,
                          const Eigen::Vector3d& stretch = Eigen::Vector3d::Ones());

/// Lays the layers inside the body, for every method (spec 1.4, error guard; thesis A.5.2). Let d be the
/// exact Euclidean distance from an interior voxel's centre to the centre of the nearest voxel that is not
/// interior, in voxels or, of the grid's voxels that are no cubes, in reference lengths, and D_i the
/// thickness of the first i inner layers. Then a voxel gets order −i where D_{i−1} < d ≤ D_i. Deeper voxels
/// stay interior, and the boundary stays boundary. Changes those voxels of `bricks`, which already hold the
/// outer layers in `part`, as distance_bricks() makes them. The solid must be known within the inner layers'
/// depth around the part. Not real-time safe.
void lay_inside(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                workspace::ObjectBricks& bricks, const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
