#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "common/geometry/mesh/mesh_io.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/workspace_survey/object_text.hpp"
#include "components/workspace_survey/part_picture.hpp"
#include "components/workspace_survey/tests/rig.hpp"

namespace phantom::workspace_survey {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class LibraryTest : public InFolder {};

TEST_F(LibraryTest, TheShippedOneHasItsPartsInMetres) {
  const Library& library = shipped_library();
  ASSERT_EQ(library.parts.size(), 9u);
  EXPECT_NEAR(library.models[find_part(library, "bar")].extent_m, std::sqrt(0.8 * 0.8 + 2 * 0.05 * 0.05),
              1e-6);
  for (const LibraryPart& part : library.parts) EXPECT_TRUE(part.notes.empty()) << part.name;
  EXPECT_THAT(refusal([&] { find_part(library, "teapot"); }),
              AllOf(HasSubstr("'teapot'"), HasSubstr("allowed: v_groove_block, cube")));
}

TEST_F(LibraryTest, WithoutAListEveryMeshIsAPartWithItsGuessesTold) {
  std::filesystem::copy(source("deploy/parts/cube.obj"), folder_ / "cube.obj");
  write("notes.txt", "no mesh");
  const Library library = load_library(folder_);
  ASSERT_EQ(library.parts.size(), 1u);
  EXPECT_EQ(library.parts[0].name, "cube");
  EXPECT_FALSE(library.parts[0].notes.empty()) << "the unit is a guess";
}

TEST_F(LibraryTest, WhatCannotBeUsedIsNamed) {
  EXPECT_THAT(refusal([&] { load_library(folder_ / "none"); }), HasSubstr("no such folder"));
  EXPECT_THAT(refusal([&] { load_library(folder_); }), HasSubstr("holds no part"));
  write("library.yaml", "parts: [{name: a, mesh: a.obj, mesh_scale: 0.001}]\n");
  EXPECT_THAT(refusal([&] { load_library(folder_); }),
              AllOf(HasSubstr("library.yaml:1"), HasSubstr("a.obj"), HasSubstr("is not there")));
  EXPECT_THROW(load_library(folder_), core::MissingError);
  write("a.obj", "garbage");
  EXPECT_THAT(refusal([&] { load_library(folder_); }), AllOf(HasSubstr("part 'a'"), HasSubstr("a.obj")));
  write("library.yaml", "parts: [{name: a, mesh: a.obj}]\n");
  EXPECT_THAT(refusal([&] { load_library(folder_); }), HasSubstr("mesh_scale"));
  write("library.yaml", "parts: [{name: a, mesh: a.obj, mesh_scale: 1, size: 3}]\n");
  EXPECT_THAT(refusal([&] { load_library(folder_); }), HasSubstr("size"));
}

// Tries workspace_survey: a mesh of the library is broken; has no plane face that can be measured
TEST_F(LibraryTest, ABrokenMeshIsLeftOutAndTheOthersAreThere) {
  std::filesystem::copy(source("deploy/parts/cube.obj"), folder_ / "cube.obj");
  write("wedge.obj", "garbage");
  write("ball.stl", "solid ball\nendsolid ball\n");
  for (const bool listed : {false, true}) {
    if (listed)
      write(
          "library.yaml",
          "parts:\n  - {name: wedge, mesh: wedge.obj, mesh_scale: 1}\n  - {name: ball, mesh: ball.stl, mesh_scale: 1}\n"
          "  - {name: cube, mesh: cube.obj, mesh_scale: 0.001}\n");
    const Library library = load_library(folder_);
    ASSERT_EQ(library.parts.size(), 1u);
    ASSERT_EQ(library.models.size(), 1u);
    EXPECT_EQ(library.models[0].name, "cube");
    EXPECT_EQ(library.unusable.size(), 2u);
    EXPECT_THAT(refusal([&] { find_part(library, "wedge"); }),
                AllOf(HasSubstr("part 'wedge'"), HasSubstr("wedge.obj")));
  }
}

// The picture's left half shows a part from its front, right and above; there a convex part covers as much as
// its faces do that look that way, and the near ones hide the far ones.
TEST_F(LibraryTest, APartsPictureShowsItsShapeAndItsNearSide) {
  constexpr int kSide = 320;
  const Eigen::Vector3d towards = Eigen::Vector3d(1.0, -1.6, 1.1).normalized();
  const auto covered = [](const cv::Mat& picture, cv::Point at) {
    const auto pixel = picture.at<cv::Vec3b>(at);
    return pixel[0] < 240 || pixel[2] < 240;
  };
  for (const char* name : {"cube", "bar", "brick", "wedge", "hexagon"}) {
    const survey::PartModel& part = shipped_library().models[find_part(shipped_library(), name)];
    const cv::Mat picture = cv::imdecode(part_picture(part), cv::IMREAD_COLOR);
    ASSERT_EQ(picture.cols, 2 * kSide);
    int pixels = 0, behind = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        pixels += covered(picture, {x, y}) ? 1 : 0;
        behind += covered(picture, {x + kSide, y}) ? 1 : 0;
      }
    }
    double seen_m2 = 0.0;
    for (const survey::PartFace& face : part.faces)
      seen_m2 += std::max(0.0, face.normal_O.dot(towards)) * face.area_m2;
    const double wanted = seen_m2 * std::pow(0.92 * kSide / part.extent_m, 2);
    EXPECT_GT(pixels, 0.98 * wanted) << name;
    EXPECT_LT(pixels, 1.01 * wanted + 700) << name << ": its outline lies half outside of it";
    EXPECT_GT(behind, 1000) << name;
  }
  const survey::PartModel& cube = shipped_library().models[find_part(shipped_library(), "cube")];
  const cv::Mat picture = cv::imdecode(part_picture(cube), cv::IMREAD_COLOR);
  EXPECT_GT(picture.at<cv::Vec3b>(kSide / 4, kSide / 2)[1],
            picture.at<cv::Vec3b>(2 * kSide / 3, 3 * kSide / 4)[1] + 20)
      << "its top is lit, not its bottom";
}

