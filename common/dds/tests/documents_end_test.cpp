#include "common/dds/endpoints/documents_end.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace phantom::dds::documents_end_test {
namespace {

using testing::HasSubstr;
constexpr core::Nanoseconds kDay_ns = 86'400 * core::kNsPerSecond;

class DocumentsEnds : public testing::Test {
 protected:
  DocumentsEnds() {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "rights") << "slave_io | slave_state | *\nmaster_io | master_state | *\n";
  }
  ~DocumentsEnds() override { std::filesystem::remove_all(folder_); }
  void make(const std::string& words) {
    const std::string command = std::string(PHANTOM_SOURCE_DIR "/deploy/security/make ") + words +
                                " --rights " + (folder_ / "rights").string() + " >/dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;  // NOLINT(concurrency-mt-unsafe)
  }
  std::filesystem::path site() const { return folder_ / "site"; }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("phantom_documents_" + std::to_string(getpid()));
};

// Tries slave_io: its security documents end within 30 days
TEST_F(DocumentsEnds, SR17_TheFirstToEndIsFoundAndTold) {
  make("site " + site().string() + " --days 20");
  make("rotate " + site().string() + " master_io --days 400");
  const core::Nanoseconds now_ns = core::utc_ns();
  const auto soon = documents_end(site(), "slave_io"), later = documents_end(site(), "master_io");
  ASSERT_TRUE(soon && later);
  EXPECT_NEAR(core::seconds(soon->utc_ns - now_ns), 20 * 86'400.0, 86'400.0);
  EXPECT_EQ(soon->document.parent_path().filename(), "slave_io");
  EXPECT_NEAR(core::seconds(later->utc_ns - now_ns), 200 * 86'400.0, 86'400.0) << "the authorities'";
  core::Health health{core::ComponentState::kRunning, "coupled", {}, {}};
  add_documents_end(health, *soon, now_ns);
  EXPECT_THAT(health.message, HasSubstr("coupled; " + soon->document.string() + " ends in "));
  EXPECT_THAT(health.message, HasSubstr("make rotate"));
  ASSERT_EQ(health.figures.size(), 1u);
  EXPECT_EQ(health.figures[0].name, "security_days_left");
  core::Health ended{core::ComponentState::kRunning, "", {}, {}};
  add_documents_end(ended, *soon, soon->utc_ns + 1);
  EXPECT_THAT(ended.message, HasSubstr("has ended"));
}

TEST_F(DocumentsEnds, NothingIsToldOfWhatLastsLonger) {
  core::Health health;
  add_documents_end(health, {"x", 31 * kDay_ns}, 0);
  EXPECT_EQ(health.message, "");
  EXPECT_TRUE(health.figures.empty());
  EXPECT_FALSE(documents_end(folder_ / "nowhere", "slave_io"));
}

}  // namespace
}  // namespace phantom::dds::documents_end_test
