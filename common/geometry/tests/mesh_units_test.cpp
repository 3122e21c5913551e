#include "common/geometry/mesh/mesh_units.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace phantom::geometry {
namespace {

TEST(MeshUnits, GuessesMillimetresWhereMetresWouldBeTooLarge) {
  EXPECT_EQ(guess_unit({0.1, 0.2, 0.3}).scale, 1.0);
  EXPECT_EQ(guess_unit({20.0, 0.2, 0.3}).scale, 1.0);
  EXPECT_EQ(guess_unit({0.1, 20.5, 0.3}).scale, 0.001);
  EXPECT_EQ(guess_unit({0, 0, 0}).scale, 1.0);
  EXPECT_EQ(guess_up("Stereolithography (STL) Importer"), UpAxis::kZ);
  EXPECT_EQ(guess_up("Direct3D XFile Importer"), UpAxis::kY);
}

TEST(MeshUnits, ReadsWhatTextFormatsDeclare) {
  const auto amf = declared_in_text("Additive manufacturing file format(AMF) Importer",
                                    "<?xml version=\"1.0\"?>\n<amf version=\"1.1\" unit = 'inch'>");
  EXPECT_EQ(amf.scale, 0.0254);
  EXPECT_EQ(amf.up, UpAxis::kZ);
  EXPECT_EQ(declared_in_text("Additive", "<amf>").scale, 0.001);
  EXPECT_FALSE(declared_in_text("Additive", "<amf unit=\"cubit\">").scale);
  EXPECT_EQ(declared_in_text("3mf Importer", "<model xml:lang=\"de\" unit=\"Centimeter\">").scale, 0.01);
  EXPECT_EQ(declared_in_text("3mf Importer", "<models unit=\"meter\"/><model a=\"unit\">").scale, 0.001);

  const auto gex =
      declared_in_text("Open Game Engine Exchange",
                       "Metric (key = \"distance\") {float {0.01}}\n"
                       "Metric (key = \"angle\") {float {1}}\nMetric (key = \"up\") {string {\"y\"}}");
  EXPECT_EQ(gex.scale, 0.01);
  EXPECT_EQ(gex.up, UpAxis::kY);

  EXPECT_EQ(
      declared_in_text("Drawing Interchange Format (DXF) Importer", "9\n$INSUNITS\n 70\n     4\n  9\n").scale,
      0.001);
  EXPECT_FALSE(declared_in_text("Drawing Interchange", "9\n$INSUNITS\n 70\n0\n").scale);
  EXPECT_FALSE(declared_in_text("Drawing Interchange", "9\n$INSUNITS\n 70\n99\n").scale);

  const auto dae = declared_in_text("Collada Importer", "<asset><unit meter=\"nan\"/></asset>");
  EXPECT_EQ(dae.scale, 1.0);  // the standard's defaults
  EXPECT_EQ(dae.up, UpAxis::kY);
  EXPECT_FALSE(declared_in_text("Stereolithography (STL) Importer", "solid unit=mm").scale);
}

TEST(MeshUnits, LivesThroughAnyText) {
  const std::string whole =
      "<asset><unit meter='0.1' /><up_axis>Z_UP</up_axis></asset><model unit=\"inch\"><amf unit='foot'>"
      "Metric (key = \"distance\") {float {0.01}} $INSUNITS\n70\n4\n";
  std::mt19937 random(5);
  for (int round = 0; round < 2000; ++round) {
    std::string text = whole;
    for (int i = 0; i < 4; ++i) text[random() % text.size()] = "<>\"'={} \n9e-"[random() % 12];
    text.resize(random() % text.size());
    for (const char* format :
         {"Collada", "Additive", "3mf", "Open Game Engine Exchange", "Drawing Interchange"}) {
      const DeclaredFrame frame = declared_in_text(format, text);
      if (frame.scale) {
        EXPECT_TRUE(std::isfinite(*frame.scale) && *frame.scale > 0);
      }
    }
  }
}

TEST(MeshUnits, NamesUnits) {
  EXPECT_EQ(unit_name(0.0254), "inches");
  EXPECT_EQ(unit_name(0.001), "millimetres");
  EXPECT_EQ(unit_name(0.25), "0.25 m");
}

}  // namespace
}  // namespace phantom::geometry
