#include "common/runtime/process/stop_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <functional>
#include <utility>

#include "common/core/errors.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::runtime {
namespace {

using teleop::StopCause;
using teleop::StopRecord;
using testing::HasSubstr;
using testing::IsEmpty;

class StopFileTest : public testing::Test {
 protected:
  StopFileTest() { network_.domain = 7; }
  ~StopFileTest() override { std::filesystem::remove_all(folder_); }
  StopFile open(const std::string& component = "slave_io") const {
    return {{.folder = folder_}, component, network_};
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("stop_file_" + std::to_string(getpid())) / "made" / "here";
  core::NetworkOptions network_;
};

TEST_F(StopFileTest, WithoutAStopThereIsNone) {
  const StopFile file = open();
  EXPECT_EQ(file.read(), StopRecord{});
  EXPECT_THAT(file.notice(), IsEmpty());
  EXPECT_EQ(file.file(), folder_ / "slave_io.domain-7.stop");
  network_.partition = "cell/3";
  EXPECT_EQ(open().file(), folder_ / "slave_io.domain-7.cell_3.stop");
}

TEST_F(StopFileTest, WhatWasWrittenIsReadByTheNext) {
  const StopRecord stop{0x0123456789abcdef, StopCause::kDriveFault};
  open().write(stop);
  {
    StopFile next = open();
    EXPECT_EQ(next.read(), stop);
    EXPECT_THAT(next.notice(), HasSubstr("stopped since before this start (drives in fault)"));
    EXPECT_EQ(open("master_io").read(), StopRecord{}) << "another side, another stop";
    next.write({});
    next.flush();
  }
  EXPECT_EQ(open().read(), StopRecord{});
}

// As kill -9 does it: no destructor, no flush.
// Tries master_io: master_io dies
TEST_F(StopFileTest, SR03_OutlivesAKilledProcess) {
  const StopRecord stop{42, StopCause::kEmergency};
  const pid_t child = fork();
  if (child == 0) {
    StopFile file = open();
    file.write(stop);
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(open().read(), stop);
}

TEST_F(StopFileTest, WritingIsRealTimeSafe) {
  StopFile file = open();
  const test::HeapGuard guard;
  file.write({1, StopCause::kPartner});
  file.write({});
}

TEST_F(StopFileTest, SR03_WhatIsDamagedCountsAsAStop) {
  std::filesystem::create_directories(folder_);
  const std::string unknown_cause("PHSTOP1\0\1\0\0\0\0\0\0\0\377\0\0\0", 20);
  for (const std::string& content :
       {std::string("something else that is long enough"), std::string("PHST"), unknown_cause}) {
    std::ofstream(folder_ / "slave_io.domain-7.stop") << content;
    const StopFile file = open();
    EXPECT_NE(file.read().id, 0U) << content;
    EXPECT_THAT(file.notice(), HasSubstr("damaged"));
  }
}

TEST_F(StopFileTest, ASecondProcessHasAFileOfItsOwn) {
  StopFile first = open(), second = open();
  first.write({1, StopCause::kEmergency});
  EXPECT_EQ(second.read().id, 0U);
  EXPECT_THAT(second.notice(), HasSubstr("another slave_io"));
}

// The process before this one may have had another file: the first was held, by one that stood still say.
TEST_F(StopFileTest, AStopOfAnyOfTheFilesOutlivesAllProcesses) {
  {
    StopFile first = open(), second = open();
    second.write({9, StopCause::kDriveFault});
  }
  {
    StopFile next = open();
    EXPECT_EQ(next.file(), folder_ / "slave_io.domain-7.stop");
    EXPECT_EQ(next.read(), (StopRecord{9, StopCause::kDriveFault}));
    EXPECT_THAT(next.notice(), HasSubstr("stopped since before this start (drives in fault)"));
    next.write({});
  }
  EXPECT_EQ(open().read(), StopRecord{}) << "once it is reset it does not come back";
}

TEST_F(StopFileTest, WhoStartsBesideAStoppedProcessIsStoppedToo) {
  StopFile first = open();
  first.write({5, StopCause::kEmergency});
  StopFile second = open();
  EXPECT_EQ(second.read(), (StopRecord{5, StopCause::kEmergency}));
  second.write({});
  EXPECT_EQ(first.read(), (StopRecord{5, StopCause::kEmergency})) << "its own reset ends its own stop";
}

TEST_F(StopFileTest, ADamagedFileOfAnotherProcessCountsAsAStop) {
  for (const char* content : {"something else that stands in the file", "short"}) {
    { const StopFile first = open(); }
    std::ofstream(folder_ / "slave_io.domain-7.2.stop") << content;
    StopFile next = open();
    EXPECT_EQ(next.read().cause, StopCause::kEmergency) << content;
    next.write({});
  }
  EXPECT_EQ(open().read(), StopRecord{});
}

// Tries slave_io: the file of the stop is removed
// Tries master_io: the file of the stop is removed
TEST_F(StopFileTest, SR03_AFileThatGoesAwayInUseIsWrittenAgain) {
  using Mutilation = std::function<void(const std::filesystem::path&)>;
  const std::pair<const char*, Mutilation> kAll[] = {
      {"removed", [](const auto& file) { std::filesystem::remove(file); }},
      {"its folder removed", [](const auto& file) { std::filesystem::remove_all(file.parent_path()); }},
      {"moved", [](const auto& file) { std::filesystem::rename(file, file.string() + ".old"); }},
      {"replaced by a copy",
       [](const auto& file) {
         std::filesystem::copy_file(file, file.string() + "~");
         std::filesystem::rename(file.string() + "~", file);
       }},
      {"cut to 0", [](const auto& file) { std::filesystem::resize_file(file, 0); }},
      {"cut to 7", [](const auto& file) { std::filesystem::resize_file(file, 7); }},
      {"cut to 8", [](const auto& file) { std::filesystem::resize_file(file, 8); }},
      {"extended", [](const auto& file) { std::filesystem::resize_file(file, 9000); }},
      {"overwritten", [](const auto& file) { std::ofstream(file) << std::string(32, '\0'); }},
  };
  const StopRecord stop{77, StopCause::kEmergency};
  for (const bool before : {true, false}) {
    for (const auto& [what, mutilate] : kAll) {
      {
        StopFile file = open();
        if (before) file.write(stop);
        mutilate(file.file());
        if (!before) file.write(stop);
        EXPECT_EQ(file.read(), stop);
        file.flush();
        EXPECT_TRUE(file.trouble().empty()) << file.trouble();
      }
      StopFile next = open();
      EXPECT_EQ(next.read(), stop) << what << (before ? " after" : " before") << " the stop";
      next.write({});
    }
    EXPECT_EQ(open().read(), StopRecord{});
  }
}

TEST_F(StopFileTest, SR03_AFileIsComparedWithoutARequest) {
  StopFile file = open();
  file.write({5, StopCause::kPartner});
  std::filesystem::remove_all(folder_);
  EXPECT_TRUE(test::eventually([&] { return std::filesystem::exists(folder_ / "slave_io.domain-7.stop"); }));
}

// The servo's store meets a page that the file no longer has.
TEST_F(StopFileTest, SR03_AFileThatIsCutWhileItIsWrittenEndsNoProcess) {
  StopFile file = open();
  for (std::uint64_t id = 1; id <= 2000; ++id) {
    std::filesystem::resize_file(folder_ / "slave_io.domain-7.stop", 0);
    file.write({id, StopCause::kEmergency});
    ASSERT_EQ(file.read().id, id);
  }
  file.flush();
  EXPECT_TRUE(file.trouble().empty());
}

// Tries slave_io: the file of the stop is empty
// Tries master_io: the file of the stop is empty
TEST_F(StopFileTest, SR03_AFileOfAnySizeButItsOwnIsAStop) {
  for (const std::string& content :
       {std::string(), std::string("PHSTOP1"), std::string("PHSTOP1\0", 8), std::string(32, '\0'),
        std::string("PHSTOP1\0", 8) + std::string(25, '\0'),
        std::string("PHSTOP1\0", 8) + std::string(24, 'x')}) {
    for (const char* name : {"slave_io.domain-7.stop", "slave_io.domain-7.2.stop"}) {
      { const StopFile made = open(); }
      std::ofstream(folder_ / name) << content;
      StopFile file = open();
      EXPECT_EQ(file.read().cause, StopCause::kEmergency) << content.size() << " bytes in " << name;
      file.write({});
    }
  }
  EXPECT_EQ(open().read(), StopRecord{});
}

TEST_F(StopFileTest, SR03_AStopThatCannotBeKeptIsReportedUntilItCan) {
  StopFile file = open();
  std::filesystem::remove_all(folder_);
  std::ofstream(folder_.string()) << "a file stands where the folder was";
  file.write({6, StopCause::kEmergency});
  file.flush();
  EXPECT_THAT(file.trouble(), HasSubstr("THE STOP CANNOT BE KEPT"));
  std::filesystem::remove(folder_);
  file.flush();
  EXPECT_THAT(file.trouble(), IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(file.file()));
}

// Tries slave_io: the folder for the stop
// Tries master_io: the folder for the stop
TEST_F(StopFileTest, SR03_AFolderThatCannotBeWrittenIsToldBeforeAnythingStarts) {
  try {
    const StopFile file({.folder = "/proc/nothing"}, "slave_io", network_);
    FAIL() << "opened";
  } catch (const core::MissingError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("/proc/nothing/slave_io.domain-7.stop"));
    EXPECT_THAT(problem.what(), HasSubstr("--state-dir"));
  }
}

}  // namespace
}  // namespace phantom::runtime
