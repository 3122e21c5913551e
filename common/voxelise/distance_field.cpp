#include "common/voxelise/distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "common/workspace/compression.hpp"

namespace phantom::voxelise {
namespace {

constexpr std::array<char, 8> kMagic{'P', 'H', 'F', 'I', 'E', 'L', 'D', '1'};
constexpr std::uint64_t kMostBytes = 1ULL << 31;
constexpr std::int32_t kMostVoxelsAlong = 1 << 16;

/// The first of the eight samples around a point, and the point's position between them.
struct Neighbourhood {
  workspace::Index3 base;
  Eigen::Vector3d t;
};

bool locate(const workspace::GridSpec& grid, const Eigen::Vector3d& p_W_m, Neighbourhood& out) noexcept {
  const Eigen::Vector3d voxels = (p_W_m - grid.origin_m) / grid.voxel_size_m;
  for (int i = 0; i < 3; ++i) {
    if (!(voxels[i] >= 0 && voxels[i] < grid.size_vox[static_cast<std::size_t>(i)])) return false;
  }
  const Eigen::Vector3d q = voxels.array() - 0.5, floor = q.array().floor();
  out = {{static_cast<int>(floor.x()), static_cast<int>(floor.y()), static_cast<int>(floor.z())}, q - floor};
  return true;
}

/// Calls visit(offset of a sample from the first, the weights of its two sides along x, y and z).
template <class Visit>
void for_each_corner(const Eigen::Vector3d& t, const Visit& visit) noexcept {
  for (std::int32_t corner = 0; corner < 8; ++corner) {
    const workspace::Index3 at{corner & 1, corner >> 1 & 1, corner >> 2};
    const Eigen::Array3d upper = workspace::vector(at).array();
    visit(at, Eigen::Array3d(upper * t.array() + (1 - upper) * (1 - t.array())));
  }
}

core::Status refused(const std::string& what) {
  return core::Status::invalid_argument("distance field: " + what);
}

template <typename T>
void append(std::vector<std::uint8_t>& bytes, const std::vector<T>& values) {
  const auto* const from = reinterpret_cast<const std::uint8_t*>(values.data());
  bytes.insert(bytes.end(), from, from + values.size() * sizeof(T));
}

template <typename T>
const std::uint8_t* take(const std::uint8_t* from, std::size_t count, std::vector<T>& values) {
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), from, count * sizeof(T));
  return from + count * sizeof(T);
}

}  // namespace

double DistanceField::sample_m(workspace::Index3 v) const noexcept {
  v = workspace::max({},
                     workspace::min(v, workspace::VoxelBox::of(grid_).end() - workspace::Index3{1, 1, 1}));
  const std::int32_t cube = directory_[cube_index(v)];
  if (cube == kFar) return outside_m_;
  if (cube == kDeep) return -inside_m_;
  return quantum_m_ * samples_[static_cast<std::size_t>(cube) * kCubeVoxels + offset_in_cube(v)];
}

double DistanceField::distance_m(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  if (!locate(grid_, p_W_m, n)) return outside_m_;
  double sum = 0.0;
  for_each_corner(n.t, [&](workspace::Index3 at, const Eigen::Array3d& weight) {
    sum += weight.prod() * sample_m(n.base + at);
  });
  return sum;
}

Eigen::Vector3d DistanceField::gradient(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (!locate(grid_, p_W_m, n)) return sum;
  for_each_corner(n.t, [&](workspace::Index3 at, const Eigen::Array3d& weight) {
    const double sample = sample_m(n.base + at);
    for (int i = 0; i < 3; ++i)
      sum[i] += (at[static_cast<std::size_t>(i)] != 0 ? sample : -sample) * weight[(i + 1) % 3] *
                weight[(i + 2) % 3];
  });
  return sum / grid_.voxel_size_m;
}

std::uint16_t DistanceField::object(const Eigen::Vector3d& p_W_m) const noexcept {
  Neighbourhood n;
  if (!locate(grid_, p_W_m, n)) return 0;
  const workspace::Index3 v = grid_.index_of(p_W_m);
  if (!grid_.contains(v)) return 0;
  const std::int32_t cube = directory_[cube_index(v)];
  return cube < 0 ? std::uint16_t{0}
                  : objects_[static_cast<std::size_t>(cube) * kCubeVoxels + offset_in_cube(v)];
}

std::size_t DistanceField::bytes() const noexcept {
  return directory_.size() * sizeof(directory_[0]) +
         samples_.size() * (sizeof(samples_[0]) + sizeof(objects_[0]));
}

struct DistanceField::EncodedHeader {
  std::array<char, 8> magic;
  std::array<double, 3> origin_m;
  double voxel_size_m, outside_m, inside_m, quantum_m;
  std::array<std::int32_t, 3> size_vox;
  std::uint32_t cubes;

  bool valid() const noexcept {
    bool ok = magic == kMagic;
    for (const double value : origin_m) ok = ok && std::isfinite(value);
    for (const double value : {voxel_size_m, outside_m, inside_m, quantum_m})
      ok = ok && std::isfinite(value) && value > 0;
    for (const std::int32_t size : size_vox) ok = ok && size > 0 && size <= kMostVoxelsAlong;
    return ok;
  }
};

std::vector<std::uint8_t> DistanceField::encode() const {
  const EncodedHeader header{kMagic,
                             {grid_.origin_m.x(), grid_.origin_m.y(), grid_.origin_m.z()},
                             grid_.voxel_size_m,
                             outside_m_,
                             inside_m_,
                             quantum_m_,
                             grid_.size_vox,
                             static_cast<std::uint32_t>(samples_.size() / kCubeVoxels)};
  std::vector<std::uint8_t> plain(sizeof header);
  std::memcpy(plain.data(), &header, sizeof header);
  append(plain, directory_);
  append(plain, samples_);
  append(plain, objects_);
  return workspace::compress(plain);
}

core::Expected<DistanceField> DistanceField::decode(std::span<const std::uint8_t> frame) {
  EncodedHeader header;
  const std::uint64_t size = workspace::content_size(frame).value_or(0);
  if (size < sizeof header || size > kMostBytes) return refused("no zstd frame of a field");
  std::vector<std::uint8_t> bytes(size);
  if (core::Status status = workspace::decompress(frame, bytes); !status) return refused(status.message());
  std::memcpy(&header, bytes.data(), sizeof header);
  if (!header.valid()) return refused("its header is none");
  DistanceField field(
      {{header.origin_m[0], header.origin_m[1], header.origin_m[2]}, header.voxel_size_m, header.size_vox},
      header.outside_m, header.inside_m, header.quantum_m);
  const std::size_t entries = field.cubes_.voxel_count(), samples = std::size_t{header.cubes} * kCubeVoxels;
  if (entries > kMostBytes || size != sizeof header + entries * sizeof(std::int32_t) +
                                          samples * (sizeof(std::int16_t) + sizeof(std::uint16_t)))
    return refused("its size does not fit its header");
  const std::uint8_t* from = take(bytes.data() + sizeof header, entries, field.directory_);
  from = take(from, samples, field.samples_);
  take(from, samples, field.objects_);
  for (const std::int32_t cube : field.directory_)
    if (cube < kDeep || cube >= static_cast<std::int64_t>(header.cubes))
      return refused("names samples that it does not have");
  return field;
}

}  // namespace phantom::voxelise
