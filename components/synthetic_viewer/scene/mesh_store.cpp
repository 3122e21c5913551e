#include "components/synthetic_viewer/scene/mesh_store.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <new>
#include <vector>

namespace phantom::synthetic_viewer {
namespace {

constexpr int kLevel = 6;              // 9 takes five times as long, for one octet in a hundred
constexpr int kGzip = 16 + MAX_WBITS;  // zlib's number for gzip's header and check
constexpr int kMemory = 8;             // zlib's default

}  // namespace

std::string gzip(std::string_view octets) {
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed(deflateBound(&stream, octets.size()), '\0');
  std::size_t taken = 0, given = 0;
  int result = Z_OK;
  // zlib counts in 32 bits.
  constexpr std::size_t kPart = std::size_t{1} << 30;
  while (result == Z_OK) {
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(octets.data() + taken));
    stream.avail_in = static_cast<uInt>(std::min(kPart, octets.size() - taken));
    stream.next_out = reinterpret_cast<Bytef*>(packed.data() + given);
    stream.avail_out = static_cast<uInt>(std::min(kPart, packed.size() - given));
    const bool last = taken + stream.avail_in == octets.size();
    const uInt in = stream.avail_in, out = stream.avail_out;
    result = deflate(&stream, last ? Z_FINISH : Z_NO_FLUSH);
    taken += in - stream.avail_in;
    given += out - stream.avail_out;
  }
  deflateEnd(&stream);
  packed.resize(given);
  packed.shrink_to_fit();
  return packed;
}

std::string packed_mesh(const geometry::TriangleMesh& mesh) {
  static_assert(std::endian::native == std::endian::little);
  const std::array<std::uint32_t, 2> counts{static_cast<std::uint32_t>(mesh.vertices_m.size()),
                                            static_cast<std::uint32_t>(mesh.triangles.size())};
  const std::vector<std::uint8_t> bytes = geometry::mesh_bytes(mesh);
  std::string octets(reinterpret_cast<const char*>(counts.data()), sizeof counts);
  octets.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return gzip(octets);
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

std::optional<std::uint64_t> hash_from_text(std::string_view text) {
  std::uint64_t hash = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), hash, 16);
  if (fault != std::errc() || end != text.data() + text.size() || hash_text(hash) != text)
    return std::nullopt;
  return hash;
}

void MeshStore::put(std::uint64_t hash, geometry::TriangleMesh mesh) {
  auto entry = std::make_shared<Entry>();
  entry->mesh = std::move(mesh);
  const std::lock_guard lock(mutex_);
  entries_.try_emplace(hash, std::move(entry));
}

void MeshStore::drop(std::uint64_t hash) {
  const std::lock_guard lock(mutex_);
  entries_.erase(hash);
}

MeshStore::Packed MeshStore::packed(std::uint64_t hash) {
  std::shared_ptr<Entry> entry;
  {
    const std::lock_guard lock(mutex_);
    const auto found = entries_.find(hash);
    if (found == entries_.end()) return nullptr;
    entry = found->second;
  }
  const std::lock_guard lock(entry->mutex);
  if (!entry->packed) {
    entry->packed = std::make_shared<const std::string>(packed_mesh(entry->mesh));
    entry->mesh = {};
  }
  return entry->packed;
}

}  // namespace phantom::synthetic_viewer
