// Files of clouds: what the formats allow is read, and all else is refused with its reason.
#include "components/workspace_camera/cloud_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <sstream>

namespace phantom::workspace_camera::cloud_file_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

template <class T>
void put(std::string& to, T value, bool big_endian = false) {
  auto octets = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) std::ranges::reverse(octets);
  to.append(octets.begin(), octets.end());
}

std::string why_not(const std::string& octets) {
  const auto cloud = read_cloud(octets);
  return cloud ? "read" : cloud.status().message();
}

const std::string kAsciiPcd =
    "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS rgb x y z n\nSIZE 4 4 4 4 4\n"
    "TYPE U F F F F\nCOUNT 1 1 1 1 2\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
    "7 1 2.5 -3e-1 0 0\n7 nan 5 6 0 0\n";

std::string binary_pcd() {
  std::string file =
      "# .PCD v0.7\nFIELDS x label y z\nSIZE 4 1 8 4\nTYPE F U F F\nWIDTH 1\nHEIGHT 2\nDATA binary\n";
  for (int i = 0; i < 2; ++i) {
    put(file, 1.0F + static_cast<float>(i));
    file.push_back(7);
    put(file, 2.5);
    put(file, -0.5F);
  }
  return file;
}

std::string ply(const std::string& format, const std::string& before = "") {
  std::string file =
      "ply\nformat " + format + " 1.0\ncomment made here\n" + before +
      "element vertex 2\nproperty float x\nproperty float y\nproperty double z\n"
      "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const bool big = format == "binary_big_endian";
  if (!before.empty()) put(file, std::int16_t{12}, big);
  for (int i = 0; i < 2; ++i) {
    put(file, 1.0F + static_cast<float>(i), big);
    put(file, 2.5F, big);
    put(file, -0.5, big);
    file.push_back(9);
  }
  return file + "rest";
}

TEST(CloudFile, EitherFormatIsReadInEachOfItsForms) {
  const auto ascii = read_cloud(kAsciiPcd);
  ASSERT_TRUE(ascii) << ascii.status().message();
  ASSERT_EQ(ascii->size(), 6U);
  EXPECT_EQ((*ascii)[1], 2.5F);
  EXPECT_EQ((*ascii)[2], -0.3F);
  EXPECT_TRUE(std::isnan((*ascii)[3]));
  EXPECT_EQ((*ascii)[5], 6.0F);
  const auto cut = read_cloud(kAsciiPcd.substr(0, kAsciiPcd.size() - 1));
  EXPECT_TRUE(cut) << "the last line needs no end";
  for (const std::string& file : {binary_pcd(), ply("binary_little_endian"), ply("binary_big_endian"),
                                  ply("binary_big_endian", "element camera 1\nproperty short view\n")}) {
    const auto cloud = read_cloud(file);
    ASSERT_TRUE(cloud) << cloud.status().message();
    EXPECT_THAT(*cloud, ElementsAre(1.0F, 2.5F, -0.5F, 2.0F, 2.5F, -0.5F));
  }
  const auto text = read_cloud(
      "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\nproperty float y\r\n"
      "property float z\r\nend_header\r\n1 2.5 -0.5\r\n");
  ASSERT_TRUE(text) << text.status().message();
  EXPECT_THAT(*text, ElementsAre(1.0F, 2.5F, -0.5F));
}

