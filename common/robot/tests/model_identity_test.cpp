#include "common/robot/kinematics/model_identity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/printable.hpp"

namespace phantom::robot::model_identity_test {
namespace {

using testing::HasSubstr;

std::vector<DhRow> three_rows() {
  std::vector<DhRow> rows(3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].link = "l" + std::to_string(i + 1);
    rows[i].joint = "j" + std::to_string(i + 1);
    rows[i].a_m = 0.3;
    rows[i].lower = -1.0;
    rows[i].upper = 1.0;
    rows[i].max_speed = 1.2;
    rows[i].max_effort = 100.0;
  }
  return rows;
}

ModelIdentity identity(const std::vector<DhRow>& rows, const geometry::Pose& X_WB = {}) {
  auto made = identify(*SerialArm::from_dh(rows, DhConvention::kModified, X_WB));
  made.arm_file = "arm.yaml";
  made.cell_file = "cell.yaml";
  made.cell = 7;
  return made;
}

/// What a side with the three rows says of one whose rows were changed.
template <class Change>
std::string said(Change&& change) {
  auto rows = three_rows();
  change(rows);
  auto other = identity(rows);
  other.arm_file = "/opt/other.yaml";
  return difference(identity(three_rows()), label_of(other));
}

TEST(ModelIdentity, SR21_ADifferentJointIsNamedWithBothFiles) {
  EXPECT_EQ(said([](auto&) {}), "");
  const std::string turned = said([](auto& rows) { rows[1].alpha_rad = 3.14159; });
  EXPECT_THAT(turned,
              HasSubstr("another joint j2 (arm.yaml here, /opt/other.yaml there); here it is revolute"));
  EXPECT_THAT(said([](auto& rows) { rows[1].a_m = 0.45; }), HasSubstr("another joint j2"));
  EXPECT_THAT(said([](auto& rows) { rows[2].upper = 1.001; }), HasSubstr("another joint j3"));
  EXPECT_THAT(said([](auto& rows) { rows[0].max_speed = 1.3; }), HasSubstr("another joint j1"));
  EXPECT_THAT(said([](auto& rows) { rows[0].type = JointType::kPrismatic; }), HasSubstr("another joint j1"));
  EXPECT_THAT(said([](auto& rows) { rows.pop_back(); }), HasSubstr("its arm has 2 joints, this one's 3"));
}

TEST(ModelIdentity, SR21_AnotherPlaceOrCellIsNamed) {
  geometry::Pose moved;
  moved.translation_m.x() = 0.01;
  EXPECT_THAT(difference(identity(three_rows()), label_of(identity(three_rows(), moved))),
              HasSubstr("stands elsewhere"));
  auto other = identity(three_rows());
  other.cell = 8;
  EXPECT_EQ(difference(identity(three_rows()), label_of(other)),
            "its cell is another (cell.yaml here, cell.yaml there)");
  other.cell = 0;
  EXPECT_EQ(difference(identity(three_rows()), label_of(other)), "") << "it does not say which";
}

TEST(ModelIdentity, RoundingIsNoDifference) {
  auto rows = three_rows();
  for (DhRow& row : rows) row.a_m += 1e-12;
  EXPECT_EQ(difference(identity(three_rows()), label_of(identity(rows))), "");
}

TEST(ModelIdentity, WhatIsNoLabelSaysNothingAndAForgedOneForgesNoLog) {
  const ModelIdentity own = identity(three_rows());
  for (const char* label :
       {"", "typehash=1;", "phantom_model=1;", "phantom_model=1;joints=", "phantom_model=2;joints=0"})
    EXPECT_EQ(difference(own, label), "") << label;
  const std::string forged = difference(own, "phantom_model=1;arm=a\nreset by all\x1b[0m;joints=1,2,zz,3");
  EXPECT_THAT(forged, HasSubstr("another joint j1 (arm.yaml here, ? there)"));
  EXPECT_TRUE(core::is_printable(forged));
  EXPECT_THAT(difference(own, "phantom_model=1;joints=" + std::string(5000, ',') + "1"),
              testing::AnyOf("", HasSubstr("joints")));
}

TEST(ModelIdentity, OfSixteenJointsAndLongPathsTheLabelStaysShort) {
  std::vector<DhRow> rows(16, three_rows()[0]);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].link = rows[i].joint = "n" + std::to_string(i);
  auto made = identity(rows);
  made.arm_file = made.cell_file = "/" + std::string(4000, 'x') + "/end.yaml";
  EXPECT_LT(label_of(made).size(), 500u);
  EXPECT_THAT(label_of(made), HasSubstr("end.yaml"));
}

}  // namespace
}  // namespace phantom::robot::model_identity_test
