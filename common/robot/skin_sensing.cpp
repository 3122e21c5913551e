#include "common/robot/skin_sensing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace phantom::robot {
namespace {

/// Sensors that are worked on together: their intermediate results stay in the first-level cache.
constexpr std::size_t kBlock = 128;
/// Sensors of the greatest μ that are compared by their surroundings, at most.
constexpr std::size_t kCandidates = 32;

std::size_t blocks_of(std::size_t sensors) { return (sensors + kBlock - 1) / kBlock; }

/// Sum of μ along the axes and the space diagonals, out to `reach` voxels: rises voxel by voxel towards the
/// object, also within a layer.
double surroundings(const voxel::Workspace& workspace, voxel::Index3 at, int reach) noexcept {
  static constexpr std::int8_t kDirections[14][3] = {
      {1, 0, 0},  {-1, 0, 0}, {0, 1, 0},   {0, -1, 0}, {0, 0, 1},   {0, 0, -1},  {1, 1, 1},
      {1, 1, -1}, {1, -1, 1}, {1, -1, -1}, {-1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}};
  double sum = 0.0;
  for (const auto& direction : kDirections) {
    for (int step = 1; step <= reach; ++step) {
      sum += static_cast<double>(
          workspace.mu({at.x + step * direction[0], at.y + step * direction[1], at.z + step * direction[2]}));
    }
  }
  return sum;
}

}  // namespace

/// One block of one link: voxel coordinates are r + t with r = R·p/s (W axes, from the link's origin).
struct SkinSensing::Block {
  std::size_t first, count;
  std::array<double, 3> origin_vox;  // of the link's frame in the grid
  double rx[kBlock], ry[kBlock], rz[kBlock];
  double viscosity[kBlock];  // w·μ
};

SkinSensing::SkinSensing(const SkinLayout& layout, const SensingOptions& options)
    : layout_(&layout), options_(options), codes_(layout.size()) {
  std::size_t blocks = 0;
  for (std::size_t link = 0; link + 1 < layout.first.size(); ++link) {
    blocks += blocks_of(layout.first[link + 1] - layout.first[link]);
  }
  block_worst_.resize(blocks);
}

/// μ codes of a block's sensors, free of branches on what is there: places outside the grid are looked up at
/// voxel 0 and masked.
void SkinSensing::look_up(const Block& block, const voxel::Workspace& workspace) noexcept {
  std::uint32_t brick[kBlock], offset[kBlock], mask[kBlock];
  const auto& size = workspace.grid().size_vox;
  const auto nx = static_cast<std::uint32_t>(size[0]), ny = static_cast<std::uint32_t>(size[1]),
             nz = static_cast<std::uint32_t>(size[2]);
  const auto bricks_x = static_cast<std::uint32_t>(workspace.size_bricks()[0]);
  const auto bricks_y = static_cast<std::uint32_t>(workspace.size_bricks()[1]);
  // Truncation rounds towards zero: one voxel up first, one down after, makes it floor() for all that can be
  // inside.
  const double tx = block.origin_vox[0] + 1.0, ty = block.origin_vox[1] + 1.0, tz = block.origin_vox[2] + 1.0;
  for (std::size_t i = 0; i < block.count; ++i) {
    const std::uint32_t x = static_cast<std::uint32_t>(static_cast<std::int32_t>(block.rx[i] + tx)) - 1U;
    const std::uint32_t y = static_cast<std::uint32_t>(static_cast<std::int32_t>(block.ry[i] + ty)) - 1U;
    const std::uint32_t z = static_cast<std::uint32_t>(static_cast<std::int32_t>(block.rz[i] + tz)) - 1U;
    const std::uint32_t inside = (x < nx) & (y < ny) & (z < nz);
    mask[i] = 0U - inside;
    brick[i] = (((z >> 5) * bricks_y + (y >> 5)) * bricks_x + (x >> 5)) & mask[i];
    offset[i] = static_cast<std::uint32_t>(voxel::brick_offset(x & 31U, y & 31U, z & 31U));
  }
  const std::uint32_t* directory = workspace.directory();
  const std::uint8_t* codes = workspace.codes();
  std::uint8_t* out = codes_.data() + block.first;
  for (std::size_t i = 0; i < block.count; ++i) {
    const std::size_t address =
        static_cast<std::size_t>(directory[brick[i]]) * voxel::kBrickVoxels + offset[i];
    out[i] = static_cast<std::uint8_t>(codes[address] & mask[i]);
  }
}

