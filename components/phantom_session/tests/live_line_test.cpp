#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/console.hpp"

namespace phantom::phantom_session {
namespace {

TEST(LiveLine, TellsTorquesWorstSensorClassAndModelAge) {
  Collector collector(0.05, 0.01, {});
  EXPECT_EQ(collector.live_line(), "no percept yet");
  collector.on_link_names({"base", "turret", "gripper"});
  collector.on_object_name(2, "vice");
  PerceptSample sample;
  sample.valid = true;
  sample.mu_Pa_s_per_m = 20.0;
  sample.motion = "nearing";
  sample.link = 2;
  sample.object = 2;
  sample.torque = {-0.5, 0.0, 1.234};
  collector.on_percept(sample);
  StatusSample status;
  status.component = "phantom_sensing";
  status.figures["model_age"] = 0.62;
  collector.on_status(status);
  EXPECT_EQ(collector.live_line(), "drag -0.50 +0.00 +1.23 | gripper, μ 20 of vice, nearing | model age 0.6 ms");
  sample.mu_Pa_s_per_m = 0.0;
  collector.on_percept(sample);
  EXPECT_EQ(collector.live_line(), "drag -0.50 +0.00 +1.23 | free | model age 0.6 ms");
  sample.muted_sensors = 7;
  collector.on_percept(sample);
  EXPECT_THAT(collector.live_line(), testing::HasSubstr("| 7 sensors muted |"));
  sample.valid = false;
  collector.on_percept(sample);
  EXPECT_THAT(collector.live_line(), testing::StartsWith("no percept"));
}

TEST(LiveLine, ALinkWithoutANameIsNumbered) {
  Collector collector(0.05, 0.01, {});
  PerceptSample sample;
  sample.valid = true;
  sample.mu_Pa_s_per_m = 9.0;
  sample.link = 5;
  sample.object = 3;
  collector.on_percept(sample);
  EXPECT_THAT(collector.live_line(), testing::HasSubstr("link 5, μ 9 of object 3"));
}

TEST(Console, CutsBetweenCharacters) {
  EXPECT_EQ(cut("μm and more", 2), "μm");
  EXPECT_EQ(cut("short", 80), "short");
  EXPECT_EQ(cut("abc", 0), "");
}

}  // namespace
}  // namespace phantom::phantom_session
