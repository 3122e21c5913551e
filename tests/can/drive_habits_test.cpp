// Habits of real drives that the standard permits, or that are common: such a drive is set up and powered
// like any other.
#include <gtest/gtest.h>

#include "tests/can/rig.hpp"

namespace phantom::drive_habits_test {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using test::group_config;
using test::Rig;

constexpr std::int64_t kNoRemoteRequest = 0x40000000;

TEST(DriveHabits, ATpdosBitThirtyStaysAsTheDriveHasIt) {
  for (const bool keeps : {true, false}) {
    Rig rig(group_config(DriveMode::kVelocity, 1));
    rig.drives[0]->misbehaviour.keeps_remote_bit = keeps;
    ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
    for (std::uint16_t tpdo = 0x1800; tpdo < 0x1804; ++tpdo)
      EXPECT_EQ((rig.drives[0]->dictionary().value(tpdo, 1) & kNoRemoteRequest) != 0, keeps)
          << std::hex << tpdo;
  }
}

TEST(DriveHabits, ModeZeroIsPermittedUntilTheDriveHasPower) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kTorque}) {
    Rig rig(group_config(mode, 1));
    rig.drives[0]->misbehaviour.hides_mode_unpowered = true;
    ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
    rig.command.quick_stop = true;
    rig.run(0.5);
    EXPECT_EQ(rig.state(), DriveGroupState::kQuickStop) << rig.group->sentence();
  }
}

// With power it must show the mode: nothing is followed before, and after mode_timeout_s it is a fault.
TEST(DriveHabits, WithPowerNothingIsFollowedInAModeThatIsNotShown) {
  auto config = group_config(DriveMode::kVelocity, 1);
  config.timing.mode_timeout_s = 0.3;
  Rig rig(config);
  rig.drives[0]->misbehaviour.hides_mode_unpowered = true;
  rig.command.enable = true;
  rig.command.velocity[0] = 0.5;
  ASSERT_GE(rig.run_until([&] { return rig.drive(0).phase == DrivePhase::kEnabling; }, 2.0), 0.0);
  rig.drives[0]->misbehaviour.shown_mode = -1;  // neither none nor the commanded one
  rig.run(1.5);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kModeMismatch);
  EXPECT_EQ(rig.drives[0]->motor().joint_rad(), 0.0);
}

TEST(DriveHabits, AModeIsWaitedForAsLongAsConfigured) {
  for (const double late_s : {0.8, 1.5}) {
    auto config = group_config(DriveMode::kVelocity, 1);
    config.timing.mode_timeout_s = 1.0;
    Rig rig(config);
    rig.drives[0]->misbehaviour.mode_late_s = late_s;
    EXPECT_EQ(rig.bring_up(), late_s < config.timing.mode_timeout_s);
    if (late_s > config.timing.mode_timeout_s) {
      EXPECT_EQ(rig.drive(0).fault, DriveFault::kModeMismatch);
    }
  }
}

// Tries slave_io: a drive warns
// A device-specific emergency code without the generic bit of the error register.
TEST(DriveHabits, ADevicesOwnWarningIsReportedAndStopsNothing) {
  Rig rig(group_config(DriveMode::kVelocity, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->warn(0xFF01, 0x80);
  rig.run(0.2);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
  EXPECT_EQ(can::warnings_of(rig.group->report(), {test::axis(1, DriveMode::kVelocity)}),
            "j1 warns (0xFF01)");
  rig.drives[0]->warn(0x0000, 0x00);
  rig.run(0.02);
  EXPECT_EQ(rig.drive(0).warning_code, 0);
  rig.drives[0]->warn(0xFF01, 0x81);  // with the generic bit it is an error
  rig.run(0.02);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kEmergency);
}

// CiA 301: of a PDO that is longer than its mapping, the first bytes count.
TEST(DriveHabits, PdosThatAreFilledUpToEightBytesAreRead) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kTorque}) {
    Rig rig(group_config(mode, 1));
    rig.drives[0]->misbehaviour.pad_pdo_bytes = 8;
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  }
}

TEST(DriveHabits, APdoThatIsTooShortIsToldWithItsMapping) {
  Rig rig(group_config(DriveMode::kVelocity, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->misbehaviour.cut_pdo_bytes = 1;
  rig.run(0.1);
  EXPECT_EQ(rig.group->sentence().find("j1 sent a PDO of "), 0U) << rig.group->sentence();
  EXPECT_NE(rig.group->sentence().find(" bytes where object 0x1A0"), std::string::npos);
}

// Each of a drive's refusals says which object it is, and what helps.
TEST(DriveHabits, ARefusedObjectIsToldWithWhatHelps) {
  const std::pair<std::uint16_t, const char*> kRefusals[] = {
      {0x6007, "it has to stop by itself when the master is lost"},
      {0x605A, "a quick stop has to end as configured"},
      {0x1A00, "free its PDO mapping"},
      {0x6060, "it takes no mode now"}};
  for (const auto& [index, advice] : kRefusals) {
    Rig rig(group_config(DriveMode::kVelocity, 1));
    rig.drives[0]->misbehaviour.lacks_object = index;
    EXPECT_FALSE(rig.bring_up());
    const std::string said = rig.group->sentence();
    char object[16];
    std::snprintf(object, sizeof object, "0x%04X", index);
    EXPECT_EQ(said.find(std::string("j1 refuses object ") + object), 0U) << said;
    EXPECT_NE(said.find(advice), std::string::npos) << said;
  }
}

// What CiA 402 leaves to the maker: the list of modes.
TEST(DriveHabits, ADriveWithoutTheListOfItsModesIsPowered) {
  constexpr std::uint16_t kSupportedModes = 0x6502;
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kTorque}) {
    Rig rig(group_config(mode, 1));
    rig.drives[0]->misbehaviour.lacks_object = kSupportedModes;
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  }
}

// A drive that needs long to boot would never be done, if it were reset again and again.
TEST(DriveHabits, ADriveThatIsNotHeardIsAskedAtGrowingIntervals) {
  auto config = group_config(DriveMode::kVelocity, 1);
  config.timing.boot_timeout_s = 0.5;
  can::Drive drive(config.axes[0], config);
  std::vector<double> asked_s;
  for (double t_s = 0.0; t_s < 12.0; t_s += 0.01) {
    can::Outbox out;
    drive.step(can::DriveGoal::kOff, false, can::BusState::kActive, core::from_seconds(1.0 + t_s), out);
    if (!out.frames().empty()) asked_s.push_back(t_s);
  }
  ASSERT_EQ(asked_s.size(), 6U);
  EXPECT_NEAR(asked_s[1] - asked_s[0], 0.5, 0.03);
  EXPECT_NEAR(asked_s[2] - asked_s[1], 1.0, 0.03);
  EXPECT_NEAR(asked_s[5] - asked_s[4], 4.0, 0.03);
  // Some send their state instead of a boot-up message.
  can::CanFrame state{.id = 0x701, .length = 1};
  state.data[0] = 0x7F;
  drive.on_frame(state, core::from_seconds(13.0));
  can::Outbox out;
  drive.step(can::DriveGoal::kOff, false, can::BusState::kActive, core::from_seconds(13.01), out);
  EXPECT_EQ(drive.report().phase, DrivePhase::kConfiguring);
}

}  // namespace
}  // namespace phantom::drive_habits_test
