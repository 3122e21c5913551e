#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>

#include "common/geometry/importer/polygons.hpp"
#include "common/geometry/mesh/mesh_io.hpp"
#include "common/geometry/tests/mesh_files.hpp"

namespace phantom::geometry::detail::ply_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kVertexHead =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
constexpr const char* kFaceHead = "element face 4\nproperty list uchar int vertex_indices\n";
constexpr const char* kVertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
constexpr const char* kFaces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string head(const std::string& elements, const std::string& form = "ascii") {
  return "ply\nformat " + form + " 1.0\ncomment by hand\nobj_info x y\n" + elements + "end_header\n";
}
std::string tetrahedron() { return head(std::string(kVertexHead) + kFaceHead) + kVertices + kFaces; }

void expect_tetrahedron(const Polygons& read) {
  EXPECT_EQ(read.vertices.size(), 4u);
  EXPECT_THAT(read.corners, ElementsAre(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3));
  EXPECT_EQ(read.vertices.at(3), Eigen::Vector3d(0, 0, 1));
  EXPECT_THAT(read.notes, IsEmpty());
}

template <class Number>
void append(std::string& bytes, Number value, bool big) {
  auto own = std::bit_cast<std::array<char, sizeof value>>(value);
  if (big) std::reverse(own.begin(), own.end());
  bytes.append(own.data(), own.size());
}

std::string refusal_of(const std::string& bytes) {
  try {
    read_ply(bytes);
  } catch (const UnreadableMesh& unreadable) {
    return unreadable.what();
  }
  return "read";
}

TEST(Ply, ATextIsReadWithAnyEndOfLine) {
  expect_tetrahedron(read_ply(tetrahedron()));
  for (const char* end : {"\r\n", "\r"}) {
    std::string text;
    for (const char c : tetrahedron()) text += c == '\n' ? std::string(end) : std::string(1, c);
    expect_tetrahedron(read_ply(text));
  }
}

TEST(Ply, BytesOfEitherOrderAreReadWithFurtherPropertiesAndElements) {
  for (const bool big : {false, true}) {
    std::string bytes = head(
        "element material 2\nproperty uchar red\nelement vertex 4\nproperty uchar red\nproperty double z\nproperty short y\n"
        "property float32 x\nelement face 4\nproperty list uchar float texcoord\nproperty list uint16 uint8 vertex_index\n"
        "property int flags\nelement edge 1\nproperty int vertex1\n",
        big ? "binary_big_endian" : "binary_little_endian");
    bytes += "ab";
    const int vertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const auto& vertex : vertices) {
      bytes += "\x7f";
      append(bytes, static_cast<double>(vertex[2]), big);
      append(bytes, static_cast<std::int16_t>(vertex[1]), big);
      append(bytes, static_cast<float>(vertex[0]), big);
    }
    const std::uint8_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    for (const auto& face : faces) {
      append(bytes, std::uint8_t{2}, big);
      append(bytes, 0.25F, big);
      append(bytes, 0.5F, big);
      append(bytes, std::uint16_t{3}, big);
      for (const std::uint8_t index : face) append(bytes, index, big);
      append(bytes, 7, big);
    }
    append(bytes, 1, big);
    expect_tetrahedron(read_ply(bytes));
    EXPECT_THAT(refusal_of(bytes.substr(0, bytes.size() - 5)), HasSubstr("was it cut short?"));
  }
}

TEST(Ply, FacesMayStandBeforeTheirVertices) {
  expect_tetrahedron(read_ply(head(std::string(kFaceHead) + kVertexHead) + kFaces + kVertices));
}

TEST(Ply, StripsTurnEverySecondTriangleAndEndAtMinusOne) {
  const auto read = read_ply(
      head(std::string(kVertexHead) + "element tristrips 1\nproperty list int int vertex_indices\n") +
      kVertices + "8 0 1 2 3 -1 1 2 0\n");
  EXPECT_THAT(read.corners, ElementsAre(0, 1, 2, 2, 1, 3, 1, 2, 0));
}

TEST(Ply, SR27_WhatIsNotAsTheHeadDeclaresIsRefusedWithItsPlace) {
  const std::string text = tetrahedron();
  const auto with = [&](const std::string& old, const std::string& now) {
    std::string changed = text;
    changed.replace(changed.find(old), old.size(), now);
    return refusal_of(changed);
  };
  EXPECT_THAT(with("3 1 2 3\n", ""),
              HasSubstr("it declares 4 of 'face' and ends after 3: was it cut short?"));
  EXPECT_THAT(with("3 1 2 3", "3 1 2 4"), HasSubstr("face 3 of 4 names vertex 4; allowed: 0 to 3"));
  EXPECT_THAT(with("3 1 2 3", "3 1 2 -1"), HasSubstr("names vertex -1"));
  EXPECT_THAT(with("3 1 2 3", "4 1 2 3"), HasSubstr("face 3 of 4 has fewer numbers than the head declares"));
  EXPECT_THAT(with("0 1 0", "0 one 0"), HasSubstr("vertex 2 of 4 has 'one', which is no number"));
  EXPECT_THAT(with("0 1 0", "0 nan 0"), HasSubstr("not finite"));
  EXPECT_THAT(with("float y", "float v"), HasSubstr("no coordinate 'y'"));
  // A coordinate of another element does not stand in for it.
  EXPECT_THAT(
      refusal_of(
          head("element camera 1\nproperty float y\nelement vertex 1\nproperty float x\nproperty float z\n") +
          "1\n0 0\n"),
      HasSubstr("no coordinate 'y'"));
  EXPECT_THAT(with("float y", "real y"), HasSubstr("type 'real'; allowed: char"));
  EXPECT_THAT(with("format ascii", "format utf8"), HasSubstr("format is 'utf8'; allowed: ascii"));
  EXPECT_THAT(with("end_header", "end"), HasSubstr("no end_header"));
  EXPECT_THAT(refusal_of("plx\n"), HasSubstr("first line is not 'ply'"));
  EXPECT_THAT(refusal_of(head("element range_grid 1\nproperty list uchar int vertex_indices\n" +
                              std::string(kVertexHead))),
              HasSubstr("grid of ranges"));
}

