#include "common/geometry/mesh/mesh_answer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::geometry::detail {
namespace {

using ::testing::HasSubstr;

LoadedMesh loaded_box() {
  LoadedMesh mesh;
  static_cast<TriangleMesh&>(mesh) = make_box({0.2, 0.3, 0.4});
  mesh.format = "Wavefront Object Importer";
  mesh.scale = 0.001;
  mesh.scale_from = KnownFrom::kGuess;
  mesh.up = UpAxis::kY;
  mesh.up_from = KnownFrom::kFile;
  mesh.notes = {"declares no unit", "has a hole"};
  return mesh;
}

std::vector<std::uint8_t> whole_answer(const LoadedMesh& mesh) {
  auto bytes = answer_head(mesh);
  const auto shape = mesh_bytes(mesh);
  bytes.insert(bytes.end(), shape.begin(), shape.end());
  return bytes;
}

void expect_internal(const std::vector<std::uint8_t>& bytes, const std::string& reason,
                     const MeshImportOptions& options = {}) {
  const auto mesh = mesh_of_answer(bytes, options);
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.status().code(), core::ErrorCode::kInternal);
  EXPECT_THAT(mesh.status().message(), HasSubstr(reason));
}

TEST(MeshAnswer, ComesBackAsItWas) {
  const LoadedMesh sent = loaded_box();
  const auto got = mesh_of_answer(whole_answer(sent), {});
  ASSERT_TRUE(got) << got.status().message();
  EXPECT_EQ(got->vertices_m, sent.vertices_m);
  EXPECT_EQ(got->triangles, sent.triangles);
  EXPECT_EQ(got->format, sent.format);
  EXPECT_EQ(got->scale, sent.scale);
  EXPECT_EQ(got->scale_from, sent.scale_from);
  EXPECT_EQ(got->up, sent.up);
  EXPECT_EQ(got->up_from, sent.up_from);
  EXPECT_EQ(got->notes, sent.notes);
  EXPECT_LE(whole_answer(sent).size(), max_answer_bytes({.max_triangles = 12}));
}

TEST(MeshAnswer, ARefusalKeepsItsWords) {
  const auto mesh = mesh_of_answer(refusal("holds no triangles"), {});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.status().code(), core::ErrorCode::kInvalidArgument);
  EXPECT_EQ(mesh.status().message(), "holds no triangles");
  EXPECT_LE(refusal(std::string(1 << 20, 'x')).size(), max_answer_bytes({.max_triangles = 0}));
}

TEST(MeshAnswer, EveryByteMustBeThereAndNoMore) {
  const auto whole = whole_answer(loaded_box());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto cut = mesh_of_answer(std::span(whole).first(size), {});
    ASSERT_FALSE(cut) << size;
    EXPECT_EQ(cut.status().code(), core::ErrorCode::kInternal) << size;
  }
  expect_internal({}, "ended without an answer");
  auto longer = whole;
  longer.push_back(0);
  expect_internal(longer, "cut short");
}

/// The head: magic (8 bytes), has_mesh, text_bytes, vertices, triangles (4 each), scale (8), scale_from,
/// up_from, up (4 each).
TEST(MeshAnswer, ClaimsAreNotBelieved) {
  const auto whole = whole_answer(loaded_box());
  const auto with = [&](std::size_t at, auto value) {
    auto bytes = whole;
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
  };
  expect_internal(with(0, 'X'), "another version");
  expect_internal(with(8, std::uint32_t{2}), "is not one");
  expect_internal(with(12, UINT32_MAX), "is not one");
  expect_internal(with(16, UINT32_MAX), "is not one");
  expect_internal(with(20, UINT32_MAX), "is not one");
  expect_internal(with(16, std::uint32_t{9'000'000}), "cut short");
  expect_internal(with(24, std::nan("")), "is not one");
  expect_internal(with(24, double{INFINITY}), "is not one");
  for (const std::size_t at : {32, 36, 40}) expect_internal(with(at, std::uint32_t{3}), "is not one");
  expect_internal(with(whole.size() - 4, std::uint32_t{8}), "cut short");  // an index beyond the vertices
  expect_internal(whole, "is not one", {.max_triangles = 11});
}

TEST(MeshAnswer, NoDamageDoesHarm) {
  const auto whole = whole_answer(loaded_box());
  std::mt19937 random(3);
  for (int round = 0; round < 20'000; ++round) {
    auto bytes = whole;
    for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    const auto mesh = mesh_of_answer(bytes, {});
    if (!mesh) continue;
    EXPECT_TRUE(mesh->all_finite());
    for (const auto& triangle : mesh->triangles)
      for (const std::uint32_t corner : triangle) EXPECT_LT(corner, mesh->vertices_m.size());
  }
}

}  // namespace
}  // namespace phantom::geometry::detail
