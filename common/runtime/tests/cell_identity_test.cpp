#include "common/runtime/cell/cell_identity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/runtime/cell/arm_model.hpp"

namespace phantom::runtime::cell_identity_test {
namespace {

using testing::HasSubstr;

CellConfig hot_cell() { return load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml"); }

std::string difference(const CellConfig& here, const CellConfig& there) {
  const robot::SerialArm arm = load_kinematics(here.arm());
  return robot::difference(identity_of(here, "", arm), robot::label_of(identity_of(there, "", arm)));
}

TEST(CellIdentity, SR21_TheSameFilesAreTheSameAndAMovedObjectIsAnotherCell) {
  CellConfig there = hot_cell();
  EXPECT_EQ(difference(hot_cell(), there), "");
  there.objects.back().X_WO.translation_m.z() += 0.002;
  EXPECT_THAT(difference(hot_cell(), there), HasSubstr("its cell is another"));
  EXPECT_THAT(difference(hot_cell(), there), HasSubstr("hot_cell/cell.yaml here"));
  there = hot_cell();
  there.objects.back().kind = ObjectKind::kProtectedZone;
  EXPECT_THAT(difference(hot_cell(), there), HasSubstr("its cell is another"));
  there = hot_cell();
  there.objects.pop_back();
  EXPECT_THAT(difference(hot_cell(), there), HasSubstr("its cell is another"));
}

}  // namespace
}  // namespace phantom::runtime::cell_identity_test
