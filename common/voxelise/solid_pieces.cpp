#include "common/voxelise/solid_pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/voxelise/voxelise.hpp"

namespace phantom::voxelise {
namespace {

constexpr double kLongest_cells = 8.0;
constexpr std::int32_t kAcross_vox = 64;  // along each side
constexpr double kThinnest = 1e-4;        // of the longest side: a sheet

/// Cells and voxels of a box: a cell has a whole number of voxels along each side, which need be no cube.
struct CellGrid {
  workspace::GridSpec voxels;
  std::array<std::int32_t, 3> voxels_per_cell{}, cells{};
  double cell_m = 0.0;

  explicit CellGrid(const geometry::BoundingBox& box) {
    Eigen::Vector3d size_m = (box.max_m - box.min_m).cast<double>();
    const double longest_m = size_m.maxCoeff();
    size_m = size_m.cwiseMax(kThinnest * longest_m);
    double cell_m3 = size_m.prod();
    for (std::size_t k = 0; k < 3; ++k) {
      const double share = size_m[static_cast<Eigen::Index>(k)] / longest_m;
      cells[k] = 1 << static_cast<int>(std::max(0.0, std::round(std::log2(kLongest_cells * share))));
      voxels_per_cell[k] = kAcross_vox / cells[k];
      cell_m3 /= cells[k];
    }
    voxels = {box.min_m.cast<double>(),
              workspace::VoxelSize(Eigen::Vector3d(size_m / kAcross_vox)),
              {kAcross_vox, kAcross_vox, kAcross_vox}};
    cell_m = std::cbrt(cell_m3);
  }
};

}  // namespace

core::Expected<SolidPieces> solid_pieces(const geometry::TriangleMesh& mesh) {
  const geometry::BoundingBox box = mesh.bounding_box();
  SolidPieces result;
  if (!box.finite) return core::Status::invalid_argument("a coordinate of the mesh is no number");
  if (box.empty() || !((box.max_m - box.min_m).maxCoeff() > 0.0F)) return result;
  const CellGrid grid(box);
  const auto solid = voxelise(mesh, grid.voxels, workspace::VoxelBox::of(grid.voxels));
  if (!solid) return solid.status();
  result.closed = solid->report.closed;
  const double voxel_m3 = grid.voxels.voxel_size_m.sides_m().prod();
  workspace::VoxelBox{{0, 0, 0}, grid.cells}.for_each([&](workspace::Index3 cell) {
    SolidPiece piece{Eigen::Vector3d::Zero(), 0.0, grid.cell_m};
    const workspace::Index3 first{cell.x * grid.voxels_per_cell[0], cell.y * grid.voxels_per_cell[1],
                                  cell.z * grid.voxels_per_cell[2]};
    double count = 0.0;
    workspace::VoxelBox{first, grid.voxels_per_cell}
        .intersection(solid->box)
        .for_each([&](workspace::Index3 voxel) {
          if (!solid->inside.get(voxel - solid->box.min)) return;
          count += 1.0;
          piece.centre_m += grid.voxels.centre_of(voxel);
        });
    if (count == 0.0) return;
    piece.centre_m /= count;
    piece.volume_m3 = count * voxel_m3;
    result.pieces.push_back(piece);
  });
  return result;
}

}  // namespace phantom::voxelise
