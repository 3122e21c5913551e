#include "common/geometry/importer/confinement.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/files.hpp"

namespace phantom::geometry {
namespace {

/// Runs `attempt` in a confined process; it returns a result as of a system call.
template <class Attempt>
void expect_refused(const char* what, Attempt attempt) {
  const auto confined = [&] {
    if (!confine_this_process()) _exit(9);
    errno = 0;
    const bool refused = attempt() < 0 && errno == EPERM;
    _exit(refused ? 0 : 1);
  };
  EXPECT_EXIT(confined(), ::testing::ExitedWithCode(0), "") << what;
}

class Confinement : public ::testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers need more than the confinement allows";
#endif
    std::ofstream(file_) << "v 0 0 0\n";
  }
  const std::filesystem::path folder_ = test::new_folder();
  const std::filesystem::path file_ = folder_ / "part.obj", other_ = folder_ / "other";
};

TEST_F(Confinement, LetsFilesBeReadAndTheAnswerBeWritten) {
  const auto confined = [&] {
    const int answer = open("/dev/null", O_WRONLY);
    if (!confine_this_process()) _exit(9);
    std::ifstream in(file_);
    std::string word;
    in >> word;
    std::size_t entries = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) entries += entry.exists();
    _exit(word == "v" && entries == 1 && write(answer, "x", 1) == 1 ? 0 : 1);
  };
  EXPECT_EXIT(confined(), ::testing::ExitedWithCode(0), "");
}

TEST_F(Confinement, RefusesAllElse) {
  const char* const file = file_.c_str();
  const char* const other = other_.c_str();
  expect_refused("writing", [&] { return open(file, O_WRONLY); });
  expect_refused("writing and reading", [&] { return open(file, O_RDWR); });
  expect_refused("making", [&] { return open(other, O_RDONLY | O_CREAT, 0600); });
  expect_refused("emptying", [&] { return open(file, O_RDONLY | O_TRUNC); });
  expect_refused("a file without name", [&] { return open(folder_.c_str(), O_RDWR | O_TMPFILE, 0600); });
  expect_refused("removing", [&] { return unlink(file); });
  expect_refused("renaming", [&] { return std::rename(file, other); });
  expect_refused("linking", [&] { return link(file, other); });
  expect_refused("changing rights", [&] { return chmod(file, 0777); });
  expect_refused("a socket", [] { return socket(AF_INET, SOCK_DGRAM, 0); });
  expect_refused("a local socket", [] { return socket(AF_UNIX, SOCK_STREAM, 0); });
  expect_refused("a process", [] { return static_cast<int>(fork()); });
  expect_refused("a program", [] { return execl("/bin/true", "true", nullptr); });
  expect_refused("another's signal", [] { return kill(getppid(), 0); });
  expect_refused("another's memory", [] { return static_cast<int>(ptrace(PTRACE_ATTACH, getppid(), 0, 0)); });
  expect_refused("a folder", [&] { return mkdir(other, 0700); });
}

}  // namespace
}  // namespace phantom::geometry
