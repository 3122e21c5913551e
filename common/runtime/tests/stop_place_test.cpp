#include "common/runtime/process/stop_place.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <optional>
#include <utility>

#include "common/core/errors.hpp"
#include "common/runtime/process/stop_file.hpp"
#include "common/runtime/process/stop_folders.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using teleop::StopCause;
using teleop::StopRecord;
using testing::ElementsAre;
using testing::HasSubstr;
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
  const StopPlace place = stop_place("/option", root_);
  EXPECT_EQ(place.folder, "/option");
  EXPECT_EQ(place.host, "/given") << "which lists it";
  EXPECT_THAT(place.former, IsEmpty());
  EXPECT_TRUE(stop_place("/given", root_).host.empty()) << "it is the host's place, by another word";
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

TEST_F(StopPlaceTest, SR03_AStopFromBeforeThePackagesWereInstalledHolds) {
  open(stop_place("", root_)).write({8, StopCause::kEmergency});
  std::filesystem::create_directories(root_ / "var/lib/phantom/stops");
  EXPECT_EQ(open(stop_place("", root_)).read(), (StopRecord{8, StopCause::kEmergency}));
}

TEST_F(StopPlaceTest, SR03_AStopInOneOfTwoFoldersHoldsInTheOther) {
  const StopPlace by_order = stop_place(root_ / "by_order", root_),
                  second = stop_place(root_ / "second", root_), host = stop_place("", root_);
  const std::pair<StopPlace, StopPlace> kPairs[] = {
      {by_order, host}, {host, by_order}, {by_order, second}, {second, by_order}};
  for (const auto& [first, next] : kPairs) {
    open(first).write({9, StopCause::kEmergency});
    StopFile file = open(next);
    EXPECT_EQ(file.read(), (StopRecord{9, StopCause::kEmergency})) << first.folder << " then " << next.folder;
    file.write({});
  }
  for (const StopPlace& place : {by_order, second, host})
    EXPECT_EQ(open(place).read(), StopRecord{}) << "it came back in " << place.folder;
}

// Tries slave_io: another process of this side
// Tries master_io: another process of this side
TEST_F(StopPlaceTest, SR03_ASecondProcessOfASideIsRefusedWhereTheirFoldersDiffer) {
  const StopPlace by_order = stop_place(root_ / "by_order", root_), host = stop_place("", root_);
  const std::pair<StopPlace, StopPlace> kPairs[] = {{by_order, host}, {host, by_order}};
  for (const auto& [first, second] : kPairs) {
    const StopFile held = open(first);
    try {
      open(second);
      FAIL() << first.folder << " then " << second.folder;
    } catch (const core::MissingError& problem) {
      EXPECT_THAT(problem.what(), HasSubstr((first.folder / "slave_io.domain-7.stop").string()));
      EXPECT_THAT(problem.what(), HasSubstr("held by another slave_io of this cell"));
    }
    const StopFile other_side{second, "master_io", {.domain = 7}},
        other_cell{second, "slave_io", {.domain = 8}};
  }
  const StopFile alike = open(host), and_alike = open(host);
}

TEST_F(StopPlaceTest, SR03_AListOfFoldersThatCannotBeUsedIsRefusedByName) {
  const StopPlace by_order = stop_place(root_ / "by_order", root_), host = stop_place("", root_);
  const auto list = host.folder / "slave_io.domain-7.folders";
  { const StopFile file = open(by_order); }
  ASSERT_EQ(test::read_text(list), by_order.folder.string() + "\n");
  std::ofstream(list) << "by_order\n";
  for (const StopPlace& place : {by_order, host}) {
    try {
      open(place);
      FAIL() << place.folder;
    } catch (const core::MissingError& problem) {
      EXPECT_THAT(problem.what(), HasSubstr(list.string() + ": 'by_order' is no absolute path"));
    }
  }
  std::filesystem::remove(list);
  std::ofstream(list) << "/nowhere/at/all\n";
  { const StopFile file = open(by_order); }
  EXPECT_EQ(test::read_text(list), by_order.folder.string() + "\n") << "a folder that is gone is left out";
}

TEST_F(StopPlaceTest, TheListOfFoldersIsBounded) {
  const StopFolders list(root_ / "list");
  for (std::size_t i = 0; i <= StopFolders::kMaxFolders; ++i) {
    const auto folder = root_ / std::to_string(i);
    std::filesystem::create_directories(folder);
    if (i < StopFolders::kMaxFolders) {
      list.add(folder);
      list.add(folder);
      EXPECT_EQ(list.read().size(), i + 1);
    } else {
      EXPECT_THROW(list.add(folder), core::MissingError);
    }
  }
  EXPECT_THROW(list.add("/two\nlines"), core::MissingError);
}

}  // namespace
}  // namespace phantom::runtime
