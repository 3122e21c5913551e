// 3MF packages as slicers write them: objects in several model parts, components with transforms, what is not
// built.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "common/core/text.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/tests/mesh_files.hpp"

namespace phantom::geometry {
namespace {

using ::testing::IsEmpty;
using Members = std::vector<std::pair<std::string, std::string>>;

const std::string kRelationships =
    R"(<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>)";

std::string mesh_text(const TriangleMesh& mesh) {
  std::string text = "<mesh><vertices>";
  for (const auto& v : mesh.vertices_m)
    text += core::formatted("<vertex x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/>", static_cast<double>(v.x()),
                            static_cast<double>(v.y()), static_cast<double>(v.z()));
  text += "</vertices><triangles>";
  for (const auto& t : mesh.triangles)
    text += core::formatted("<triangle v1='%u' v2='%u' v3='%u'/>", t[0], t[1], t[2]);
  return text + "</triangles></mesh>";
}
std::string object_text(int id, const std::string& inside) {
  return "<object id=\"" + std::to_string(id) + "\" type=\"model\">" + inside + "</object>";
}
std::string model_text(const std::string& objects, const std::string& items, const std::string& more = "",
                       const std::string& unit = "millimeter") {
  return "<?xml version=\"1.0\"?>\n<!-- <object id=\"1\"> is no object --><model unit=\"" + unit +
         "\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
         "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" " +
         more + "><resources>" + objects + "</resources><build>" + items + "</build></model>";
}
std::string use_text(const std::string& tag, int id, const std::string& part = "",
                     const std::string& transform = "") {
  return "<" + tag + " objectid=\"" + std::to_string(id) + "\"" +
         (part.empty() ? "" : " p:path=\"" + part + "\" p:UUID=\"0-1\"") +
         (transform.empty() ? "" : " transform=\"" + transform + "\"") + "/>";
}
std::string component(int id, const std::string& part = "", const std::string& transform = "") {
  return "<components>" + use_text("component", id, part, transform) + "</components>";
}

class ThreeMf : public MeshFiles {
 protected:
  std::filesystem::path package(const std::string& root, Members others = {}) {
    others.insert(others.begin(), {{"_rels/.rels", kRelationships}, {"3D/3dmodel.model", root}});
    return write_archive("part.3mf", others);
  }
  void expect_volume(const std::filesystem::path& path, double volume_m3) {
    const auto mesh = load_mesh(path);
    ASSERT_TRUE(mesh) << mesh.status().message();
    EXPECT_NEAR(enclosed_volume_m3(*mesh), volume_m3, 1e-6 * volume_m3);
    EXPECT_THAT(mesh->notes, IsEmpty());
  }
  const std::string box_ = mesh_text(make_box({100, 100, 100})), half_ = mesh_text(make_box({50, 50, 50}));
  const std::string required_ = "requiredextensions=\"p\"";
  const Members other_{{"3D/Objects/one.model", model_text(object_text(1, box_), "", required_)}};
  const std::string path_ = "/3D/Objects/one.model";
};

TEST_F(ThreeMf, SR27_PartsInOtherModelsAreRead) {
  expect_volume(package(model_text(object_text(2, component(1, path_)),
                                   use_text("item", 2, "", "1 0 0 0 1 0 0 0 1 50 0 0"), required_),
                        other_),
                1e-3);
  expect_volume(package(model_text(object_text(1, half_) +
                                       object_text(3, component(1, path_, "1 0 0 0 1 0 0 0 1 200 0 0")),
                                   use_text("item", 1) + use_text("item", 3), required_),
                        other_),
                1e-3 + 1.25e-4);
  expect_volume(package(model_text("", use_text("item", 1, path_), required_), other_), 1e-3);
}

TEST_F(ThreeMf, WhatIsNotBuiltIsNotRead) {
  const std::string two = "<components>" + use_text("component", 1) +
                          use_text("component", 1, "", "1 0 0 0 1 0 0 0 1 200 0 0") + "</components>";
  expect_volume(package(model_text(object_text(1, box_) + object_text(2, two) + object_text(9, half_),
                                   use_text("item", 2, "", "0.5 0 0 0 0.5 0 0 0 0.5 0 0 0"))),
                2.5e-4);
}

// Tries wva_server: has 3MF parts that would vanish
TEST_F(ThreeMf, SR27_WhatWouldVanishIsRefused) {
  const std::string item = use_text("item", 1), one = object_text(1, box_);
  expect_refused(package(model_text(one, "")), "builds nothing");
  expect_refused(package(model_text(one, item + use_text("item", 7))),
                 "builds object 7 of its part /3D/3dmodel.model");
  expect_refused(package(model_text(object_text(1, component(1, path_)), item)), "no model part " + path_);
  expect_refused(package(model_text(object_text(1, component(2)) + object_text(2, component(1)), item)),
                 "components within components without end");
  expect_refused(
      package(model_text(one, item, "requiredextensions=\"b\" xmlns:b=\"http://example.org/slice/2015/07\"")),
      "requires the 3MF extension http://example.org/slice/2015/07");
  expect_refused(package(model_text(object_text(1, "<mesh><b:beamlattice/></mesh>"), item)), "beamlattice");
  expect_refused(package(model_text(object_text(1, component(1, path_)), item),
                         {{"3D/Objects/one.model", model_text(one, "", "", "inch")}}),
                 "different units");
  std::string wrong = box_;
  wrong.replace(wrong.find("v1='") + 4, 1, "8");
  expect_refused(package(model_text(object_text(1, wrong), item)), "names a vertex which does not exist");
  const std::string whole = model_text(one, item);
  expect_refused(package(whole.substr(0, whole.rfind("<vertex") + 9)), "ends within a tag");
  expect_refused(package(model_text(one + one, item)), "object 1 twice");
  expect_refused(write("none.3mf", "PK and no more"), "no ZIP archive");
  expect_refused(package(model_text(one, item), {}), "more than 11 triangles", {.max_triangles = 11});
}

TEST_F(ThreeMf, AUnitThatTheStandardLacksIsRefusedAndAPrintersSupportIsNoted) {
  const std::string one = object_text(1, box_);
  expect_refused(package(model_text(one, use_text("item", 1), "", "furlong")),
                 "is in the unit 'furlong'; allowed: micron, millimeter");
  std::string support = one;
  support.replace(support.find("type=\"model\""), 12, "type=\"support\"");
  const auto mesh = load_mesh(package(model_text(support, use_text("item", 1))));
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_THAT(mesh->notes, ::testing::ElementsAre(::testing::HasSubstr("is of type 'support', and counts")));
}

/// Objects of boxes and of components, in three parts, against the same sum by hand.
TEST_F(ThreeMf, RandomPackagesAreReadWhole) {
  std::mt19937 random(3);
  const std::string parts[] = {"/3D/3dmodel.model", "/3D/Objects/a.model", "/3D/b.model"};
  for (int trial = 0; trial < 25; ++trial) {
    std::string objects[3];
    std::vector<std::pair<std::size_t, TriangleMesh>> made;  // part and shape, in the object's frame
    const auto use = [&](const std::string& tag, std::size_t from, TriangleMesh& shape) {
      const std::size_t chosen = random() % made.size();
      const auto& [part, inner] = made[chosen];
      Eigen::Affine3d at = Eigen::Affine3d::Identity();
      at.linear() = Eigen::Matrix3d::Random() + 0.1 * Eigen::Matrix3d::Identity();
      at.translation() = 100 * Eigen::Vector3d::Random();
      std::string numbers;
      for (int i = 0; i < 12; ++i) numbers += core::formatted("%.12g ", at.matrix()(i % 3, i / 3));
      TriangleMesh placed = inner;
      for (auto& vertex : placed.vertices_m) vertex = (at * vertex.cast<double>()).cast<float>();
      if (at.linear().determinant() < 0)
        for (auto& triangle : placed.triangles) std::swap(triangle[1], triangle[2]);
      shape.append(placed);
      return use_text(tag, static_cast<int>(chosen) + 1, part == from && random() % 2 == 0 ? "" : parts[part],
                      numbers);
    };
    for (int id = 1; id <= 8; ++id) {
      const std::size_t part = random() % 3;
      TriangleMesh shape;
      std::string inside;
      if (id < 3 || random() % 3 == 0) {
        shape = make_box({10.0 * static_cast<double>(random() % 9 + 1), 30, 20});
        inside = mesh_text(shape);
      } else {
        for (std::size_t i = random() % 3 + 1; i > 0; --i) inside += use("component", part, shape);
        inside = "<components>" + inside + "</components>";
      }
      objects[part] += object_text(id, inside);
      made.emplace_back(part, shape);
    }
    TriangleMesh whole;
    std::string items;
    for (std::size_t i = random() % 3 + 1; i > 0; --i) items += use("item", 0, whole);
    const auto mesh = load_mesh(package(
        model_text(objects[0], items, required_),
        {{"3D/Objects/a.model", model_text(objects[1], "")}, {"3D/b.model", model_text(objects[2], "")}}));
    ASSERT_TRUE(mesh) << mesh.status().message();
    EXPECT_EQ(mesh->triangles.size(), whole.triangles.size());
    EXPECT_NEAR(enclosed_volume_m3(*mesh), 1e-9 * enclosed_volume_m3(whole),
                1e-4 * 1e-9 * std::abs(enclosed_volume_m3(whole)));
    const auto got = mesh->bounding_box(), wanted = whole.bounding_box();
    EXPECT_LT((1000.0F * got.min_m - wanted.min_m).norm() + (1000.0F * got.max_m - wanted.max_m).norm(),
              1e-2F);
  }
}

}  // namespace
}  // namespace phantom::geometry