TEST(CloudFile, WhatIsNotAsTheFormatHasItIsRefusedWithItsReason) {
  const auto pcd = [](std::string from, const std::string& what, const std::string& by) {
    return why_not(from.replace(from.find(what), what.size(), by));
  };
  EXPECT_THAT(why_not(""), HasSubstr("neither a PCD nor a PLY"));
  EXPECT_THAT(why_not("solid x"), HasSubstr("neither a PCD nor a PLY"));
  EXPECT_THAT(pcd(kAsciiPcd, " z ", " w "), HasSubstr("no field z; needed: x, y, z"));
  EXPECT_THAT(pcd(kAsciiPcd, "POINTS 2", "POINTS 3"),
              HasSubstr("POINTS is 3; allowed: WIDTH times HEIGHT, 2"));
  EXPECT_THAT(pcd(kAsciiPcd, "U F F F F", "U I F F F"), HasSubstr("field x is of another type"));
  EXPECT_THAT(pcd(kAsciiPcd, "SIZE 4 4 4 4 4", "SIZE 4 4 4 4"), HasSubstr("need as many"));
  EXPECT_THAT(pcd(kAsciiPcd, "COUNT 1 1 1 1 2", "COUNT 1 1 1 1 9999999"), HasSubstr("allowed: at most 4096"));
  EXPECT_THAT(pcd(kAsciiPcd, "WIDTH 2", "WIDTH -2"), HasSubstr("WIDTH: '-2'; allowed: a whole number"));
  EXPECT_THAT(pcd(kAsciiPcd, "WIDTH 2", "COLOUR 2"), HasSubstr("a line 'COLOUR'"));
  EXPECT_THAT(pcd(kAsciiPcd, "DATA ascii", "DATA binary_compressed"), HasSubstr("allowed: ascii, binary"));
  EXPECT_THAT(pcd(kAsciiPcd, "2.5", "2,5"), HasSubstr("point 1: '2,5' is no number"));
  EXPECT_THAT(pcd(kAsciiPcd, "7 nan 5 6 0 0\n", "7 nan\n"), HasSubstr("point 2 has 2 numbers; needed: 6"));
  EXPECT_THAT(pcd(kAsciiPcd, "DATA ascii\n", ""), HasSubstr("a line '7'"));
  EXPECT_THAT(pcd(binary_pcd(), "HEIGHT 2", "HEIGHT 9000000"), HasSubstr("octets; needed: 153000000"));
  EXPECT_THAT(pcd(binary_pcd(), "HEIGHT 2", "HEIGHT 0"), HasSubstr("0 points; allowed: 1 to 10000000"));
  EXPECT_THAT(pcd(binary_pcd(), "WIDTH 1", "WIDTH 9999999"), HasSubstr("19999998 points"));
  EXPECT_THAT(pcd(ply("binary_little_endian"), "double z", "int z"),
              HasSubstr("property z is of another type"));
  EXPECT_THAT(pcd(ply("binary_little_endian"), "double z", "list uchar double z"),
              HasSubstr("element vertex has lists"));
  EXPECT_THAT(pcd(ply("binary_little_endian"), "binary_little", "middle"),
              HasSubstr("the format is 'middle_endian'"));
  EXPECT_THAT(pcd(ply("ascii"), "end_header", "end"), HasSubstr("a line 'end'"));
  EXPECT_THAT(why_not("ply\nformat ascii 1.0\nelement face 0\nend_header\n"),
              HasSubstr("there is no element vertex"));
  EXPECT_THAT(why_not(ply("binary_little_endian", "element t 1\nproperty list int int i\n")),
              HasSubstr("element t has lists, before the points"));
  EXPECT_THAT(why_not(ply("binary_little_endian").substr(0, 240)), HasSubstr("octets; needed: 34"));
}

// Whatever is damaged: no crash, and never more points than the file has octets.
TEST(CloudFile, DamagedFilesAreReadOrRefused) {
  std::mt19937 random(5);
  for (const std::string& whole : {kAsciiPcd, binary_pcd(), ply("ascii"), ply("binary_big_endian")}) {
    for (int k = 0; k < 5000; ++k) {
      std::string file = whole;
      for (int n = 1 + static_cast<int>(random() % 3); n > 0; --n)
        file[random() % file.size()] = static_cast<char>(random() % 4 == 0 ? '0' + random() % 10 : random());
      if (random() % 4 == 0) file.resize(random() % file.size());
      if (const auto cloud = read_cloud(file)) {
        EXPECT_LE(cloud->size(), 3 * file.size());
      }
    }
  }
}

}  // namespace
}  // namespace phantom::workspace_camera::cloud_file_test
