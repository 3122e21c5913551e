// STL files that are valid but unusual: every writer's habits, mixed at random, give the shape that was
// written.
#include "common/geometry/mesh/stl_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "common/core/text.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/tests/mesh_files.hpp"

namespace phantom::geometry {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint32_t kMax = 1'000'000;

TextStl read(const std::string& text) { return read_text_stl(text, kMax); }

/// Writes a text STL as one of many programs might.
class StlWriter {
 public:
  explicit StlWriter(std::mt19937& random)
      : random_(random),
        upper_(chance()),
        split_(chance()),
        normals_(chance()),
        end_(std::array{"\n", "\r\n", "\r", "\n\t", " \n  "}[random() % 5]),
        blank_(std::array{" ", "\t", "  ", " \t"}[random() % 4]) {}

  std::string text(const std::vector<TriangleMesh>& solids) {
    std::string all = chance() ? "\xef\xbb\xbf" : "";
    if (chance()) all += end_ + " ";
    for (const TriangleMesh& solid : solids) {
      const std::string name = std::array{"",   " part",         " solid of facet 2", " endsolid",
                                          " 4", " facet normal", " vertex 1 2 3"}[random_() % 7];
      all += key("solid") + name + end_;
      for (const auto& triangle : solid.triangles) all += facet(solid, triangle);
      all += key("endsolid") + name + end_;
    }
    if (chance()) all += std::string(3, '\0');
    return all;
  }

 private:
  bool chance() { return random_() % 2 == 0; }
  std::string key(const std::string& word) {
    std::string text = word;
    if (split_ && word.starts_with("end")) text = "end" + blank_ + word.substr(3);
    if (upper_)
      std::ranges::transform(text, text.begin(),
                             [](char c) { return c >= 'a' ? static_cast<char>(c - 32) : c; });
    return text;
  }
  std::string facet(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& corners) {
    std::string text = key("facet");
    if (normals_) text += blank_ + key("normal") + blank_ + (chance() ? "0 0 0" : "nan nan -1.#IND");
    text += end_ + key("outer") + blank_ + key("loop") + end_;
    for (const std::uint32_t corner : corners) {
      text += key("vertex");
      for (const float x : mesh.vertices_m[corner]) text += blank_ + number(x);
      text += end_;
    }
    return text + key("endloop") + end_ + key("endfacet") + end_;
  }
  std::string number(float x) {
    std::string text = core::formatted(chance() ? "%.9g" : "%.9E", static_cast<double>(x));
    if (x >= 0 && random_() % 4 == 0) text = "+" + text;
    if (random_() % 8 == 0) std::ranges::replace(text, 'E', 'D');
    return text;
  }

