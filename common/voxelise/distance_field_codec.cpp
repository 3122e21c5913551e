#include <zstd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "common/voxelise/distance_field.hpp"

namespace phantom::voxelise {
namespace {

constexpr std::array<char, 8> kMagic{'P', 'H', 'F', 'I', 'E', 'L', 'D', '1'};
constexpr unsigned long long kMostBytes = 1ULL << 31;
constexpr std::int32_t kMostVoxelsAlong = 1 << 16;

core::Status refused(const std::string& what) {
  return core::Status::invalid_argument("distance field: " + what);
}

template <typename T>
void append(std::vector<std::uint8_t>& bytes, const std::vector<T>& values) {
  const std::size_t at = bytes.size();
  bytes.resize(at + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), values.size() * sizeof(T));
}

template <typename T>
const std::uint8_t* take(const std::uint8_t* from, std::size_t count, std::vector<T>& values) {
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), from, count * sizeof(T));
  return from + count * sizeof(T);
}

core::Expected<std::vector<std::uint8_t>> decompress(std::span<const std::uint8_t> frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size > kMostBytes)
    return refused("no zstd frame of a field");
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  const std::size_t got = ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size());
  if (ZSTD_isError(got) != 0) return refused(std::string("does not decompress: ") + ZSTD_getErrorName(got));
  if (got != bytes.size()) return refused("is cut short");
  return bytes;
}

}  // namespace

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

  std::vector<std::uint8_t> frame(ZSTD_compressBound(plain.size()));
  ZSTD_CCtx* const context = ZSTD_createCCtx();
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, 1);
  ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
  const std::size_t size = ZSTD_compress2(context, frame.data(), frame.size(), plain.data(), plain.size());
  ZSTD_freeCCtx(context);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  frame.resize(size);
  return frame;
}

core::Expected<DistanceField> DistanceField::decode(std::span<const std::uint8_t> frame) {
  const auto bytes = decompress(frame);
  if (!bytes) return bytes.status();
  EncodedHeader header;
  if (bytes->size() < sizeof header) return refused("is cut short");
  std::memcpy(&header, bytes->data(), sizeof header);
  if (!header.valid()) return refused("its header is none");

  DistanceField field;
  field.grid_.origin_m = {header.origin_m[0], header.origin_m[1], header.origin_m[2]};
  field.grid_.voxel_size_m = header.voxel_size_m;
  field.grid_.size_vox = header.size_vox;
  field.outside_m_ = header.outside_m;
  field.inside_m_ = header.inside_m;
  field.quantum_m_ = header.quantum_m;
  std::size_t entries = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field.size_cubes_[axis] = (header.size_vox[axis] + kEdge - 1) / kEdge;
    entries *= static_cast<std::size_t>(field.size_cubes_[axis]);
  }
  const std::size_t samples = std::size_t{header.cubes} * kCubeVoxels;
  if (entries > kMostBytes || bytes->size() != sizeof header + entries * sizeof(std::int32_t) +
                                                   samples * (sizeof(std::int16_t) + sizeof(std::uint16_t)))
    return refused("its size does not fit its header");
  const std::uint8_t* from = take(bytes->data() + sizeof header, entries, field.directory_);
  from = take(from, samples, field.samples_);
  take(from, samples, field.objects_);
  for (const std::int32_t cube : field.directory_)
    if (cube < kDeep || cube >= static_cast<std::int64_t>(header.cubes))
      return refused("names samples that it does not have");
  return field;
}

}  // namespace phantom::voxelise