TEST_F(LibraryTest, ItsListSaysWhatTellsPartsApart) {
  const std::string list = parts_text(shipped_library(), 0.005);
  EXPECT_EQ(std::ranges::count(list, '\n'), 9);
  EXPECT_THAT(
      list,
      AllOf(
          HasSubstr("bar                  50 x 50 x 800 mm, 16 : 1, 6 plane faces, 800 mm is its alone\n"),
          HasSubstr("cube                 120 x 120 x 120 mm, 1 : 1, 6 plane faces, no length of its own\n"),
          HasSubstr("228.3 mm is its alone")));
  EXPECT_THAT(parts_text(shipped_library(), 0.05), testing::Not(HasSubstr("228.3 mm")));
}

// What is sent is what wva_server reads: the same shape, at the pose, with the guard.
TEST_F(LibraryTest, AnObjectsTextIsReadAsTheObjectItself) {
  const runtime::CellConfig cell = runtime::load_cell(source("deploy/cells/hot_cell/cell.yaml"));
  const geometry::Pose X_WO{geometry::rotation_from_rpy(0.3, -0.4, 2.0), {0.1, -0.2, 0.6}};
  for (std::size_t i = 0; i < shipped_library().parts.size(); ++i) {
    const LibraryPart& part = shipped_library().parts[i];
    const survey::PartModel& model = shipped_library().models[i];
    const auto object =
        runtime::read_object_text(object_text(part, model, "a \"quoted\" name: #1", X_WO, 2), cell);
    EXPECT_EQ(object.name, "a \"quoted\" name: #1");
    EXPECT_EQ(object.profile.guard_vox, 2);
    const auto body = runtime::load_body(object, cell);
    ASSERT_EQ(body.mesh_O.triangles.size(), model.mesh_O.triangles.size()) << part.name;
    const geometry::BoundingBox here = body.body.mesh_W.bounding_box(),
                                there = model.mesh_O.transformed(X_WO).bounding_box();
    EXPECT_LT((here.min_m - there.min_m).norm() + (here.max_m - there.max_m).norm(), 1e-5F) << part.name;
  }
}

// Tries workspace_survey: a mesh too large to travel
TEST_F(LibraryTest, AMeshTooLargeToTravelIsRefusedWithWhatToDo) {
  LibraryPart vice = shipped_library().parts[find_part(shipped_library(), "vice")];
  vice.cell_mesh.clear();
  EXPECT_THAT(refusal([&] {
                object_text(vice, shipped_library().models[find_part(shipped_library(), "vice")], "vice", {},
                            0);
              }),
              AllOf(HasSubstr("too large to travel"), HasSubstr("cell_mesh")));
}

TEST_F(LibraryTest, TheShippedMeshesAreThoseThatTheirScriptMakes) {
  const std::string command = "python3 " + source("deploy/parts/make").string() + " " + folder_.string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    EXPECT_EQ(read(entry.path()), read(source("deploy/parts") / entry.path().filename())) << entry.path();
}

}  // namespace
}  // namespace phantom::workspace_survey
