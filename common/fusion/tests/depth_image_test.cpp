// A depth image is taken only with a sound header, and its pixels hold a depth or nothing.
#include "common/fusion/depth_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/fusion/tests/scenes.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::fusion {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

DepthHeader small_header() { return {{4, 3, 50.0, 50.0, 1.5, 1.0, 0.2, 5.0}, {}, 1.0}; }

TEST(DepthImage, HoldsADepthOrNothing) {
  DepthImage image;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const std::vector<float> depth_m{1.0F, NAN, kInf, -kInf, -1.0F, 0.0F, 0.1F, 0.2F, 5.0F, 5.1F, 1e30F, 2.0F};
  ASSERT_TRUE(image.load_m(small_header(), depth_m));
  const std::vector<float> expected{1, 0, 0, 0, 0, 0, 0, 0.2F, 5, 0, 0, 2};
  EXPECT_EQ(std::vector<float>(image.depth_m().begin(), image.depth_m().end()), expected);
  EXPECT_EQ(image.valid_pixels(), 4U);
  EXPECT_EQ(image.depth_m(3, 2), 2.0F);
}

TEST(DepthImage, TakesMillimetres) {
  DepthImage image;
  const std::vector<std::uint16_t> depth_mm{0, 199, 200, 1234, 5000, 5001, 65535, 1, 0, 0, 0, 0};
  ASSERT_TRUE(image.load_mm(small_header(), depth_mm));
  EXPECT_EQ(image.valid_pixels(), 3U);
  EXPECT_FLOAT_EQ(image.depth_m(3, 0), 1.234F);
}

TEST(DepthImage, RefusesEachFaultWithOneErrorAndKeepsTheFormerImage) {
  DepthImage image;
  ASSERT_TRUE(image.load_m(small_header(), std::vector<float>(12, 1.0F)));
  const std::vector<float> pixels(12, 2.0F);
  struct Fault {
    const char* names;
    void (*make)(DepthHeader&);
  };
  const Fault faults[] = {
      {"width_px is 0", [](DepthHeader& h) { h.camera.width_px = 0; }},
      {"height_px is -3", [](DepthHeader& h) { h.camera.height_px = -3; }},
      {"width_px is 4097", [](DepthHeader& h) { h.camera.width_px = 4097; }},
      {"4096 x 4096 pixels", [](DepthHeader& h) { h.camera.width_px = h.camera.height_px = 4096; }},
      {"fx_px is nan", [](DepthHeader& h) { h.camera.fx_px = kNan; }},
      {"fy_px is 0", [](DepthHeader& h) { h.camera.fy_px = 0.0; }},
      {"cx_px is 4", [](DepthHeader& h) { h.camera.cx_px = 4.0; }},
      {"cy_px is -1", [](DepthHeader& h) { h.camera.cy_px = -1.0; }},
      {"min_depth_m is 0", [](DepthHeader& h) { h.camera.min_depth_m = 0.0; }},
      {"max_depth_m is 0.1", [](DepthHeader& h) { h.camera.max_depth_m = 0.1; }},
      {"max_depth_m is inf", [](DepthHeader& h) { h.camera.max_depth_m = HUGE_VAL; }},
      {"rotation", [](DepthHeader& h) { h.X_WC.rotation(0, 0) = 1.01; }},
      {"rotation", [](DepthHeader& h) { h.X_WC.rotation(1, 2) = kNan; }},
      {"right-handed", [](DepthHeader& h) { h.X_WC.rotation(2, 2) = -1.0; }},
      {"pose y_m is 1001", [](DepthHeader& h) { h.X_WC.translation_m.y() = 1001.0; }},
      {"pose z_m is nan", [](DepthHeader& h) { h.X_WC.translation_m.z() = kNan; }},
      {"time_s is -1", [](DepthHeader& h) { h.time_s = -1.0; }},
      {"time_s is nan", [](DepthHeader& h) { h.time_s = kNan; }}};
  for (const Fault& fault : faults) {
    DepthHeader header = small_header();
    fault.make(header);
    const core::Status status = image.load_m(header, pixels);
    EXPECT_EQ(status.code(), core::ErrorCode::kInvalidArgument) << fault.names;
    EXPECT_THAT(status.message(), testing::AllOf(HasSubstr(fault.names), HasSubstr("allowed")));
  }
  EXPECT_THAT(image.load_m(small_header(), std::vector<float>(11)).message(), HasSubstr("11 pixels"));
  EXPECT_EQ(image.depth_m(0, 0), 1.0F);
}

TEST(DepthImage, LoadsAgainWithoutMemory) {
  DepthImage image;
  const std::vector<float> pixels(12, 1.0F);
  ASSERT_TRUE(image.load_m(small_header(), pixels));
  const DepthHeader header = small_header();
  const test::HeapGuard guard;
  EXPECT_TRUE(image.load_m(header, pixels).is_ok());
}

}  // namespace
}  // namespace phantom::fusion
