// One pass through the operator's page in a real Chromium: it opens, draws the cell, shows numbers, and
// stops. All else of the page is in the stage `browser`.
#include <gmock/gmock.h>

#include "components/synthetic_viewer/tests/scene_rig.hpp"

namespace phantom::synthetic_viewer {
namespace {

using PageSmoke = test::SceneInChromium;

TEST_F(PageSmoke, OpensDrawsAndStops) {
  open();
  ASSERT_TRUE(drawn());
  EXPECT_TRUE(test::eventually([&] { return text("closeness") == "0.60"; })) << text("closeness");
  browser_->type({test::Browser::kEscape});
  EXPECT_TRUE(test::eventually([&] {
    const std::lock_guard lock(mutex_);
    return testing::Value(commands_, testing::Contains(teleop::CommandKind::kEmergencyStop));
  }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
