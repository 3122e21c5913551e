#include "components/synthetic_viewer/scene/mesh_store.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::synthetic_viewer {
namespace {

std::string unpacked(const std::string& gzip) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  std::string octets(std::size_t{1} << 20, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(octets.data());
  stream.avail_out = static_cast<uInt>(octets.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  octets.resize(stream.total_out);
  inflateEnd(&stream);
  return octets;
}

TEST(MeshStoreOf, AMeshIsPackedAsTheReadmeSays) {
  const geometry::TriangleMesh mesh = geometry::make_sphere(0.3, 3);
  const std::string octets = unpacked(packed_mesh(mesh));
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, octets.data() + at, sizeof value);
    return value;
  };
  ASSERT_EQ(number(0), mesh.vertices_m.size());
  ASSERT_EQ(number(4), mesh.triangles.size());
  ASSERT_EQ(octets.size(), 8 + 12 * (mesh.vertices_m.size() + mesh.triangles.size()));
  EXPECT_EQ(std::memcmp(octets.data() + 8, mesh.vertices_m.data(), 12 * mesh.vertices_m.size()), 0);
  const std::size_t indices = 8 + 12 * mesh.vertices_m.size();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner)
      ASSERT_EQ(number(indices + 12 * t + 4 * corner), mesh.triangles[t][corner]);
}

TEST(MeshStoreOf, MeshesAreFoundByTheirHashAndPackedOnce) {
  MeshStore store;
  const geometry::TriangleMesh mesh = geometry::make_sphere(0.3, 2);
  store.put(7, mesh);
  const MeshStore::Packed first = store.packed(7);
  ASSERT_TRUE(first);
  EXPECT_EQ(*first, packed_mesh(mesh));
  EXPECT_EQ(store.packed(7), first);
  store.put(7, geometry::make_sphere(0.4, 2));
  EXPECT_EQ(store.packed(7), first) << "a hash stands for one content";
  EXPECT_FALSE(store.packed(8));
  store.drop(7);
  EXPECT_FALSE(store.packed(7));
}

TEST(MeshStoreOf, AHashHasOneSpelling) {
  EXPECT_EQ(hash_text(0xABC), "0000000000000abc");
  EXPECT_EQ(hash_from_text("0000000000000abc"), 0xABCU);
  for (const char* other : {"", "abc", "0000000000000ABC", "00000000000000abc", "000000000000 abc",
                            "+00000000000abc", "0000000000000abg"})
    EXPECT_FALSE(hash_from_text(other)) << other;
}

}  // namespace
}  // namespace phantom::synthetic_viewer
