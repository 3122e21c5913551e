#include "common/runtime/process/line_writer.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

// A pipe that holds as much as a page, and nobody reads unless told.
class Pipe {
 public:
  Pipe() {
    EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0);
    EXPECT_GE(fcntl(ends_[1], F_SETPIPE_SZ, 4096), 0);
  }
  ~Pipe() {
    close_writer();
    close(ends_[0]);
  }
  int writer() const { return ends_[1]; }
  void close_writer() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }
  // All lines until the writer is closed.
  std::vector<std::string> lines() const {
    std::string text;
    char piece[512];
    for (ssize_t got = 0; (got = read(ends_[0], piece, sizeof piece)) > 0;)
      text.append(piece, static_cast<std::size_t>(got));
    std::vector<std::string> all;
    std::istringstream split(text);
    for (std::string line; std::getline(split, line);) all.push_back(line);
    return all;
  }

 private:
  int ends_[2];
};

TEST(LineWriter, WritesEveryLineInOrder) {
  Pipe pipe;
  std::vector<std::string> got;
  std::thread reader([&] { got = pipe.lines(); });
  {
    LineWriter writer(pipe.writer(), 5000);
    for (int i = 0; i < 2000; ++i) writer.put("line " + std::to_string(i) + "\n");
    EXPECT_TRUE(writer.flush(60.0)) << "somebody reads";
  }
  pipe.close_writer();
  reader.join();
  ASSERT_EQ(got.size(), 2000u);
  for (int i = 0; i < 2000; ++i) EXPECT_EQ(got[static_cast<std::size_t>(i)], "line " + std::to_string(i));
}

// Would hang in put(), flush() or the destructor if any of them waited for the reader.
TEST(LineWriter, NobodyWaitsForAReaderThatDoesNotRead) {
  Pipe pipe;
  LineWriter writer(pipe.writer(), 100);
  for (int i = 0; i < 10'000; ++i) writer.put("a line that nobody reads, number " + std::to_string(i) + "\n");
  EXPECT_FALSE(writer.flush(0.01));
}

TEST(LineWriter, TellsHowManyLinesWereLostInTheirPlace) {
  Pipe pipe;
  std::vector<std::string> got;
  auto writer = std::make_unique<LineWriter>(pipe.writer(), 10);
  for (int i = 0; i < 1000; ++i) writer->put("line " + std::to_string(i) + "\n");
  std::thread reader([&] { got = pipe.lines(); });
  EXPECT_TRUE(writer->flush(60.0));
  writer.reset();
  pipe.close_writer();
  reader.join();
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(got.back(), "line 999") << "the newest are kept";
  std::size_t lines = 0, lost = 0;
  for (const std::string& line : got) {
    std::size_t count = 0;
    if (std::sscanf(line.c_str(), "%zu lines lost", &count) == 1) {
      lost += count;
    } else {
      ++lines;
    }
  }
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(lines + lost, 1000u) << "each line was written or counted";
}

TEST(LineWriter, WritesToFilesAfterWhatIsThereAndToSockets) {
  const auto path = test::new_file("before\n");
  const int file = open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  {
    LineWriter writer(file);
    writer.put("after\n");
  }
  close(file);
  EXPECT_EQ(test::text_of(path), "before\nafter\n");

  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);  // what the journal gives a service
  {
    LineWriter writer(ends[0], 10);
    writer.put("to the journal\n");
    ASSERT_TRUE(writer.flush(60.0));
    char text[64];
    const auto got = recv(ends[1], text, sizeof text, 0);
    EXPECT_EQ(std::string(text, static_cast<std::size_t>(got)), "to the journal\n");
    for (int i = 0; i < 20'000; ++i)
      writer.put("to a journal that does not read, number " + std::to_string(i) + "\n");
  }
  close(ends[0]);
  close(ends[1]);
}

TEST(LineWriter, AReaderThatIsGoneIsNobodysEnd) {
  Pipe pipe;
  std::signal(SIGPIPE, SIG_IGN);  // as in every process of ours
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  close(ends[0]);
  LineWriter writer(ends[1]);
  for (int i = 0; i < 100; ++i) writer.put("into a broken pipe\n");
  EXPECT_TRUE(writer.flush(60.0)) << "nothing waits any more";
  close(ends[1]);
}

}  // namespace
}  // namespace phantom::runtime
