#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry {

class MeshFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "mesh_io_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// A file of that name, in a folder that is gone after the test.
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  /// The mesh as a text STL.
  static std::string ascii_stl(const TriangleMesh& mesh) {
    std::ostringstream text;
    text.precision(9);
    text << "solid part\n";
    for (const auto& t : mesh.triangles) {
      text << "facet normal 0 0 0\nouter loop\n";
      for (const auto v : t) text << "vertex " << mesh.vertices_m[v].transpose() << "\n";
      text << "endloop\nendfacet\n";
    }
    text << "endsolid part\n";
    return text.str();
  }
  /// Expects a refusal that names the file and says `reason`.
  static void expect_refused(const std::filesystem::path& path, const std::string& reason,
                             const MeshImportOptions& options = {}) {
    const auto mesh = load_mesh(path, options);
    ASSERT_FALSE(mesh) << path;
    EXPECT_THAT(mesh.status().message(), ::testing::HasSubstr(path.string()));
    EXPECT_THAT(mesh.status().message(), ::testing::HasSubstr(reason));
  }

  std::filesystem::path folder_;
};

}  // namespace phantom::geometry
