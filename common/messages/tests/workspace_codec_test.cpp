#include "common/messages/codecs/workspace_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "common/messages/tests/codec_cases.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;

WorkspaceObject an_object() {
  return {4,
          "vice",
          99,
          {Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix(), {1, 2, 3}},
          {0.5F, 0.25F, 1.0F}};
}

TEST(WorkspaceObjectCodec, ThereAndBackItIsTheSame) {
  const WorkspaceObject object = an_object();
  const auto back = from_idl(to_idl(object));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->id, 4);
  EXPECT_EQ(back->name, "vice");
  EXPECT_EQ(back->mesh_hash, 99U);
  EXPECT_TRUE(back->X_WO.rotation.isApprox(object.X_WO.rotation, 1e-12));
  EXPECT_EQ(back->X_WO.translation_m, object.X_WO.translation_m);
  EXPECT_EQ(back->colour, object.colour);
}

TEST(WorkspaceReplyCodec, IsARefusalUntilSomethingElseIsKnown) {
  EXPECT_EQ(WorkspaceReply().outcome, WorkspaceOutcome::kRefused);
}

TEST(ObjectUncertaintyCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  for (const double error_m : {-1.0, 0.0, 0.004}) {
    const ObjectUncertainty uncertainty{7, error_m, 0.01};
    const auto back = from_idl(to_idl(uncertainty));
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, uncertainty);
  }
  const Refusals<msg::ObjectUncertainty> refusal{to_idl(ObjectUncertainty{7, 0.004, 0.01})};
  EXPECT_EQ(refusal([](auto& m) { m.id(0); }), "id is 0; allowed: 1 to 65534");
  EXPECT_NE(refusal([](auto& m) { m.pose_error_m(-2.0); }), "");
  EXPECT_NE(refusal([](auto& m) { m.guard_m(-0.1); }), "");
  for (const double bad : kNoNumbers) {
    EXPECT_NE(refusal([&](auto& m) { m.pose_error_m(bad); }), "");
    EXPECT_NE(refusal([&](auto& m) { m.guard_m(bad); }), "");
  }
}

TEST(WorkspaceObjectCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::WorkspaceObject> refusal{to_idl(an_object())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.id(0); }), "id is 0; allowed: 1 to 65534");
  EXPECT_EQ(refusal([](auto& m) { m.id(65535); }), "id is 65535; allowed: 1 to 65534");
  EXPECT_THAT(refusal([](auto& m) { m.X_WO(msg::Pose()); }), HasSubstr("X_WO's quaternion has length 0"));
  EXPECT_THAT(refusal([](auto& m) { m.X_WO().qw(2); }), HasSubstr("quaternion"));
  EXPECT_THAT(refusal([](auto& m) { m.X_WO().qx(kNoNumbers[0]); }), HasSubstr("quaternion"));
  EXPECT_EQ(refusal([](auto& m) { m.X_WO().position_m().z(kNoNumbers[0]); }),
            "X_WO.position_m is not finite");
  EXPECT_EQ(refusal([](auto& m) { m.green(1.5F); }), "green is 1.5; allowed: 0 to 1");
  EXPECT_THAT(refusal([](auto& m) { m.blue(std::nanf("")); }), HasSubstr("blue is not finite"));
}

WorkspaceVersion a_version() {
  WorkspaceVersion version;
  version.cell = "hot cell";
  version.description.version = 7;
  version.description.grid = {
      {-1.0, 2.0, 0.5}, workspace::VoxelSize(Eigen::Vector3d(0.004, 0.005, 0.008)), {80, 90, 100}};
  version.description.palette_Pa_s_per_m = {0, 9, 32};
  version.description.brick_count = 12;
  version.description.content_hash = 0xfedcba9876543210U;
  CarriedObject pump{
      .id = 3, .arm = "left", .frame = "hand", .mesh_hash = 0xfedcba9876543211U, .mass_kg = 2.5};
  pump.X_FO.translation_m = {0.01, -0.02, 0.3};
  pump.X_FO.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pump.centre_of_mass_m = {0.1, 0.2, -0.3};
  pump.moments_kg_m2 = {0.1, 0.2, 0.25};
  pump.products_kg_m2 = {-0.01, 0.02, -0.03};
  version.carried = {pump, CarriedObject{.id = 9, .arm = "right", .frame = "tool"}};
  return version;
}

