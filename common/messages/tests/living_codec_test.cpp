#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/tests/codec_cases.hpp"

namespace phantom::messages::living_codec {
namespace {

using testing::HasSubstr;

DepthImage an_image() {
  return {.stamp = {3, 4, 5},
          .camera = "above",
          .age_s = 0.03,
          .width = 3,
          .height = 2,
          .fx_px = 100.0,
          .fy_px = 101.0,
          .cx_px = 1.0,
          .cy_px = 0.5,
          .min_depth_m = 0.2,
          .max_depth_m = 4.0,
          .depth_mm = {0, 1, 500, 1000, 65535, 7}};
}

TEST(DepthImageCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(an_image()); }

TEST(DepthImageCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::DepthImage> refusal{to_idl(an_image())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_THAT(refusal([](auto& m) { m.camera("a\nb"); }), HasSubstr("camera has control characters"));
  EXPECT_EQ(refusal([](auto& m) { m.age_s(-0.1); }), "age_s is -0.1; allowed: 0 to 10");
  EXPECT_EQ(refusal([](auto& m) { m.width(0); }), "width is 0; allowed: 1 to 4096");
  EXPECT_EQ(refusal([](auto& m) { m.height(4097); }), "height is 4097; allowed: 1 to 4096");
  EXPECT_EQ(refusal([](auto& m) { m.width(1001), m.height(1000); }),
            "width·height is 1001000; allowed: at most 1000000");
  EXPECT_EQ(refusal([](auto& m) { m.width(4); }), "depth_mm has 6 values; allowed: width·height");
  EXPECT_THAT(refusal([](auto& m) { m.fx_px(0.0); }), HasSubstr("fx_px is 0"));
  EXPECT_THAT(refusal([](auto& m) { m.max_depth_m(0.2); }), HasSubstr("not above min_depth_m"));
}

OccupancyChange a_change() {
  OccupancyChange change;
  change.stamp = {3, 4, 5};
  change.source = "workspace_camera";
  change.cell = "hot_cell";
  change.grid = {{-1.0, 0.5, 0.0}, 0.005, {20, 30, 40}};
  change.whole = true;
  change.image_age_s = 0.02;
  change.blocks = {{1, 2, 3, {1, 2, 4, 8, 16, 32, 64, 1ULL << 43}}, {2, 0, 4, {0x0F}}};
  change.cameras = {{"above", DepthCameraState::kLate, 0.4, 12.5}};
  return change;
}

TEST(OccupancyChangeCodec, ThereAndBackItIsTheSame) {
  const OccupancyChange sent = a_change();
  const auto back = from_idl(to_idl(sent));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->source, sent.source);
  EXPECT_EQ(back->cell, sent.cell);
  EXPECT_EQ(back->grid.origin_m, sent.grid.origin_m);
  EXPECT_EQ(back->grid.voxel_size_m, sent.grid.voxel_size_m);
  EXPECT_EQ(back->grid.size_vox, sent.grid.size_vox);
  EXPECT_TRUE(back->whole);
  EXPECT_EQ(back->image_age_s, 0.02);
  EXPECT_EQ(back->blocks, sent.blocks);
  EXPECT_EQ(back->cameras, sent.cameras);
}

TEST(OccupancyChangeCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::OccupancyChange> refusal{to_idl(a_change())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.blocks()[0].x(1024); }), "blocks.x is 1024; allowed: 0 to 1023");
  EXPECT_THAT(refusal([](auto& m) { m.blocks().push_back(m.blocks()[0]); }), HasSubstr("comes twice"));
  EXPECT_THAT(refusal([](auto& m) { m.blocks()[0].y(4); }), HasSubstr("block (1, 4, 3) is not in the grid"));
  // The grid ends within block (2, …, …): only columns 0 to 3 of it are in the grid.
  EXPECT_THAT(refusal([](auto& m) { m.blocks()[1].bits()[0] = 0x10; }), HasSubstr("beyond the grid"));
  EXPECT_THAT(refusal([](auto& m) { m.blocks()[0].y(3), m.blocks()[0].bits()[0] = 1ULL << 48; }),
              HasSubstr("beyond the grid"));
  EXPECT_THAT(refusal([](auto& m) { m.blocks().resize(20'001); }), HasSubstr("at most 20000"));
  EXPECT_THAT(refusal([](auto& m) { m.cameras().resize(17); }), HasSubstr("at most 16"));
  EXPECT_EQ(refusal([](auto& m) { m.size_y_vox(0); }), "size_y_vox is 0; allowed: 1 to 8192");
  EXPECT_EQ(refusal([](auto& m) { m.cameras()[0].rate_hz(-1); }),
            "cameras.rate_hz is -1; allowed: 0 to 10000");
}

SpaceView a_view() {
  SpaceView view;
  view.stamp = {3, 4, 5};
  view.source = "workspace_camera";
  view.cell = "hot_cell";
  view.origin_m = {-1.0, 0.5, 0.0};
  view.cube_m = 0.16;
  view.size_x = 2, view.size_y = 3, view.size_z = 1;
  view.ages = {0, 1, 2, 20, kSpaceAgeMax, kSpaceNeverSeen};
  return view;
}

TEST(SpaceViewCodec, ThereAndBackItIsTheSame) {
  const auto back = from_idl(to_idl(a_view()));
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->source, "workspace_camera");
  EXPECT_EQ(back->cube_m, 0.16);
  EXPECT_EQ(back->size_y, 3);
  EXPECT_EQ(back->ages, a_view().ages);
}

TEST(SpaceViewCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::SpaceView> refusal{to_idl(a_view())};
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& m) { m.ages().pop_back(); }),
            "ages has 5 values; allowed: one for each of the 6 cubes");
  EXPECT_THAT(refusal([](auto& m) { m.size_x(0); }), HasSubstr("size_x is 0; allowed: 1 to 1024"));
  EXPECT_THAT(refusal([](auto& m) { m.cube_m(std::nan("")); }), HasSubstr("cube_m"));
  EXPECT_THAT(refusal([](auto& m) {
                m.size_x(64), m.size_y(64), m.size_z(9);
                m.ages().resize(64 * 64 * 9);
              }),
              HasSubstr("32768"));
}

}  // namespace
}  // namespace phantom::messages::living_codec
