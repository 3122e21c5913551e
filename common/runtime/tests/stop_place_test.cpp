#include "common/runtime/process/stop_place.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>

#include "common/runtime/process/stop_file.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using teleop::StopCause;
using teleop::StopRecord;
using testing::ElementsAre;
using testing::IsEmpty;

// An environment variable for the length of a test; nullptr: unset.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    value != nullptr ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Variable() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

class StopPlaceTest : public testing::Test {
 protected:
  ~StopPlaceTest() override { std::filesystem::remove_all(root_); }
  StopFile open(const StopPlace& place) const { return {place, "slave_io", {.domain = 7}}; }
  mode_t mode_of(const std::filesystem::path& path) const {
    struct stat about {};
    EXPECT_EQ(stat(path.c_str(), &about), 0) << path;
    return about.st_mode & 07777;
  }

  const std::filesystem::path root_ = test::new_folder();
  Variable given_{"PHANTOM_STATE_DIR", nullptr}, service_{"STATE_DIRECTORY", nullptr},
      state_home_{"XDG_STATE_HOME", nullptr}, home_{"HOME", "/nowhere/home"};
};

TEST_F(StopPlaceTest, SR03_IsOneOnAHostWhoeverStartsTheProcess) {
  const auto as_a_user = stop_place("", root_).folder;
  {
    const Variable another("HOME", "/nowhere/else");
    EXPECT_EQ(stop_place("", root_).folder, as_a_user);
  }
  {
    const Variable set_later("XDG_STATE_HOME", "/nowhere/xdg");
    EXPECT_EQ(stop_place("", root_).folder, as_a_user);
  }
  const Variable as_a_service("STATE_DIRECTORY", "/nowhere/service");
  EXPECT_EQ(stop_place("", root_).folder, as_a_user);
  std::filesystem::create_directories(root_ / "var/lib/phantom/stops");
  EXPECT_EQ(stop_place("", root_).folder, root_ / "var/lib/phantom/stops");
  EXPECT_FALSE(stop_place("", root_).shared);
}

TEST_F(StopPlaceTest, IsAnotherOnlyByOrder) {
  const Variable given("PHANTOM_STATE_DIR", "/given");
  EXPECT_EQ(stop_place("", root_).folder, "/given");
  EXPECT_EQ(stop_place("/option", root_).folder, "/option");
  EXPECT_THAT(stop_place("/option", root_).former, IsEmpty());
}

// As two users with different masks do it.
TEST_F(StopPlaceTest, SR03_AllUsersOfTheHostMayStopAndResetInTheSharedOne) {
  const StopPlace place = stop_place("", root_);
  const mode_t before = umask(077);
  { const StopFile file = open(place); }
  umask(before);
  EXPECT_EQ(mode_of(place.folder), 01777U);
  EXPECT_EQ(mode_of(place.folder / "slave_io.domain-7.stop"), 01666U);
}

TEST_F(StopPlaceTest, ItsFilesAreAsOpenAsAFolderThatSomebodyMade) {
  const auto folder = root_ / "var/lib/phantom/stops";
  std::filesystem::create_directories(folder);
  ASSERT_EQ(chmod(folder.c_str(), 02770), 0);
  const mode_t before = umask(027);
  { const StopFile file = open(stop_place("", root_)); }
  umask(before);
  EXPECT_EQ(mode_of(folder / "slave_io.domain-7.stop"), 0660U);
}

TEST_F(StopPlaceTest, SR03_AStopInAFormerPlaceIsAdoptedOnce) {
  const std::string service = (root_ / "service").string(), home = (root_ / "home").string();
  const Variable as_a_service("STATE_DIRECTORY", service.c_str());
  const Variable of_a_user("HOME", home.c_str());
  ASSERT_THAT(stop_place("", root_).former, ElementsAre(service, home + "/.local/state/phantom"));
  for (const std::filesystem::path& former : stop_place("", root_).former) {
    open({.folder = former}).write({8, StopCause::kEmergency});
    {
      StopFile file = open(stop_place("", root_));
      EXPECT_EQ(file.read(), (StopRecord{8, StopCause::kEmergency})) << former;
      file.write({});
    }
    EXPECT_EQ(open(stop_place("", root_)).read(), StopRecord{}) << "it came back from " << former;
  }
}

}  // namespace
}  // namespace phantom::runtime