TEST(WorkspaceVersionCodec, ThereAndBackItIsTheSame) {
  const WorkspaceVersion version = a_version();
  const auto back = from_idl(to_idl(version));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->cell, "hot cell");
  EXPECT_EQ(back->description.version, 7U);
  EXPECT_EQ(back->description.grid.origin_m, version.description.grid.origin_m);
  EXPECT_EQ(back->description.grid.voxel_size_m.sides_m(), Eigen::Vector3d(0.004, 0.005, 0.008));
  EXPECT_EQ(back->description.grid.size_vox, version.description.grid.size_vox);
  EXPECT_EQ(back->description.palette_Pa_s_per_m, version.description.palette_Pa_s_per_m);
  EXPECT_EQ(back->description.brick_count, 12U);
  EXPECT_EQ(back->description.content_hash, 0xfedcba9876543210U);
  ASSERT_EQ(back->carried.size(), 2U);
  const CarriedObject &sent = version.carried[0], &came = back->carried[0];
  EXPECT_EQ(came.id, 3);
  EXPECT_EQ(came.arm, "left");
  EXPECT_EQ(came.frame, "hand");
  EXPECT_EQ(came.mesh_hash, sent.mesh_hash);
  EXPECT_EQ(came.mass_kg, 2.5);
  EXPECT_TRUE(came.X_FO.rotation.isApprox(sent.X_FO.rotation, 1e-12));
  EXPECT_EQ(came.X_FO.translation_m, sent.X_FO.translation_m);
  EXPECT_EQ(came.centre_of_mass_m, sent.centre_of_mass_m);
  EXPECT_EQ(came.moments_kg_m2, sent.moments_kg_m2);
  EXPECT_EQ(came.products_kg_m2, sent.products_kg_m2);
  EXPECT_EQ(back->carried[1].arm, "right");
}

TEST(WorkspaceVersionCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::WorkspaceVersion> refusal{to_idl(a_version())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.version(0); }), "version is 0; allowed: 1 or more");
  EXPECT_THAT(refusal([](auto& m) { m.origin_m().y(kNoNumbers[0]); }), HasSubstr("origin_m is not finite"));
  for (const double size_m : {0.0, -0.005})
    EXPECT_THAT(refusal([&](auto& m) { m.voxel_size_m().y(size_m); }),
                HasSubstr("voxel size is not above 0"));
  EXPECT_THAT(refusal([](auto& m) { m.voxel_size_m().z(0.05); }),
              HasSubstr("voxel size is 12.5 times as long along z as along x; allowed: at most 8 times"));
  for (const std::uint32_t size_vox : {0U, 8193U, 4'294'967'295U}) {
    EXPECT_THAT(refusal([&](auto& m) { m.size_x_vox(size_vox); }), HasSubstr("allowed: 1 to 8192"));
    EXPECT_THAT(refusal([&](auto& m) { m.size_y_vox(size_vox); }), HasSubstr("allowed: 1 to 8192"));
    EXPECT_THAT(refusal([&](auto& m) { m.size_z_vox(size_vox); }), HasSubstr("allowed: 1 to 8192"));
  }
  EXPECT_NE(refusal([](auto& m) { m.palette({}); }), "");
  EXPECT_NE(refusal([](auto& m) { m.palette({0, 32, 9}); }), "") << "a palette rises";
  EXPECT_NE(refusal([](auto& m) { m.palette({1, 2}); }), "") << "its first entry is free space";
  EXPECT_EQ(refusal([](auto& m) { m.carried()[0].id(0); }), "carried.id is 0; allowed: 1 to 65534");
  EXPECT_EQ(refusal([](auto& m) { m.carried()[0].id(9); }), "object 9 is carried twice; allowed: each once");
  EXPECT_THAT(refusal([](auto& m) { m.carried()[1].X_FO(msg::Pose()); }),
              HasSubstr("carried.X_FO's quaternion"));
  EXPECT_EQ(refusal([](auto& m) { m.carried()[0].mass_kg(-1); }),
            "carried.mass_kg is -1; allowed: 0 to 100000");
  EXPECT_THAT(refusal([](auto& m) { m.carried()[0].centre_of_mass_m().x(kNoNumbers[0]); }),
              HasSubstr("finite"));
  EXPECT_THAT(refusal([](auto& m) { m.carried()[0].moments_kg_m2().x(kNoNumbers[1]); }), HasSubstr("finite"));
  EXPECT_THAT(refusal([](auto& m) { m.carried()[0].moments_kg_m2().y(-1e-9); }), HasSubstr("below 0"));
  EXPECT_THAT(refusal([](auto& m) { m.carried()[0].products_kg_m2().z(1e10); }), HasSubstr("products_kg_m2"));
}

