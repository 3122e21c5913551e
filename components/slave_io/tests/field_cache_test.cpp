#include "components/slave_io/field_cache.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

#include "common/geometry/primitives.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {
namespace {

namespace fs = std::filesystem;

class FieldCacheTest : public testing::Test {
 protected:
  FieldCacheTest() {
    cell_.min_m = {-0.5, -0.5, -0.5};
    cell_.max_m = {0.5, 0.5, 0.5};
  }
  ~FieldCacheTest() override { fs::remove_all(folder_); }

  /// How often the work was looked at: 0 if nothing was built.
  int work_of_a_start(double radius_m = 0.2) {
    std::atomic<int> asked{0};
    const FieldWorld world(
        cell_, {{geometry::make_sphere(radius_m, 5), 5}}, config_, [&] { return ++asked > 0; }, &cache_);
    const auto found = world.query({0, 0, radius_m + 0.01});
    EXPECT_NEAR(found.distance_m, 0.01, 0.0015);
    EXPECT_EQ(found.object, 5);
    return asked;
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_)) found.push_back(entry.path());
    return found;
  }

  const fs::path folder_ =
      fs::temp_directory_path() / ("field_cache_" + std::to_string(getpid())) / "contact_fields";
  FieldCache cache_{folder_};
  runtime::CellConfig cell_;
  ContactConfig config_;
};

TEST_F(FieldCacheTest, TheSecondStartBuildsNothing) {
  EXPECT_GT(work_of_a_start(), 0);
  EXPECT_EQ(files().size(), 2U) << "a fine field and a coarse one, nothing unfinished";
  EXPECT_EQ(work_of_a_start(), 0);
}

TEST_F(FieldCacheTest, AnythingElseMakesAnotherField) {
  work_of_a_start();
  EXPECT_GT(work_of_a_start(0.2001), 0) << "another body";
  cell_.max_m.x() += 0.1;
  EXPECT_GT(work_of_a_start(), 0) << "another grid";
  cell_.max_m.x() -= 0.1;
  config_.clearance_range_m *= 0.9;
  EXPECT_GT(work_of_a_start(), 0) << "another band";
}

TEST_F(FieldCacheTest, TheOldestAreRemoved) {
  for (int i = 0; i < 5; ++i) work_of_a_start(0.1 + 0.001 * i);
  EXPECT_EQ(files().size(), FieldCache::kMostKept);
  EXPECT_EQ(work_of_a_start(0.104), 0);
  EXPECT_GT(work_of_a_start(0.1), 0);
}

TEST_F(FieldCacheTest, ADamagedFileIsBuiltAnewAndReplaced) {
  work_of_a_start();
  for (const fs::path& path : files()) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(fs::file_size(path) / 2));
    file.write("no field", 8);
  }
  EXPECT_GT(work_of_a_start(), 0);
  EXPECT_EQ(work_of_a_start(), 0);
  for (const fs::path& path : files()) fs::resize_file(path, 20);
  EXPECT_GT(work_of_a_start(), 0);
  EXPECT_EQ(work_of_a_start(), 0);
}

TEST_F(FieldCacheTest, AFolderThatCannotBeWrittenOnlyMakesTheNextStartSlow) {
  fs::create_directories(folder_.parent_path());
  std::ofstream(folder_) << "a file stands in its place";
  EXPECT_GT(work_of_a_start(), 0);
  EXPECT_GT(work_of_a_start(), 0);
}

}  // namespace
}  // namespace phantom::slave_io
