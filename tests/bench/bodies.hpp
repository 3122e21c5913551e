#pragma once

#include <vector>

#include "common/layers/activation.hpp"
#include "common/layers/merge.hpp"

namespace phantom::bench {

/// Closed sphere of 2·rings² − 2·rings triangles, as a part exported from CAD would be tessellated.
geometry::TriangleMesh fine_sphere(double radius_m, std::uint32_t rings);

/// Six layers of four voxels.
workspace::LayerProfile six_layers();

/// A sphere that fills a box of `edge_vox` voxels of 5 mm with its layers; and that box.
layers::Body sphere_in_box(int edge_vox, std::uint32_t rings);
workspace::GridSpec sphere_grid(int edge_vox);

/// A cell of `size_m` with `count` objects of many kinds and angles (tables, tubes, tanks, tori), always the
/// same.
std::vector<layers::Body> cell_of(std::size_t count, const Eigen::Vector3d& size_m);

/// A cell of 5 m × 4 m × 4 m with an object about each metre.
std::vector<layers::Body> large_cell();

/// A cell activated: what a server keeps of it.
struct Activated {
  std::vector<workspace::ObjectBricks> bricks;
  std::vector<workspace::CodeTable> codes;
  workspace::Workspace workspace;
  std::vector<layers::MergeEntry> entries(const std::vector<layers::Body>& bodies) const;
};
Activated activate_all(const std::vector<layers::Body>& bodies, const workspace::GridSpec& grid, int threads);

}  // namespace phantom::bench