  std::mt19937& random_;
  bool upper_, split_, normals_;
  std::string end_, blank_;
};

TEST(TextStl, OfAnyHabitGivesTheShapeThatWasWritten) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<TriangleMesh> solids;
    TriangleMesh all;
    for (std::size_t i = random() % 4 + 1; i > 0; --i) {
      const float size = 0.1F * static_cast<float>(random() % 20 + 1);
      TriangleMesh solid;  // some are empty
      if (random() % 3 != 0) solid = make_box({size, 0.3, 1e-3});
      for (auto& vertex : solid.vertices_m) vertex.x() += 10.0F * static_cast<float>(i);
      all.append(solid);
      solids.push_back(solid);
    }
    const std::string text = StlWriter(random).text(solids);
    SCOPED_TRACE(text.substr(0, 400));
    ASSERT_TRUE(looks_like_text_stl({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
    const TextStl stl = read(text);
    ASSERT_THAT(stl.problem, IsEmpty());
    ASSERT_THAT(stl.notes, IsEmpty());
    ASSERT_TRUE(stl.mesh.finite);
    ASSERT_EQ(stl.mesh.triangles.size(), all.triangles.size());
    for (std::size_t i = 0; i < all.triangles.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(stl.mesh.vertices_m[stl.mesh.triangles[i][k]], all.vertices_m[all.triangles[i][k]]);
  }
}

TEST(TextStl, SR27_ThatEndsEarlyGivesWhatIsWholeAndTellsOfIt) {
  const std::string whole = ascii_stl(make_box({1, 2, 3}));
  std::size_t before = 0;
  for (std::size_t cut = 6; cut < whole.size() - 1; cut += 7) {
    const TextStl stl = read(whole.substr(0, cut));
    if (stl.problem.empty()) {
      EXPECT_GE(stl.mesh.triangles.size(), before);
      before = stl.mesh.triangles.size();
    }
    if (cut < whole.rfind("endsolid")) {
      EXPECT_FALSE(stl.problem.empty() && stl.notes.empty()) << "at " << cut;
    }
  }
  EXPECT_EQ(before, 12U);
  EXPECT_THAT(read(whole.substr(0, whole.rfind("facet normal"))).notes,
              ElementsAre(HasSubstr("no 'endsolid'")));
}

TEST(TextStl, NamesTheLineOfAFault) {
  const std::string start = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
  EXPECT_EQ(read(start + "vertex 1 0,5 0\n").problem, "line 5: '0,5' where a facet has: a number");
  EXPECT_EQ(read(start + "vertx 1 0 0\n").problem, "line 5: 'vertx' where a facet has: vertex or endloop");
  EXPECT_EQ(read(start + "endloop\n").problem, "line 5: 'endloop' where a facet has: three vertices");
  EXPECT_THAT(read("solid s\ncolor 1 0 0\nendsolid\n").notes,
              ElementsAre("line 2 is passed over: 'color' is no key word of a text STL"));
  EXPECT_TRUE(read_text_stl(ascii_stl(make_box({1, 1, 1})), 11).too_many);
  EXPECT_FALSE(read_text_stl(ascii_stl(make_box({1, 1, 1})), 12).too_many);
}

class StlFiles : public MeshFiles {
 protected:
  std::string binary(const std::string& head) const {
    const auto bytes = binary_stl(make_box({1, 1, 2}));
    std::string text(bytes.begin(), bytes.end());
    return text.replace(0, head.size(), head);
  }
};

TEST_F(StlFiles, BinaryOnesMayBeginWithSolidAndHaveBytesBehindThem) {
  for (const std::string head :
       {"", "solid made by a scanner", "SOLID\nfacet normal", "COLOR=\xff\xff\xff\xff"}) {
    for (const std::string& tail : {std::string(), std::string(37, '\0'), std::string("\r\n"),
                                    std::string(50, 'x'), std::string("endsolid\n")}) {
      const auto mesh = load_mesh(write("part.stl", binary(head) + tail), {.scale = 1.0, .y_up = false});
      ASSERT_TRUE(mesh) << mesh.status().message();
      EXPECT_NEAR(enclosed_volume_m3(*mesh), 2.0, 1e-6);
      if (tail.empty()) {
        EXPECT_THAT(mesh->notes, IsEmpty());
      } else {
        EXPECT_THAT(mesh->notes,
                    ElementsAre(HasSubstr("has " + std::to_string(tail.size()) +
                                          " bytes after the 12 triangles that its head declares")));
      }
    }
  }
}

// Tries wva_server: is a Git LFS pointer
TEST_F(StlFiles, ThatAreNoneAreNamedForWhatTheyAre) {
  const std::string whole = binary("");
  expect_refused(write("cut.stl", whole.substr(0, whole.size() - 1)), "Was it cut short?");
  expect_refused(write("none.stl", std::string(84, '\0') + whole), "of which the head declares 0 triangles");
  expect_refused(write("remark.stl", "# by hand\nsolid x\n" + std::string(100, ' ') + "endsolid x\n"),
                 "is a text that does not begin with 'solid', as a text STL does, but with '# by hand'");
  expect_refused(write("wide.stl", std::string("\xff\xfes\0o\0l\0i\0d\0 \0", 14)), "UTF-16");
  expect_refused(write("part.stl", "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n"),
                 "is a pointer of Git LFS");
  expect_refused(write("part.obj", "/annex/objects/SHA256E-s10--00.obj\n"), "is a pointer of git-annex");
  expect_refused(write("part.step",
                       "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
                       "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"),
                 "is a STEP file of a CAD program");
}

TEST_F(StlFiles, TextOnesAreReadAsTheirBytesStand) {
  const auto mesh = load_mesh(write("part.STL",
                                    "\xef\xbb\xbf\n SOLID Part\r\n\tFACET NORMAL 0 0 1\r\n\tOUTER LOOP\r\n"
                                    "\tVERTEX 0 0 0\r\n\tVERTEX 1E0 0 0\r\n\tVERTEX 0 1 0\r\n\tENDLOOP\r\n"
                                    "\tENDFACET\r\nENDSOLID Part\r\n\x1a"),
                              {.scale = 1.0, .y_up = false});
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 1U);
  EXPECT_THAT(mesh->notes, IsEmpty());
}

}  // namespace
}  // namespace phantom::geometry
