#include "common/layers/fidelity.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/parallel.hpp"
#include "common/voxelise/triangle_tree.hpp"

namespace phantom::layers {
namespace {

/// Returns how far out a voxel lies: 0 the body, 1 the guard, 1 + i layer i; free space is beyond them all.
int rank_of(std::int8_t order, int layers) {
  if (order == workspace::kOrderFree) return layers + 2;
  if (order == workspace::kOrderGuard) return 1;
  return order > 0 && order < workspace::kOrderGuard ? order + 1 : 0;
}

Side side_of(const Eigen::Vector3d& away) {
  Eigen::Vector3d most = away.cwiseAbs();
  Eigen::Index axis = 0;
  const double one = most.maxCoeff(&axis);
  std::sort(most.begin(), most.end());
  const double two = (most[1] + most[2]) / std::sqrt(2.0), three = most.sum() / std::sqrt(3.0);
  if (three > one && three > two) return Side::kCorner;
  if (two > one) return Side::kEdge;
  return static_cast<Side>(2 * axis + (away[axis] > 0 ? 1 : 0));
}

/// Sums of deviations.
struct Sums {
  std::size_t faces = 0;
  double sum = 0.0, squares = 0.0, least = 1e30, most = -1e30;

  void add(double deviation) {
    ++faces;
    sum += deviation;
    squares += deviation * deviation;
    least = std::min(least, deviation);
    most = std::max(most, deviation);
  }
  void add(const Sums& other) {
    faces += other.faces;
    sum += other.sum;
    squares += other.squares;
    least = std::min(least, other.least);
    most = std::max(most, other.most);
  }
  Deviation result() const {
    if (faces == 0) return {};
    const auto n = static_cast<double>(faces);
    return {faces, sum / n, std::sqrt(squares / n), least, most};
  }
};

using LayerSums = std::array<Sums, kSides>;

/// Visits all faces between the voxels of one slice and their neighbours at lower addresses.
class SliceFaces {
 public:
  SliceFaces(const voxelise::TriangleTree& tree, const workspace::Workspace& workspace,
             const std::vector<double>& offsets)
      : tree_(tree),
        workspace_(workspace),
        stretch_(workspace.grid().voxel_size_m.stretch()),
        offsets_(offsets),
        sums(offsets.size()) {}

  void measure(std::int32_t z) {
    const auto& size = workspace_.grid().size_vox;
    const int layers = static_cast<int>(offsets_.size()) - 2;
    for (std::int32_t y = 0; y <= size[1]; ++y) {
      for (std::int32_t x = 0; x <= size[0]; ++x) {
        const workspace::Index3 v{x, y, z};
        const int here = rank_of(workspace_.order(v), layers);
        for (const workspace::Index3 step : {workspace::Index3{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
          face(here, rank_of(workspace_.order(v - step), layers),
               workspace::vector(v).array() + 0.5 * (1 - workspace::vector(step).array()));
        }
      }
    }
  }

 private:
  void face(int a, int b, const Eigen::Vector3d& middle) {
    if (a == b) return;
    // This is the outer face of every layer to which one side belongs and the other does not.
    const int inner = std::max(1, std::min(a, b)),
              outer = std::min(std::max(a, b), static_cast<int>(offsets_.size()));
    if (inner >= outer) return;
    const Eigen::Vector3d place = middle.cwiseProduct(stretch_);
    const voxelise::NearestPoint nearest = tree_.nearest_with_guess(place, guess_);
    guess_ = nearest.triangle;
    const auto side = static_cast<std::size_t>(side_of(place - nearest.point_vox));
    for (int rank = inner; rank < outer; ++rank) {
      const auto layer = static_cast<std::size_t>(rank);
      sums[layer][side].add(nearest.distance_vox - offsets_[layer]);
    }
  }

  const voxelise::TriangleTree& tree_;
  const workspace::Workspace& workspace_;
  Eigen::Vector3d stretch_;
  const std::vector<double>& offsets_;  // by rank
  std::uint32_t guess_ = 0;

 public:
  std::vector<LayerSums> sums;  // by rank
};

}  // namespace

const char* name_of(Side side) {
  constexpr const char* kNames[kSides] = {"-x", "+x", "-y", "+y", "-z", "+z", "edges", "corners"};
  return kNames[static_cast<std::size_t>(side)];
}

std::vector<LayerFidelity> measure_fidelity(const geometry::TriangleMesh& mesh_W,
                                            const workspace::LayerProfile& profile,
                                            const workspace::Workspace& workspace, int threads) {
  const voxelise::TriangleTree tree(mesh_W, workspace.grid());
  if (tree.empty()) return {};
  std::vector<double> offsets{0.0, static_cast<double>(profile.guard_vox)};
  for (const int thickness : profile.thickness_vox) offsets.push_back(offsets.back() + thickness);
  const auto slices = static_cast<std::size_t>(workspace.grid().size_vox[2]) + 1;
  std::vector<std::vector<LayerSums>> by_slice(slices);
  core::parallel_for(threads, slices, [&](std::size_t z, std::size_t) {
    SliceFaces faces(tree, workspace, offsets);
    faces.measure(static_cast<std::int32_t>(z));
    by_slice[z] = std::move(faces.sums);
  });
  std::vector<LayerFidelity> report;
  for (std::size_t rank = profile.guard_vox > 0 ? 1 : 2; rank < offsets.size(); ++rank) {
    LayerFidelity layer;
    layer.order = rank == 1 ? int{workspace::kOrderGuard} : static_cast<int>(rank) - 1;
    layer.offset_vox = offsets[rank];
    Sums whole;
    for (std::size_t side = 0; side < kSides; ++side) {
      Sums sums;
      for (const auto& slice : by_slice) sums.add(slice[rank][side]);
      whole.add(sums);
      layer.by_side[side] = sums.result();
    }
    layer.whole = whole.result();
    report.push_back(layer);
  }
  return report;
}

}  // namespace phantom::layers
