#include "common/percept/principal_gradient.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace phantom::percept {
namespace {

using workspace::Index3;
using Run = ClusterZone::Run;

// The codes of a run's voxels are the bytes of one number, the first voxel's the lowest.
static_assert(std::endian::native == std::endian::little);
constexpr std::uint64_t kEachByte = 0x0101010101010101U, kHighBits = 0x8080808080808080U;
constexpr int kMaxReach_vox = 15;
constexpr std::size_t kMaxRuns = 31 * 31 * 4;

std::uint64_t lanes_of(const Run& run) noexcept {
  return run.count == 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * run.count) - 1;
}
/// Gives the bytes behind a run's voxels the code of its first, so that they change neither extreme.
std::uint64_t pad(std::uint64_t codes, const Run& run) noexcept {
  const std::uint64_t lanes = lanes_of(run);
  return (codes & lanes) | ((codes & 0xff) * kEachByte & ~lanes);
}

/// Reads runs of a zone that is within the grid, by words of four voxels, which a tile holds in a row.
class RunReader {
 public:
  RunReader(const workspace::Workspace& workspace, Index3 centre, int reach_vox) noexcept {
    const Index3 reach{reach_vox, reach_vox, reach_vox};
    const workspace::BrickKey low = workspace::brick_of(centre - reach);
    const workspace::BrickKey high = workspace::brick_of(centre + reach);
    from_ = centre - workspace::corner_of(low);
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      const workspace::BrickKey key{
          {i & 1U ? high.x : low.x, i & 2U ? high.y : low.y, i & 4U ? high.z : low.z}};
      bricks_[i] = workspace.brick(key).mu_code;
    }
  }
  std::uint64_t codes(const Run& run) const noexcept {
    const auto x = static_cast<std::uint32_t>(from_.x + run.x),
               y = static_cast<std::uint32_t>(from_.y + run.y),
               z = static_cast<std::uint32_t>(from_.z + run.z);
    const std::size_t row = workspace::brick_offset(0, y & 31, z & 31), bricks = (y >> 5) << 1 | (z >> 5)
                                                                                                     << 2;
    std::array<std::uint64_t, 3> words{};
    const std::uint32_t last = x + run.count - 1;
    for (std::uint32_t at = x & ~3U, i = 0; at <= last; at += 4, ++i) {
      std::uint32_t word = 0;
      std::memcpy(&word, bricks_[bricks | at >> 5] + row + workspace::brick_offset(at & 31, 0, 0),
                  sizeof word);
      words[i] = word;
    }
    const std::uint32_t shift = 8 * (x & 3);
    const std::uint64_t both = words[0] | words[1] << 32;
    return shift == 0 ? both : both >> shift | words[2] << (64 - shift);
  }

 private:
  Index3 from_;  // the centre, from the corner of the first brick
  std::array<const std::uint8_t*, 8> bricks_{};
};

/// Sum of the offsets of the voxels that hold one code. Integers make the offsets of equal zones cancel
/// exactly.
struct Sum {
  explicit Sum(std::uint8_t code) : bytes(code * kEachByte) {}

  void add(const Run& run, std::uint64_t codes) noexcept {
    const std::uint64_t other = codes ^ bytes;
    // The high bit of each byte that is zero (H. S. Warren, Hacker's Delight, 6-1).
    const std::uint64_t equal = ~(((other & ~kHighBits) + ~kHighBits) | other | ~kHighBits) & lanes_of(run);
    if (equal == 0) return;
    const std::uint64_t ones = equal >> 7;
    const auto found = static_cast<std::int64_t>(ones * kEachByte >> 56);
    const auto places = static_cast<std::int64_t>(ones * 0x0001020304050607U >> 56);  // their sum
    x += found * run.x + places;
    y += found * run.y;
    z += found * run.z;
    count += found;
  }
  Eigen::Vector3d centroid() const noexcept {
    return Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) /
           static_cast<double>(count);
  }

  std::uint64_t bytes;
  std::int64_t x = 0, y = 0, z = 0, count = 0;
};

}  // namespace

ClusterZone::ClusterZone(int reach_vox, ZoneShape shape)
    : reach_vox_(std::clamp(reach_vox, 1, kMaxReach_vox)) {
  const int m = reach_vox_;
  for (int z = -m; z <= m; ++z) {
    for (int y = -m; y <= m; ++y) {
      int half = m;
      if (shape == ZoneShape::kSphere)
        for (half = -1; half < m && (half + 1) * (half + 1) + y * y + z * z <= m * m;) ++half;
      for (int x = -half; x <= half; x += 8)
        runs_.push_back({x, y, z, static_cast<std::uint32_t>(std::min(8, half + 1 - x))});
    }
  }
  for (const Run& run : runs_) voxels_ += run.count;
}

PrincipalGradient ClusterZone::gradient(const workspace::Workspace& workspace, workspace::Index3 centre,
                                        std::size_t link, const AllowedContact& allowed) const noexcept {
  std::array<std::uint64_t, kMaxRuns> codes;
  const Index3 reach{reach_vox_, reach_vox_, reach_vox_};
  const bool mutes = allowed.concerns(link);
  if (!mutes && workspace.grid().contains(centre - reach) && workspace.grid().contains(centre + reach)) {
    const RunReader reader(workspace, centre, reach_vox_);
    for (std::size_t i = 0; i < runs_.size(); ++i) codes[i] = pad(reader.codes(runs_[i]), runs_[i]);
  } else {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      const Run& run = runs_[i];
      codes[i] = 0;
      for (std::uint32_t k = 0; k < run.count; ++k) {
        const Index3 at = centre + Index3{run.x + static_cast<std::int32_t>(k), run.y, run.z};
        const std::uint64_t code = workspace.mu_code(at);
        if (!mutes || code == 0 || !allowed.mutes(link, workspace.object(at))) codes[i] |= code << 8 * k;
      }
      codes[i] = pad(codes[i], run);
    }
  }
  std::uint8_t high = 0, low = 255;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(codes.data());
  for (std::size_t i = 0; i < 8 * runs_.size(); ++i)
    high = std::max(high, bytes[i]), low = std::min(low, bytes[i]);
  PrincipalGradient result;
  result.greatest = static_cast<double>(workspace.palette()[high]);
  result.least = static_cast<double>(workspace.palette()[low]);
  if (high == low) return result;
  Sum highs(high), lows(low);
  for (std::size_t i = 0; i < runs_.size(); ++i) highs.add(runs_[i], codes[i]), lows.add(runs_[i], codes[i]);
  result.strength = result.greatest - result.least;
  result.pgv_W_m = workspace.grid().voxel_size_m.sides_m().cwiseProduct(highs.centroid() - lows.centroid());
  return result;
}

}  // namespace phantom::percept