TEST(Ply, UnusualFilesAreReadAsTheyAreMeant) {
  const std::string text = tetrahedron();
  const auto with = [&](const std::string& old, const std::string& now) {
    std::string changed = text;
    changed.replace(changed.find(old), old.size(), now);
    return read_ply(changed);
  };
  expect_tetrahedron(read_ply("\xef\xbb\xbf" + text));
  expect_tetrahedron(with("ply", "PLY"));
  expect_tetrahedron(with("float x", "Float x"));
  expect_tetrahedron(with("3 1 2 3", "3 1\n 2 3"));
  // Numbers one after the other, whatever the lines.
  const std::size_t body = text.find("end_header\n") + 11;
  std::string one_line = text.substr(body);
  std::replace(one_line.begin(), one_line.end(), '\n', ' ');
  expect_tetrahedron(read_ply(text.substr(0, body) + one_line));
  // An element without properties has no lines.
  expect_tetrahedron(
      read_ply(head("element material 2\n" + std::string(kVertexHead) + kFaceHead) + kVertices + kFaces));
}

TEST(Ply, WhatIsPassedOverIsNoted) {
  const std::string text = tetrahedron();
  EXPECT_THAT(read_ply(text + "1 2 3\n").notes, ElementsAre(HasSubstr("has 5 bytes after")));
  std::string longer = text;
  longer.insert(longer.find("3 1 2 3") + 7, " 255 0 0");
  EXPECT_THAT(read_ply(longer).notes, ElementsAre(HasSubstr("1 lines have more numbers")));
  EXPECT_THAT(read_ply(text).notes, testing::IsEmpty());
}

TEST(Ply, OnlyAVertexThatAFaceNamesNeedsItsCoordinates) {
  std::string text = tetrahedron();
  text.replace(text.find("element vertex 4"), 16, "element vertex 5");
  const std::size_t faces = text.find(kFaces);
  EXPECT_EQ(read_ply(text.substr(0, faces) + "nan nan nan\n" + text.substr(faces)).corners.size(), 12u);
}

TEST(Ply, AFileWithoutFacesIsNamedForWhatItIs) {
  EXPECT_THAT(refusal_of(head(kVertexHead) + kVertices), HasSubstr("cloud of points"));
  EXPECT_THAT(refusal_of(head(std::string(kVertexHead) +
                              "element face 1\nproperty list uchar int corners\nproperty uchar red\n") +
                         kVertices + "3 0 1 2 255\n"),
              HasSubstr("no list 'vertex_indices' or 'vertex_index', but 'corners', 'red'"));
}

// Where the head's lines end by \r alone, the body may begin with \n.
TEST(Ply, ABodyThatBeginsWithANewlineIsReadWhole) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string bytes;
    for (const char c :
         head("element vertex 3\nproperty uchar q\nproperty uchar x\nproperty uchar y\nproperty uchar "
              "z\nelement face 1\nproperty list uchar uchar vertex_indices\n",
              "binary_little_endian"))
      bytes += c == '\n' ? end : std::string(1, c);
    bytes += std::string("\n\0\0\0\n\1\0\0\n\0\1\0\3\0\1\2", 16);
    EXPECT_THAT(read_ply(bytes).corners, ElementsAre(0, 1, 2)) << end.size();
  }
}

TEST(Ply, WhateverStandsInAFileIsReadOrRefused) {
  std::mt19937 random(3);
  const std::string whole = tetrahedron();
  for (int round = 0; round < 3000; ++round) {
    std::string text = whole;
    for (int i = 0; i < 3; ++i) text[random() % text.size()] = static_cast<char>(random() % 256);
    text.resize(1 + random() % text.size());
    try {
      const Polygons read = read_ply(text);
      for (const std::uint32_t corner : read.corners) ASSERT_LT(corner, read.vertices.size());
    } catch (const UnreadableMesh&) {
    }
  }
}

class PlyFiles : public MeshFiles {};

TEST_F(PlyFiles, AreLoadedWithTheirPolygonsCutUp) {
  const auto mesh = load_mesh(
      write("ell.ply", head("element vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
                            "element face 1\nproperty list uchar int vertex_indices\n") +
                           "1 1 0\n0 1 0\n0 0 0\n2 0 0\n2 2 0\n1 2 0\n6 0 1 2 3 4 5\n"),
      {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 4u);
  EXPECT_EQ(mesh->format, "PLY");
}

}  // namespace
}  // namespace phantom::geometry::detail::ply_test
