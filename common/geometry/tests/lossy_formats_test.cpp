#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/geometry/importer/importer.hpp"
#include "common/geometry/tests/mesh_files.hpp"

namespace phantom::geometry::detail::lossy_formats_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class LossyFormats : public MeshFiles {
 protected:
  std::string problem(const std::string& name, const std::string& text) {
    return check_lossy_format(write(name, text));
  }
  std::string x3d(const std::string& inside) {
    return problem("a.x3d", "<X3D><Scene>" + inside + "</Scene></X3D>");
  }
  std::string collada(const std::string& nodes, const std::string& head = "") {
    return problem("a.dae", "<COLLADA><asset>" + head +
                                "</asset><library_geometries><geometry id=\"g\"/></library_geometries>" +
                                nodes + "</COLLADA>");
  }
  std::string insert(const std::string& more) {
    return problem("a.dxf",
                   "0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nB\n10\n5\n" + more + "0\nENDSEC\n0\nEOF\n");
  }
};

// Tries wva_server: of AMF, X3D, COLLADA or DXF would be misread
TEST_F(LossyFormats, SR27_WhatAnImporterWouldLeaveOutOrMisplaceInSilenceIsRefused) {
  EXPECT_THAT(problem("a.amf", "<amf><object><mesh><volume/><volume/></mesh></object></amf>"),
              HasSubstr("several volumes"));
  for (const std::string node : {"Anchor", "Billboard", "Collision", "LOD", "ProtoInstance"})
    EXPECT_THAT(x3d("<" + node + " name='n'><Shape/></" + node + ">"), HasSubstr("has a node " + node));
  EXPECT_THAT(x3d("<unit category='length' conversionFactor='0.001'/>"), HasSubstr("a unit of 0.001 m"));
  EXPECT_THAT(collada("<node><instance_geometry url=\"#nope\"/></node>"),
              HasSubstr("places 'nope' (instance_geometry)"));
  EXPECT_THAT(collada("<node><instance_node url=\"b.dae#n\"/></node>"),
              HasSubstr("'b.dae#n' of another file"));
  EXPECT_THAT(collada("<node id='n'><skew>0 1 0 0 0 0 1</skew></node>"), HasSubstr("<skew>"));
  EXPECT_THAT(
      collada("<node id='a'><instance_node url='#b'/></node><node id='b'><instance_node url='#a'/></node>"),
      HasSubstr("a part of itself"));
  EXPECT_THAT(collada("<bind_shape_matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>"),
              HasSubstr("bind_shape_matrix"));
  for (const std::string meter : {"0", "-1", "x", "1e999"})
    EXPECT_THAT(collada("", "<unit meter='" + meter + "'/>"), HasSubstr("a unit of '" + meter + "' m"));
  EXPECT_THAT(insert("50\n90\n"), HasSubstr("a block that is turned"));
  EXPECT_THAT(insert("41\n2.0\n"), HasSubstr("a block that is scaled"));
  EXPECT_THAT(insert("70\n3\n"), HasSubstr("a block that is repeated"));
  EXPECT_THAT(problem("a.dxf", "0\nSECTION\n2\nENTITIES\n0\n3DSOLID\n0\nEOF\n"), HasSubstr("has a 3DSOLID"));
}

TEST_F(LossyFormats, WhatIsReadWholeIsNot) {
  EXPECT_THAT(problem("a.amf", "<amf><mesh><volume/></mesh><mesh><volume/></mesh></amf>"), IsEmpty());
  EXPECT_THAT(
      x3d("<!-- <Anchor/> --><Transform><Group><Shape/></Group></Transform>"
          "<unit category='length' conversionFactor='1.0'/><unit category='angle' conversionFactor='0.1'/>"),
      IsEmpty());
  EXPECT_THAT(collada("<node id='a'><instance_geometry url='#g'/><instance_node url='#b'/></node>"
                      "<node id='b'><node><instance_geometry url='#g'/></node></node>"
                      "<bind_shape_matrix> 1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1 </bind_shape_matrix>",
                      "<unit name='inch' meter='0.0254'/>"),
              IsEmpty());
  EXPECT_THAT(collada("<![CDATA[<skew>]]><node name='a > b' id='n'/><node><instance_node url='#n'/></node>"),
              IsEmpty())
      << "a bracket in a text";
  EXPECT_THAT(insert("41\n1.0\n50\n0\n70\n1\n"), IsEmpty());
  EXPECT_THAT(problem("a.obj", "<Anchor/>"), IsEmpty()) << "of another format";
}

TEST_F(LossyFormats, AnyBytesAreJudgedWithoutHarm) {
  std::mt19937 random(9);
  const std::string pieces[] = {"<node id='",
                                "'>",
                                "</node>",
                                "<instance_node url='#",
                                "<!--",
                                "-->",
                                "/>",
                                "<bind_shape_matrix>",
                                "\n0\nINSERT\n",
                                "50\n",
                                "<volume",
                                "\xff\xfe",
                                "<",
                                "="};
  for (int i = 0; i < 300; ++i) {
    std::string text;
    for (int k = 0; k < 40; ++k) text += pieces[random() % std::size(pieces)] + std::to_string(random() % 4);
    for (const char* name : {"a.dae", "a.amf", "a.x3d", "a.dxf"}) problem(name, text);
  }
}

}  // namespace
}  // namespace phantom::geometry::detail::lossy_formats_test
