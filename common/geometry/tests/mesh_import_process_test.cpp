#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <sstream>
#include <thread>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/tests/mesh_files.hpp"

// The importer is a program of its own: what it does, or that it is not there, costs one clear error.

namespace phantom::geometry {
namespace {

using ::testing::HasSubstr;

class Importer : public MeshFiles {
 protected:
  void TearDown() override { unsetenv("PHANTOM_MESH_IMPORT"); }

  /// From now on this shell script is the importer.
  void stands_in(const std::string& script) {
    const auto path = write("importer", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    setenv("PHANTOM_MESH_IMPORT", path.c_str(), 1);
  }
  void expect_error(core::ErrorCode code, const std::string& reason, const MeshImportOptions& options = {}) {
    const auto mesh = load_mesh(file_, options);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.status().code(), code) << mesh.status().message();
    EXPECT_THAT(mesh.status().message(), HasSubstr("mesh " + file_.string() + ": "));
    EXPECT_THAT(mesh.status().message(), HasSubstr(reason));
  }

  const std::filesystem::path file_ = write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
};

TEST_F(Importer, IsFoundBesideTheExecutable) {
  const auto mesh = load_mesh(file_);
  ASSERT_TRUE(mesh) << mesh.status().message();
  EXPECT_EQ(mesh->triangles.size(), 1U);
}

TEST_F(Importer, ThatIsMissingIsNamed) {
  setenv("PHANTOM_MESH_IMPORT", "/nowhere/phantom_mesh_import", 1);
  expect_error(core::ErrorCode::kUnavailable,
               "the importer /nowhere/phantom_mesh_import does not start: No such file or directory");
}

TEST_F(Importer, GetsWhatItMustKnowAndNothingElse) {
  const auto told = folder_ / "told";
  stands_in("printf '%s\\n' \"$@\" >" + told.string() + "; ls /proc/self/fd | wc -l >>" + told.string());
  const int of_ours = dup(STDOUT_FILENO);  // not marked to be closed on exec
  const auto lines = [&] {
    std::istringstream text(test::text_of(told));
    std::vector<std::string> all;
    for (std::string line; std::getline(text, line);) all.push_back(line);
    return all;
  };
  expect_error(core::ErrorCode::kInternal, "ended without an answer",
               {.scale = 0.0254, .y_up = true, .max_triangles = 7, .max_cpu_s = 5, .max_memory_bytes = 9});
  // Beside the standard three, what `ls` itself opens.
  EXPECT_THAT(lines(), ::testing::ElementsAre(file_.string(), "0.0254", "y", "7", "5", "9", "4"));
  expect_error(core::ErrorCode::kInternal, "", {.y_up = false, .max_cpu_s = 5});
  EXPECT_THAT(lines()[1] + lines()[2], "-z");
  close(of_ours);
}

// Tries wva_server: crashes the importer
TEST_F(Importer, ThatCrashesIsOneError) {
  stands_in("kill -SEGV $$");
  expect_error(core::ErrorCode::kInvalidArgument,
               "is malformed: the importer crashed on it (Segmentation fault)");
}

TEST_F(Importer, ThatFailsIsOneError) {
  stands_in("exit 127");
  expect_error(core::ErrorCode::kInternal, "the importer ended without an answer");
}

TEST_F(Importer, ThatTalksNonsenseIsOneError) {
  stands_in("head -c 100 /dev/zero");
  expect_error(core::ErrorCode::kInternal, "the importer's answer is not one");
}

TEST_F(Importer, ThatNeverEndsItsAnswerIsOneError) {
  stands_in("exec cat /dev/zero");
  expect_error(core::ErrorCode::kInternal, "the importer's answer is longer than the limits allow",
               {.max_triangles = 1000});
}

// Tries wva_server: hangs it
TEST_F(Importer, ThatWaitsForEverIsOneError) {
  stands_in("exec sleep 1000");
  expect_error(core::ErrorCode::kResourceExhausted, "was not read within 4 s", {.max_cpu_s = 1});
}

TEST_F(Importer, ThatLingersAfterItsAnswerIsEnded) {
  stands_in("exec >/dev/null; exec sleep 1000");
  EXPECT_FALSE(load_mesh(file_));
}

/// A polygon of very many corners: to cut it up takes the square of their number.
TEST_F(Importer, ThatTakesTooMuchProcessorTimeEndsItself) {
  std::ostringstream text;
  constexpr int kCorners = 200'000;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = i * 2 * M_PI / kCorners, radius = i % 2 == 0 ? 1.0 : 0.9;
    text << "v " << radius * std::cos(angle) << ' ' << radius * std::sin(angle) << " 0\n";
  }
  text << 'f';
  for (int i = 0; i < kCorners; ++i) text << ' ' << i + 1;
  const auto mesh = load_mesh(write("polygon.obj", text.str() + "\n"), {.max_cpu_s = 1});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.status().code(), core::ErrorCode::kResourceExhausted);
  EXPECT_THAT(mesh.status().message(), HasSubstr("was not read within 1 s of processor time"));
}

/// An importer that were forked off would inherit the locks that these threads hold at that moment.
TEST_F(Importer, WorksWhileOtherThreadsAllocate) {
  std::atomic<bool> stop = false;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      for (std::size_t size = 1; !stop; size = size % 100'000 + 37) std::make_unique<char[]>(size)[0] = 1;
    });
  for (int round = 0; round < 10; ++round) EXPECT_TRUE(load_mesh(file_));
  std::vector<std::jthread> importing;  // several at once, too
  for (int i = 0; i < 4; ++i) importing.emplace_back([&] { EXPECT_TRUE(load_mesh(file_)); });
  importing.clear();
  stop = true;
}

}  // namespace
}  // namespace phantom::geometry
