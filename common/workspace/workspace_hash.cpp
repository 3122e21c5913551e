#include "common/workspace/workspace_hash.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace phantom::workspace {
namespace {

static_assert(std::endian::native == std::endian::little,
              "hashes cross hosts: big-endian hosts need a conversion here");

constexpr std::uint64_t kOdd1 = 0x9e3779b97f4a7c15ULL;  // 2⁶⁴ ÷ golden ratio
constexpr std::uint64_t kOdd2 = 0xd6e8feb86659fd93ULL;

constexpr std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 32)) * kOdd2;
  h = (h ^ (h >> 29)) * kOdd1;
  return h ^ (h >> 32);
}

/// Hashes in four independent lanes, so that the multiplications overlap. `bytes` is a multiple of 32.
std::uint64_t hash_words(const void* data, std::size_t bytes, std::uint64_t seed) {
  const auto* from = static_cast<const std::uint8_t*>(data);
  std::array<std::uint64_t, 4> lanes{seed, seed + kOdd1, seed + 2 * kOdd1, seed + 3 * kOdd1};
  for (std::size_t i = 0; i < bytes; i += 32) {
    std::array<std::uint64_t, 4> words;
    std::memcpy(words.data(), from + i, 32);
    for (std::size_t lane = 0; lane < 4; ++lane) {
      lanes[lane] = (lanes[lane] ^ words[lane]) * kOdd2;
      lanes[lane] ^= lanes[lane] >> 32;
    }
  }
  return mix(mix(mix(mix(lanes[0]) + lanes[1]) + lanes[2]) + lanes[3]);
}

}  // namespace

std::uint64_t header_hash(const GridSpec& grid, const std::vector<float>& palette_Pa_s_per_m) {
  std::uint64_t hash = mix(palette_Pa_s_per_m.size());
  const auto add = [&hash](std::uint64_t value) { hash = mix(hash + kOdd1) ^ mix(value + kOdd2); };
  for (int axis = 0; axis < 3; ++axis) {
    add(std::bit_cast<std::uint64_t>(grid.origin_m[axis] + 0.0));
    add(static_cast<std::uint64_t>(grid.size_vox[static_cast<std::size_t>(axis)]));
  }
  // Of cubes one side says all, and their hashes stay what they were when there were no others.
  for (std::size_t axis = 0; axis < (grid.voxel_size_m.is_cube() ? 1 : 3); ++axis)
    add(std::bit_cast<std::uint64_t>(grid.voxel_size_m[axis]));
  for (const float mu : palette_Pa_s_per_m) add(std::bit_cast<std::uint32_t>(mu));
  return hash;
}

std::uint64_t brick_hash(BrickKey key, const Workspace::BrickView& brick) {
  const auto place = static_cast<std::uint64_t>(key.x) | static_cast<std::uint64_t>(key.y) << 20 |
                     static_cast<std::uint64_t>(key.z) << 40;
  std::uint64_t hash = hash_words(brick.mu_code, kBrickVoxels, mix(place));
  hash = hash_words(brick.order, kBrickVoxels, hash);
  if (brick.object != nullptr) return hash_words(brick.object, 2 * kBrickVoxels, hash);
  std::array<std::uint16_t, kBrickVoxels> objects;
  brick.copy_objects(objects.data());
  return hash_words(objects.data(), 2 * kBrickVoxels, hash);
}

}  // namespace phantom::workspace