void SkinSensing::add_gradients(const Block& block, const voxel::Workspace& workspace,
                                ViscousSums& sums) noexcept {
  const int reach = options_.gradient_reach_vox;
  const double per_m = 1.0 / (2.0 * reach * workspace.grid().voxel_size_m);
  for (std::size_t i = 0; i < block.count; ++i) {
    const std::size_t sensor = block.first + i;
    if (codes_[sensor] == 0) continue;
    const Eigen::Vector3d r(block.rx[i], block.ry[i], block.rz[i]);
    const voxel::Index3 at{static_cast<std::int32_t>(std::floor(r.x() + block.origin_vox[0])),
                           static_cast<std::int32_t>(std::floor(r.y() + block.origin_vox[1])),
                           static_cast<std::int32_t>(std::floor(r.z() + block.origin_vox[2]))};
    const auto difference = [&](voxel::Index3 up, voxel::Index3 down) {
      return static_cast<double>(workspace.mu(up)) - static_cast<double>(workspace.mu(down));
    };
    const Eigen::Vector3d gradient =
        per_m * Eigen::Vector3d(difference({at.x + reach, at.y, at.z}, {at.x - reach, at.y, at.z}),
                                difference({at.x, at.y + reach, at.z}, {at.x, at.y - reach, at.z}),
                                difference({at.x, at.y, at.z + reach}, {at.x, at.y, at.z - reach}));
    const double weight = layout_->weight[sensor];
    sums.gradient += weight * gradient;
    sums.gradient_moment += weight * Eigen::Vector3d(r.y() * gradient.z() - r.z() * gradient.y(),
                                                     r.z() * gradient.x() - r.x() * gradient.z(),
                                                     r.x() * gradient.y() - r.y() * gradient.x());
    sums.gradient_square +=
        weight * gradient.squaredNorm() / static_cast<double>(workspace.palette()[codes_[sensor]]);
  }
}

void SkinSensing::sense_link(std::size_t link, const geometry::Pose& X_WL,
                             const voxel::Workspace& workspace) noexcept {
  const voxel::GridSpec& grid = workspace.grid();
  const double s = grid.voxel_size_m;
  const Eigen::Matrix3d rotation = X_WL.rotation / s;
  const Eigen::Vector3d origin = (X_WL.translation_m - grid.origin_m) / s;
  // Codes past the palette cannot be: the assembler refuses them. The zeros after it keep the look-up in
  // bounds anyway.
  std::array<double, 256> palette{};
  std::copy(workspace.palette().begin(), workspace.palette().end(), palette.begin());

  Block block;
  block.origin_vox = {origin.x(), origin.y(), origin.z()};
  constexpr std::size_t kLanes = 4;  // independent chains of additions, so that they overlap
  double total[10][kLanes] = {};
  ViscousSums gradients;
  std::size_t active = 0, block_number = 0;
  for (std::size_t l = 0; l < link; ++l) block_number += blocks_of(layout_->first[l + 1] - layout_->first[l]);

  for (std::size_t first = layout_->first[link]; first < layout_->first[link + 1];
       first += kBlock, ++block_number) {
    block.first = first;
    block.count = std::min(kBlock, layout_->first[link + 1] - first);
    const double *x = &layout_->x_m[first], *y = &layout_->y_m[first], *z = &layout_->z_m[first];
    for (std::size_t i = 0; i < block.count; ++i) {
      block.rx[i] = rotation(0, 0) * x[i] + rotation(0, 1) * y[i] + rotation(0, 2) * z[i];
      block.ry[i] = rotation(1, 0) * x[i] + rotation(1, 1) * y[i] + rotation(1, 2) * z[i];
      block.rz[i] = rotation(2, 0) * x[i] + rotation(2, 1) * y[i] + rotation(2, 2) * z[i];
    }
    look_up(block, workspace);
    const std::uint8_t* codes = codes_.data() + first;
    std::uint8_t worst = 0;
    for (std::size_t i = 0; i < block.count; ++i) {
      worst = std::max(worst, codes[i]);
      active += codes[i] != 0 ? 1U : 0U;
      block.viscosity[i] = palette[codes[i]] * layout_->weight[first + i];
    }
    block_worst_[block_number] = worst;
    // Rounded up to whole lanes with sensors that weigh nothing.
    const std::size_t padded = (block.count + kLanes - 1) / kLanes * kLanes;
    for (std::size_t i = block.count; i < padded; ++i) {
      block.rx[i] = block.ry[i] = block.rz[i] = block.viscosity[i] = 0.0;
    }
    for (std::size_t i = 0; i < padded; i += kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const double w = block.viscosity[i + lane];
        const double dx = block.rx[i + lane], dy = block.ry[i + lane], dz = block.rz[i + lane];
        const double wx = w * dx, wy = w * dy, wz = w * dz;
        total[0][lane] += w;
        total[1][lane] += wx;
        total[2][lane] += wy;
        total[3][lane] += wz;
        total[4][lane] += wx * dx;
        total[5][lane] += wx * dy;
        total[6][lane] += wx * dz;
        total[7][lane] += wy * dy;
        total[8][lane] += wy * dz;
        total[9][lane] += wz * dz;
      }
    }
    if (options_.gradient && worst != 0) add_gradients(block, workspace, gradients);
  }

  std::array<double, 10> t;
  for (std::size_t k = 0; k < 10; ++k) t[k] = (total[k][0] + total[k][1]) + (total[k][2] + total[k][3]);
  ViscousSums& sums = sums_[link];
  sums = gradients;
  sums.gradient_moment *= s;  // offsets were in voxels
  sums.mu = t[0];
  sums.mu_d = s * Eigen::Vector3d(t[1], t[2], t[3]);
  sums.mu_dd << t[4], t[5], t[6], t[5], t[7], t[8], t[6], t[8], t[9];
  sums.mu_dd *= s * s;
  active_ += active;
  if (layout_->normalisation == Normalisation::kActive && active > 0)
    sums.scale(1.0 / static_cast<double>(active));
}

