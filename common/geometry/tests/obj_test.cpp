#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/importer/polygons.hpp"

namespace phantom::geometry::detail::obj_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string refusal_of(const std::string& text) {
  try {
    read_obj(text);
  } catch (const UnreadableMesh& unreadable) {
    return unreadable.what();
  }
  return "read";
}

TEST(Obj, EveryFormOfACornerNamesItsVertex) {
  const Polygons read = read_obj(
      "\xef\xbb\xbf# by hand\nmtllib nowhere.mtl\no a part\nv 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\n\tv\t0 1 +0\nvt 0 0\nvn 0 0 1\n"
      "g one two\ns off\nusemtl red\nf 1 2 3\nf 1/1 2/1 3/1\nf 1/1/1 2/1/1 3/1/1 # a comment\nf 1//1 2//1 3//1\nf -3 -2 -1");
  EXPECT_THAT(read.corners, ElementsAre(0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2));
  EXPECT_EQ(read.ends.size(), 5u);
  EXPECT_THAT(read.notes, IsEmpty());
}

TEST(Obj, ALineGoesOnAfterABackslashAndEndsAnyWay) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : std::string("v 0 0 0\nv 1 \\\n0 0\nv 0 1 0\nf 1 \\\n2 \\\n3\n"))
      text += c == '\n' ? end : std::string(1, c);
    EXPECT_THAT(read_obj(text).corners, ElementsAre(0, 1, 2)) << end;
  }
}

// A comment or a name may end with a backslash of its own: nothing behind it is lost.
TEST(Obj, ABackslashAtTheEndOfAPathContinuesNothing) {
  for (const char* line : {"# from C:\\parts\\", "mtllib C:\\parts\\", "o C:\\", "usemtl a\\"}) {
    EXPECT_THAT(read_obj(std::string(line) + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").corners,
                ElementsAre(0, 1, 2))
        << line;
  }
  EXPECT_THAT(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\ \t\n+3\n").corners, ElementsAre(0, 1, 2))
      << "blanks behind it";
}

TEST(Obj, OnlyAVertexThatAFaceNamesNeedsItsCoordinates) {
  EXPECT_THAT(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan nan nan\nf 1 2 3\n").corners, ElementsAre(0, 1, 2));
  EXPECT_THAT(refusal_of("v 0 0 0\nv 1 0 0\nl 1 2\n"), HasSubstr("no faces: it is a cloud of points"));
}

TEST(Obj, ANumberBeyondADoubleIsRefusedAndOneBelowItIsZero) {
  EXPECT_THAT(refusal_of("v 0 0 0\nv 1e400 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("not finite"));
  EXPECT_EQ(read_obj("v 0 0 0\nv 1 1e-400 0\nv 0 1 0\nf 1 2 3\n").vertices[1],
            Eigen::Vector3d(1.0, 0.0, 0.0));
}

TEST(Obj, AFaceMayStandBeforeItsVerticesAndCountsBackFromItself) {
  EXPECT_THAT(read_obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\nv 5 5 5\n").corners,
              ElementsAre(0, 1, 2, 2, 1, 0));
}

TEST(Obj, SR27_WhatIsLeftOutIsNoted) {
  EXPECT_THAT(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\nl 1 2\np 1\n").notes,
              ElementsAre(HasSubstr("1 faces of fewer than three corners")));
  EXPECT_THAT(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nsurf 0 1 0 1 1 2 3\n").notes,
              ElementsAre(HasSubstr("free-form")));
}

TEST(Obj, WhatIsWrongIsRefusedWithItsLine) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(refusal_of(vertices + "f 1 2 4\n"),
              HasSubstr("line 4 has a face that names vertex 4; the file has 3 vertices"));
  EXPECT_THAT(refusal_of(vertices + "f 1 2 -4\n"), HasSubstr("line 4 has a face that names vertex -4"));
  EXPECT_THAT(refusal_of(vertices + "f 0 1 2\n"),
              HasSubstr("line 4 has a face with the corner '0'; allowed"));
  EXPECT_THAT(refusal_of(vertices + "f a b c\n"), HasSubstr("the corner 'a'"));
  EXPECT_THAT(refusal_of("v 0 0\n"), HasSubstr("line 1 has a vertex of fewer than three coordinates"));
  EXPECT_THAT(refusal_of("\nv 0 x 0\n"), HasSubstr("line 2 has 'x' as a coordinate"));
  EXPECT_THAT(refusal_of("v 0 inf 0\nv 0 0 0\nv 1 0 0\nf 1 2 3\n"), HasSubstr("not finite"));
  EXPECT_THAT(refusal_of("call other.obj\n"), HasSubstr("runs 'call'"));
}

TEST(Obj, WhateverStandsInAFileIsReadOrRefused) {
  std::mt19937 random(4);
  const std::string whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1/1/1 2 \\\n3\nf -1 -2 -3 -4\n";
  for (int round = 0; round < 3000; ++round) {
    std::string text = whole;
    for (int i = 0; i < 3; ++i) text[random() % text.size()] = static_cast<char>(random() % 256);
    text.resize(1 + random() % text.size());
    try {
      const Polygons read = read_obj(text);
      for (const std::uint32_t corner : read.corners) ASSERT_LT(corner, read.vertices.size());
    } catch (const UnreadableMesh&) {
    }
  }
}

}  // namespace
}  // namespace phantom::geometry::detail::obj_test
