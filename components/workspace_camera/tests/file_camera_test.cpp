#include "components/workspace_camera/file_camera.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "common/core/errors.hpp"
#include "components/workspace_camera/config.hpp"
#include "tests/support/files.hpp"

namespace phantom::workspace_camera::file_camera_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Clouds : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& xyz) {
    std::ofstream(folder_ / name) << "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n"
                                  << "DATA ascii\n"
                                  << xyz << '\n';
  }
  FileOptions options() const {
    return {folder_, {3, 1, 100.0, 100.0, 1.0, 0.0, 0.2, 8.0}, 15.0, 0.001, false};
  }
  /// The next image or error, which may take as long as reading a file does.
  static core::Expected<std::vector<std::uint16_t>> next(FileCamera& camera) {
    for (;;) {
      auto image = camera.next();
      if (!image) return image.status();
      if (*image) return **image;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  const std::filesystem::path folder_ = test::new_folder();
};

// Tries workspace_camera: a file of a camera's clouds is damaged
TEST_F(Clouds, ArePlayedInTheOrderOfTheirNamesAndADamagedOneIsLeftOut) {
  write("b.pcd", "0 0 2000");
  write("a.pcd", "-20 0 2000");
  write("c.pcd", "0 0 what");
  write("d.pcd", "20 0 2000");
  write("notes.txt", "");
  FileCamera camera(options());
  EXPECT_EQ(camera.files(), 4U);
  EXPECT_THAT(*next(camera), ElementsAre(2000, 0, 0)) << "in mm";
  EXPECT_THAT(*next(camera), ElementsAre(0, 2000, 0));
  const auto damaged = next(camera);
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.status().message(), HasSubstr("c.pcd: point 1: 'what' is no number"));
  EXPECT_THAT(*next(camera), ElementsAre(0, 0, 2000));
  EXPECT_TRUE(camera.at_end());
  const auto none = camera.next();
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->has_value());
}

TEST_F(Clouds, AreRepeatedIfAsked) {
  write("a.pcd", "0 0 1000");
  write("b.pcd", "0 0 2000");
  FileOptions again = options();
  again.repeat = true;
  FileCamera camera(again);
  for (int i = 0; i < 6; ++i) EXPECT_EQ((*next(camera))[1], i % 2 == 0 ? 1000 : 2000);
  EXPECT_FALSE(camera.at_end());
}

// Tries workspace_camera: a folder of clouds is missing; has none
TEST_F(Clouds, AFolderWithoutThemIsRefused) {
  EXPECT_THROW(FileCamera{options()}, core::ConfigError);
  FileOptions missing = options();
  missing.folder /= "nowhere";
  EXPECT_THROW(FileCamera{missing}, core::MissingError);
}

TEST_F(Clouds, TheirFolderIsRelativeToTheConfiguration) {
  const auto file = folder_ / "camera.yaml";
  std::ofstream(file) << "cameras:\n  - name: above\n    driver: files\n    pose: {xyz_m: [0, 0, 1]}\n"
                         "    files: {folder: clouds, unit_m: 0.001, focal_px: 300, repeat: true}\n";
  const WorkspaceCameraConfig config = load_config(file);
  const FileOptions& files = config.cameras.at(0).files;
  EXPECT_EQ(config.cameras[0].driver, CameraDriver::kFiles);
  EXPECT_EQ(files.folder, folder_ / "clouds");
  EXPECT_EQ(files.camera.fx_px, 300.0);
  EXPECT_EQ(files.camera.cx_px, 159.5);
  EXPECT_EQ(files.unit_m, 0.001);
  EXPECT_TRUE(files.repeat);
}

}  // namespace
}  // namespace phantom::workspace_camera::file_camera_test
