#include "components/audio_percept/listener.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace phantom::audio_percept {
namespace {

using percept::ViewNode;

constexpr double kDeg = std::numbers::pi / 180.0;

void expect_near(const Vector3& a, const Vector3& b) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-12) << "component " << i;
}

TEST(Listener, FacesIntoTheViewOfANode) {
  ListenerConfig listener;
  listener.position_m = {1.0, 2.0, 3.0};
  // From the south one looks north: x is right, y ahead, z up.
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kSouth), {1.5, 2.0, 3.0}),
              {0.5, 0.0, 0.0});
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kSouth), {1.0, 2.5, 3.0}),
              {0.0, 0.0, -0.5});
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kSouth), {1.0, 2.0, 3.5}),
              {0.0, 0.5, 0.0});
  // From the north all of it the other way round.
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kNorth), {1.5, 2.0, 3.0}),
              {-0.5, 0.0, 0.0});
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kNorth), {1.0, 2.5, 3.0}),
              {0.0, 0.0, 0.5});
  // From the east one looks west: y is right. From the top one looks down, y up in the picture.
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kEast), {1.0, 2.5, 3.0}),
              {0.5, 0.0, 0.0});
  expect_near(in_listener_frame(listener, listener_axes(listener, ViewNode::kTop), {1.5, 2.5, 2.5}),
              {0.5, 0.5, -0.5});
}

TEST(Listener, EveryViewIsARotation) {
  ListenerConfig listener;
  listener.position_m = {0, 0, 0};
  listener.main_azimuth_rad = -50 * kDeg;
  listener.main_elevation_rad = 26 * kDeg;
  for (int number = 0; number <= percept::kNodeCount; ++number) {
    const auto view = number == 0 ? std::nullopt : percept::node_from_number(number);
    const Vector3 x = in_listener_frame(listener, listener_axes(listener, view), {1, 0, 0}),
                  y = in_listener_frame(listener, listener_axes(listener, view), {0, 1, 0}),
                  z = in_listener_frame(listener, listener_axes(listener, view), {0, 0, 1});
    double dots[3] = {0, 0, 0}, norm = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      dots[0] += x[i] * y[i];
      dots[1] += y[i] * z[i];
      dots[2] += z[i] * x[i];
      norm += x[i] * x[i];
    }
    EXPECT_NEAR(norm, 1.0, 1e-12);
    for (const double dot : dots) EXPECT_NEAR(dot, 0.0, 1e-12);
    const double handed = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) +
                          x[2] * (y[0] * z[1] - y[1] * z[0]);
    EXPECT_NEAR(handed, 1.0, 1e-12) << number;
  }
}

TEST(Listener, TheMainViewStandsWhereTheViewerHasIt) {
  ListenerConfig listener;
  listener.position_m = {0, 0, 0};
  listener.main_azimuth_rad = -90 * kDeg;  // as from the south
  expect_near(in_listener_frame(listener, listener_axes(listener, std::nullopt), {0, 1, 0}), {0, 0, -1});
  listener.main_azimuth_rad = -50 * kDeg;
  listener.main_elevation_rad = 26 * kDeg;
  const Vector3 camera{std::cos(26 * kDeg) * std::cos(-50 * kDeg), std::cos(26 * kDeg) * std::sin(-50 * kDeg),
                       std::sin(26 * kDeg)};
  expect_near(in_listener_frame(listener, listener_axes(listener, std::nullopt), camera), {0, 0, 1});
}

TEST(Listener, GivesAzimuthAndElevation) {
  EXPECT_NEAR(azimuth_rad({1, 0, 0}), 90 * kDeg, 1e-12);
  EXPECT_NEAR(azimuth_rad({-1, 5, -1}), -45 * kDeg, 1e-12);
  EXPECT_EQ(azimuth_rad({0, 1, 0}), 0.0);
  EXPECT_NEAR(elevation_rad({1, 1, 0}), 45 * kDeg, 1e-12);
}

}  // namespace
}  // namespace phantom::audio_percept
