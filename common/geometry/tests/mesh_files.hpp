#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zip.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"
#include "tests/support/ascii_stl.hpp"
#include "tests/support/files.hpp"

namespace phantom::geometry {

class MeshFiles : public ::testing::Test {
 protected:
  /// A file of that name, in the test's own folder.
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  /// A zip archive of these members, in this order.
  std::filesystem::path write_archive(const std::string& name,
                                      const std::vector<std::pair<std::string, std::string>>& members) {
    const auto path = folder_ / name;
    const zipFile archive = zipOpen(path.c_str(), APPEND_STATUS_CREATE);
    for (const auto& [member, text] : members) {
      const zip_fileinfo info{};
      zipOpenNewFileInZip(archive, member.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6);
      zipWriteInFileInZip(archive, text.data(), static_cast<unsigned>(text.size()));
      zipCloseFileInZip(archive);
    }
    EXPECT_EQ(zipClose(archive, nullptr), ZIP_OK);
    return path;
  }
  /// Expects a refusal that names the file and says `reason`.
  static void expect_refused(const std::filesystem::path& path, const std::string& reason,
                             const MeshImportOptions& options = {}) {
    const auto mesh = load_mesh(path, options);
    ASSERT_FALSE(mesh) << path;
    EXPECT_THAT(mesh.status().message(), ::testing::HasSubstr(path.string()));
    EXPECT_THAT(mesh.status().message(), ::testing::HasSubstr(reason));
  }

  std::filesystem::path folder_ = test::new_folder();
};

}  // namespace phantom::geometry