/// Looks only into blocks that hold the greatest code; picks evenly among those sensors if there are many.
void SkinSensing::find_worst(const LinkPoses& X_WL, const voxel::Workspace& workspace) noexcept {
  worst_ = {};
  const std::uint8_t greatest =
      block_worst_.empty() ? 0 : *std::max_element(block_worst_.begin(), block_worst_.end());
  if (greatest == 0) return;
  const auto for_each_tie = [&](auto&& visit) {
    std::size_t number = 0;
    for (std::size_t link = 0; link + 1 < layout_->first.size(); ++link) {
      for (std::size_t first = layout_->first[link]; first < layout_->first[link + 1];
           first += kBlock, ++number) {
        if (block_worst_[number] != greatest) continue;
        const std::size_t end = std::min(first + kBlock, layout_->first[link + 1]);
        for (std::size_t i = first; i < end; ++i) {
          if (codes_[i] == greatest) visit(link, i);
        }
      }
    }
  };
  std::size_t ties = 0;
  for_each_tie([&](std::size_t, std::size_t) { ++ties; });
  const std::size_t stride = (ties + kCandidates - 1) / kCandidates;
  std::size_t tie = 0;
  double best = -1.0;
  for_each_tie([&](std::size_t link, std::size_t sensor) {
    if (tie++ % stride != 0) return;
    const Eigen::Vector3d position = X_WL[link] * layout_->position(sensor);
    const voxel::Index3 voxel = workspace.grid().index_of(position);
    const double around = surroundings(workspace, voxel, options_.gradient_reach_vox);
    if (around <= best) return;
    best = around;
    worst_ = {true,
              sensor,
              link,
              voxel,
              position,
              workspace.palette()[greatest],
              workspace.order(voxel),
              workspace.object(voxel)};
  });
}

void SkinSensing::sense(const LinkPoses& X_WL, std::size_t joint_count,
                        const voxel::Workspace& workspace) noexcept {
  sums_ = {};
  active_ = 0;
  worst_ = {};
  std::fill(block_worst_.begin(), block_worst_.end(), std::uint8_t{0});
  if (workspace.grid().voxel_count() <= 0) return;
  for (std::size_t link = 1; link <= joint_count; ++link) sense_link(link, X_WL[link], workspace);
  find_worst(X_WL, workspace);
}

}  // namespace phantom::robot
