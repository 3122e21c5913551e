#include "common/workspace/nrrd.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <future>
#include <iterator>

#include "common/voxelise/tests/literal_twins.hpp"
#include "common/workspace/tests/random_workspace.hpp"

namespace phantom::workspace {
namespace {

using ::testing::HasSubstr;

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string gunzip(const std::string& packed, std::size_t size) {
  std::string plain(size + 1, '\0');
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(plain.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  plain.resize(stream.total_out);
  inflateEnd(&stream);
  return plain;
}

class Nrrd : public ::testing::Test {
 protected:
  std::filesystem::path path_ = ::testing::TempDir() + "nrrd_" + std::to_string(getpid()) + ".nrrd";
  void TearDown() override { std::filesystem::remove(path_); }
};

template <class T, class Get>
void expect_field(const std::string& data, const Workspace& workspace, Get get) {
  const auto& size = workspace.grid().size_vox;
  ASSERT_EQ(data.size(), sizeof(T) * static_cast<std::size_t>(workspace.grid().voxel_count()));
  std::size_t i = 0;
  voxelise::twin::for_each({{0, 0, 0}, size}, [&](Index3 v) {  // x fastest
    T value;
    std::memcpy(&value, data.data() + sizeof(T) * i++, sizeof value);
    ASSERT_EQ(value, get(v));
  });
}

TEST_F(Nrrd, HoldsEveryVoxelOfEveryField) {
  const Workspace workspace = random_workspace(2);
  for (const NrrdEncoding encoding : {NrrdEncoding::kRaw, NrrdEncoding::kGzip}) {
    for (const NrrdField field : {NrrdField::kOrder, NrrdField::kMu, NrrdField::kObject}) {
      ASSERT_TRUE(write_nrrd(path_, workspace, field, encoding));
      const std::string file = read(path_);
      const std::size_t end = file.find("\n\n");
      ASSERT_NE(end, std::string::npos);
      std::string data = file.substr(end + 2);
      if (encoding == NrrdEncoding::kGzip)
        data = gunzip(data, static_cast<std::size_t>(workspace.grid().voxel_count()) * 4);
      if (field == NrrdField::kOrder)
        expect_field<std::int8_t>(data, workspace, [&](Index3 v) { return workspace.order(v); });
      if (field == NrrdField::kMu)
        expect_field<float>(data, workspace, [&](Index3 v) { return workspace.mu(v); });
      if (field == NrrdField::kObject)
        expect_field<std::uint16_t>(data, workspace, [&](Index3 v) { return workspace.object(v); });
    }
  }
}

TEST_F(Nrrd, SaysWhereTheVoxelsAre) {
  const Workspace workspace({{-0.5, 0.25, 1.0}, 0.25, {4, 2, 1}}, {0.0F});
  ASSERT_TRUE(write_nrrd(path_, workspace, NrrdField::kOrder, NrrdEncoding::kRaw));
  const std::string file = read(path_);
  EXPECT_EQ(file.rfind("NRRD0005\n", 0), 0U);
  EXPECT_THAT(file, HasSubstr("\nsizes: 4 2 1\n"));
  EXPECT_THAT(file, HasSubstr("\nspace directions: (0.25,0,0) (0,0.25,0) (0,0,0.25)\n"));
  EXPECT_THAT(file, HasSubstr("\nspace origin: (-0.375,0.375,1.125)\n"));
  EXPECT_THAT(file, HasSubstr("\ntype: int8\n"));
}

TEST_F(Nrrd, SaysTheSidesOfVoxelsThatAreNoCubes) {
  const Workspace workspace({{-0.5, 0.25, 1.0}, VoxelSize(Eigen::Vector3d(0.25, 0.5, 0.125)), {4, 2, 1}},
                            {0.0F});
  ASSERT_TRUE(write_nrrd(path_, workspace, NrrdField::kOrder, NrrdEncoding::kRaw));
  const std::string file = read(path_);
  EXPECT_THAT(file, HasSubstr("\nspace directions: (0.25,0,0) (0,0.5,0) (0,0,0.125)\n"));
  EXPECT_THAT(file, HasSubstr("\nspace origin: (-0.375,0.5,1.0625)\n"));
}

TEST_F(Nrrd, APipeIsWrittenToAndStaysAPipe) {
  const Workspace workspace = random_workspace(3);
  ASSERT_TRUE(write_nrrd(path_, workspace, NrrdField::kOrder));
  const std::string expected = read(path_);
  std::filesystem::remove(path_);
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  auto piped = std::async(std::launch::async, [this] { return read(path_); });
  EXPECT_TRUE(write_nrrd(path_, workspace, NrrdField::kOrder));
  EXPECT_TRUE(std::filesystem::is_fifo(path_));
  EXPECT_EQ(piped.get(), expected);
}

TEST_F(Nrrd, SaysWhenItCannotBeWritten) {
  const auto status = write_nrrd("/no/such/folder/x.nrrd", random_workspace(1), NrrdField::kMu);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.message(), HasSubstr("/no/such/folder/x.nrrd"));
}

}  // namespace
}  // namespace phantom::workspace