// Tries synthetic_viewer: a recording from before voxels had a side for each axis
TEST(WorkspaceVersionCodec, OfARecordingWithOneVoxelSizeIsRefused) {
  // There, the three counts of voxels and of the palette follow the one size: read as the two other sides.
  const Refusals<msg::WorkspaceVersion> refusal{to_idl(a_version())};
  std::mt19937 random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto count = [&] { return std::uint64_t{1} + random() % 8192; };
    const std::uint64_t second = count() | count() << 32U, third = count() | (random() % 257) << 32U;
    EXPECT_THAT(refusal([&](auto& m) {
                  m.voxel_size_m().y(std::bit_cast<double>(second));
                  m.voxel_size_m().z(std::bit_cast<double>(third));
                }),
                HasSubstr("voxel size is"));
  }
}

TEST(WorkspaceBrickCodec, ThereAndBackItIsTheSame) {
  const std::vector<std::uint8_t> octets{1, 2, 3};
  const msg::WorkspaceBrick message = to_idl(WorkspaceBrick{{1, 0, 255}, 4, octets});
  const auto back = from_idl(message);
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->key.x, 1);
  EXPECT_EQ(back->key.y, 0);
  EXPECT_EQ(back->key.z, 255);
  EXPECT_EQ(back->version, 4U);
  EXPECT_EQ(back->voxels_zstd.data(), message.voxels_zstd().data()) << "nothing is copied";
  EXPECT_EQ(back->voxels_zstd.size(), 3U);
  EXPECT_TRUE(from_idl(to_idl(WorkspaceBrick{{0, 0, 0}, 5, {}}))) << "a brick that does not exist any more";
}

TEST(WorkspaceBrickCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::WorkspaceBrick> refusal{to_idl(WorkspaceBrick{{1, 2, 3}, 4, {}})};
  EXPECT_EQ(refusal([](auto& m) { m.bx(-1); }), "bx is -1; allowed: 0 to 255");
  EXPECT_EQ(refusal([](auto& m) { m.by(256); }), "by is 256; allowed: 0 to 255");
  EXPECT_EQ(refusal([](auto& m) { m.bz(2'000'000'000); }), "bz is 2e+09; allowed: 0 to 255");
}

TEST(MeshChunkCodec, ThereAndBackItIsTheSame) {
  expect_same_after_round_trip(MeshChunk{0xfedcba9876543210U, 2, 3, 9, 3, {1, 2, 3}});
}

TEST(MeshChunkCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::MeshChunk> refusal{to_idl(MeshChunk{1, 2, 3, 9, 3, {1}})};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.chunk(3); }), "chunk is 3; allowed: 0 to 2");
  for (const std::uint32_t count : {0U, 4097U})
    EXPECT_THAT(refusal([&](auto& m) { m.chunk_count(count); }), HasSubstr("allowed: 1 to 4096"));
  for (const std::uint32_t count : {0U, 20'000'001U}) {
    EXPECT_THAT(refusal([&](auto& m) { m.vertex_count(count); }), HasSubstr("vertex_count is"));
    EXPECT_THAT(refusal([&](auto& m) { m.triangle_count(count); }), HasSubstr("triangle_count is"));
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{256 * 1024 + 1}})
    EXPECT_THAT(refusal([&](auto& m) { m.data(std::vector<std::uint8_t>(size)); }),
                HasSubstr("allowed: 1 to 262144"));
}

TEST(WorkspaceObjectCodec, OfARemovedOneOnlyItsIdIsLookedAt) {
  msg::WorkspaceObject message;
  message.id(4);
  const auto object = from_idl(message);
  ASSERT_TRUE(object) << object.status().message();
  EXPECT_TRUE(object->removed());
  EXPECT_EQ(object->id, 4);
}

}  // namespace
}  // namespace phantom::messages
