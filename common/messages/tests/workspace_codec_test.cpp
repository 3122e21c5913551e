#include "common/messages/workspace_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

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
